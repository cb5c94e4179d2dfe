"""The figures of the trade-off study."""

import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

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
    names = sorted({broad_name(e).rsplit(",", 1)[0] for e in entries})
    figure, panels = plt.subplots(2, 2, figsize=(10, 8), sharex=True, sharey=True)
    for axes, offset in zip(panels.flat, study.OFFSETS):
        here = [e for e in entries if e["offset"] == offset and e["missed"] == 0]
        for name in names:
            for precision in ("double", "single"):
                line = sorted((e for e in here if broad_name(e) == name + ", " + precision), key=lambda e: e["tolerance"])
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


def broad_name(entry):
    names = {"hash": "dHashSpace", "sap": "dSweepAndPruneSpace"}
    name = names.get(entry["space"])
    if not name:
        threads = "all threads" if entry["threads"] == 0 else "%d thread" % entry["threads"]
        name = "parallel-sap, " + ("GPU" if entry["backend"] == "cuda" else threads)
    return name + ", " + entry["precision"]


def scatter(axes, entries, y):
    for dt in sorted({e["dt"] for e in entries}):
        for stepping, marker in (("serial", "o"), ("parallel", "^")):
            for precision in ("double", "single"):
                some = [e for e in entries if (e["dt"], e["stepping"], e["precision"]) == (dt, stepping, precision)]
                colour = "C%d" % sorted({e["dt"] for e in entries}).index(dt)
                axes.scatter([e["wall_s_per_s"] for e in some], [max(e[y], LEAST) for e in some], s=16, marker=marker,
                             edgecolors=colour, facecolors=colour if precision == "double" else "none", zorder=2,
                             label="%g s" % dt if (stepping, precision) == ("serial", "double") else None)
    axes.set(xscale="log", yscale="log", xlabel="wall time a simulated second, s")
    axes.grid(True, which="major", alpha=0.3)


LEGEND = "circles: one core, triangles: all; filled: double precision, hollow: single"


def pile(entries, directory, note, reference):
    """`reference` are entries of their own: the reference's error is 0, which no logarithm shows."""
    known = [e for e in entries if e["error"] != float("inf")]
    figure, axes = plt.subplots(figsize=(8, 6))
    scatter(axes, known, "error")
    draw_front(axes, known, "wall_s_per_s", "error", "wall_s_per_s", LEAST)
    for limit in study.LIMITS:
        axes.axhline(limit, color="gray", linewidth=0.7, linestyle="--")
        axes.text(axes.get_xlim()[0], limit, " %g %%" % (100 * limit), fontsize=7, va="bottom", color="gray")
    for e in reference:
        if e["error"] > 0:
            axes.axhline(e["error"], color="black", linewidth=0.7, linestyle=":")
            axes.text(axes.get_xlim()[1], e["error"], "the reference's own uncertainty ", fontsize=7, va="bottom",
                      ha="right")
    axes.set(ylabel="error against the reference", title="A heap of boxes: time against accuracy\n" + LEGEND)
    axes.legend(fontsize=7, title="time step", title_fontsize=7)
    paths = [save(figure, directory, "pile", note)]

    figure, panels = plt.subplots(2, 2, figsize=(10, 8))
    for axes, part in zip(panels.flat, study.PARTS):
        scatter(axes, known, part)
        axes.set(title=part, ylabel="share")
    panels[0][0].legend(fontsize=7, title="time step", title_fontsize=7)
    figure.suptitle("The four parts of the error. " + LEGEND, fontsize=9)
    paths.append(save(figure, directory, "pile-parts", note))
    return paths
