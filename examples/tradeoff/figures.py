"""The figures of the trade-off study."""

import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import stats
import study

LEAST = 1e-6  # an error of nothing is drawn here


def save(figure, directory, name, note):
    figure.text(0.01, 0.004, note, fontsize=6, color="gray")
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    path = os.path.join(directory, name + ".png")
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path


def draw_front(axes, entries, x, y, cost, least):
    best = study.front(entries, cost)
    axes.plot([max(e[x], least) for e in best], [max(e[y], least) for e in best], color="black", linewidth=1, zorder=1,
              label="Pareto front")


def broad(entries, directory, note):
    """A panel an offset: milliseconds against extra pairs; the tolerances of one back end are joined."""
    none = 1e-4  # no extra pair is drawn here
    names = sorted({study.space_name(e).rsplit(",", 1)[0] for e in entries})
    figure, panels = plt.subplots(2, 2, figsize=(10, 8), sharex=True, sharey=True)
    for axes, offset in zip(panels.flat, study.OFFSETS):
        here = [e for e in entries if e["offset"] == offset and e["missed"] == 0]
        for name in names:
            for precision in ("double", "single"):
                line = sorted((e for e in here if study.space_name(e) == name + ", " + precision), key=lambda e: e["tolerance"])
                axes.plot([max(e["extra_per_exact"], none) for e in line], [e["ms"] for e in line], marker="o",
                          markersize=5, linestyle="-" if precision == "double" else ":",
                          fillstyle="full" if precision == "double" else "none", color="C%d" % names.index(name),
                          label=name if precision == "double" else None)
        draw_front(axes, here, "extra_per_exact", "ms", "ms", none)
        axes.set(xscale="log", yscale="log", title="%g m from the origin" % offset)
        axes.grid(True, which="major", alpha=0.3)
        axes.tick_params(labelbottom=True)
    for axes in panels[1]:
        axes.set_xlabel("extra pairs per exact pair (none: at the left edge)")
    for axes in panels[:, 0]:
        axes.set_ylabel("ms a frame")
    panels[0][0].legend(fontsize=7)
    figure.suptitle("Filled: double precision, hollow: single. Lines: more tolerance. Left out: what misses pairs",
                    fontsize=9)
    return save(figure, directory, "broad", note)


def bars(found):
    """Lengths to both sides of the mean, as matplotlib takes them."""
    return [[max(0.0, found.mean - found.low)], [max(0.0, found.high - found.mean)]]


def scene(result, limits, directory, note):
    """Time against error, each with its interval."""
    figure, axes = plt.subplots(figsize=(8, 6))
    steps = sorted({name.dt for name in result.intervals})
    drawn = set()
    for name, found in result.intervals.items():
        cost, colour = result.costs[name], "C%d" % steps.index(name.dt)
        axes.errorbar([1000 * cost.mean], [max(found.mean, LEAST)], xerr=[[1000 * v[0]] for v in bars(cost)], yerr=bars(found),
                      fmt="s" if name.solver == "step" else "o", markersize=4, linewidth=0.6, color=colour,
                      fillstyle="full" if name.precision == "double" else "none",
                      label=None if name.dt in drawn else "%g s" % name.dt)
        drawn.add(name.dt)
    best = stats.front(result.intervals, {name: cost.mean for name, cost in result.costs.items()})
    axes.plot([1000 * result.costs[name].mean for name in best], [max(result.intervals[name].mean, LEAST) for name in best],
              color="black", linewidth=1, zorder=1)
    for limit in limits:
        axes.axhline(limit, color="gray", linewidth=0.7, linestyle="--")
        axes.text(0, limit, " %g %%" % (100 * limit), fontsize=7, va="bottom", color="gray",
                  transform=axes.get_yaxis_transform())
    axes.axhspan(result.reference.low, result.reference.high, color="black", alpha=0.1, linewidth=0,
                 label="one run of the reference")
    axes.set(xscale="log", yscale="log", xlabel="processor time a simulated second, ms",
             ylabel="error against the reference", title=result.scene.title +
             "\nbars: 95 % intervals over seeds; squares: dWorldStep; hollow: single precision; line: front")
    axes.title.set_fontsize(9)
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=7, title="time step", title_fontsize=7)
    return save(figure, directory, result.scene.name, note)
