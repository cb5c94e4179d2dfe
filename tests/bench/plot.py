#!/usr/bin/env python3
"""Draws every figure of a results directory into it: tests/bench/plot.py DIR"""
import os
import sys

if sys.argv[1:] in ([], ["--help"]) and __name__ == "__main__":
    print(__doc__)
    sys.exit(0 if sys.argv[1:] else 2)
try:
    import matplotlib.lines
    import matplotlib.patches
    import PIL.Image

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit("plot.py: %s. Debian: apt-get install python3-matplotlib" % error)

sys.dont_write_bytecode = True  # nothing is left beside the sources
from table import OURS, machine, one, read, timed, values


def save(figure, directory, name, source, top=1):
    figure.text(0.01, 0.003, source, fontsize=6, color="gray")
    figure.tight_layout(rect=(0, 0.02, 1, top))
    path = os.path.join(directory, name + ".png")
    figure.savefig(path, dpi=110)
    PIL.Image.open(path).convert("RGB").quantize(256).save(path, optimize=True)  # half the size
    plt.close(figure)
    print(path)
    return figure


PILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "pile", "pictures", "cubes.png")


def on_devices(rows):
    """Two titles, and labels with what picks their rows. The paper's system has one thread a device, ours all threads."""
    most_threads = max(values(rows, "threads"))
    devices = [number for number in values(rows, "devices_used") if number]
    gpus = lambda number: "%d GPU%s" % (number, "s" if number > 1 else "")
    theirs = [("CPU, brute force", dict(peer=OURS + ":brute-force", threads=1)),
              ("CPU, axis lists", dict(peer=OURS + ":axis-lists", threads=1))]
    theirs += [(gpus(number), dict(peer=OURS + ":cuda-axis-lists", devices_used=number, threads=number)) for number in devices]
    ours = [("CPU, 1 thread", dict(peer=OURS, threads=1)), ("CPU, %d threads" % most_threads, dict(peer=OURS, threads=most_threads))]
    ours += [(gpus(number), dict(peer=OURS + ":cuda", devices_used=number, threads=most_threads)) for number in devices]
    return ("The paper's method, one thread a GPU", theirs), ("Ours, %d threads" % most_threads, ours)


def figure14(directory, rows):
    """The paper's figure 14: percent of the time of the paper's sequential CPU method, brute force."""
    scenes = values(rows, "scene")
    figure, grid = plt.subplots(1, 2, figsize=(13, 5), sharey=True)
    for axes, (title, series) in zip(grid, on_devices(rows)):
        for i, (label, wanted) in enumerate(series):
            for k, scene in enumerate(scenes):
                reference = one(rows, scene=scene, peer=OURS + ":brute-force", threads=1)
                row = one(rows, scene=scene, **wanted)
                if not row or not reference:
                    continue
                percent_of_cpu = 100 * row["median_ms"] / reference["median_ms"]
                place = k + i * 0.8 / len(series)
                axes.bar(place, percent_of_cpu, 0.75 / len(series), color="C%d" % i, label=label if k == 0 else None)
                axes.text(place, percent_of_cpu, "%.3g" % percent_of_cpu, ha="center", va="bottom", fontsize=6)
        axes.axhline(100, color="black", linewidth=0.8)
        axes.set_xticks([k + 0.4 - 0.4 / len(series) for k in range(len(scenes))])
        axes.set_xticklabels(["%s\n%d bodies" % (scene.replace("pile-", ""), one(rows, scene=scene)["n"]) for scene in scenes])
        axes.set(yscale="log", title=title)
        axes.legend(fontsize=8, ncol=2, loc="upper left")
    tops = [bar.get_height() for axes in grid for bar in axes.patches]
    grid[0].set_ylim(min(tops) / 2, max(tops) * 8)
    grid[0].set_ylabel("% of brute force on one thread, whole collide")
    return save(figure, directory, "paper-figure-14", machine(rows))


def figure15(directory, rows):
    """The paper's figure 15: the broad phase through the run of the balls."""
    figure, grid = plt.subplots(1, 2, figsize=(13, 5), sharey=True)
    for axes, (title, series) in zip(grid, on_devices(rows)):
        for label, wanted in series:
            some = timed(rows, **wanted)
            if some:
                axes.plot([int(row["scene"].rsplit("-")[-1]) for row in some], [row["median_ms"] for row in some], marker="o", markersize=3, label=label)
        axes.set(yscale="log", xlabel="step", title=title)
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8)
    grid[0].set_ylabel("ms a collide, balls")
    return save(figure, directory, "paper-figure-15", machine(rows))


STEP_PARTS = (("broad_ms", "broad phase", "#d55e00"), ("narrow_ms", "narrow phase", "#e69f00"),
              ("joints_ms", "contact joints", "#999999"), ("solver_ms", "solver", "#0072b2"))
FRAME_MS = 1000 / 60  # of a display


def step_axes(axes, rows):
    """Stacked bars, one a space, of rows of one size."""
    for place, row in enumerate(rows):
        if row["status"] != "ok":
            axes.text(place, 0, " " + row["status"], rotation=90, ha="center", va="bottom", fontsize=8)
            continue
        bottom = 0
        for column, _, colour in STEP_PARTS:
            axes.bar(place, row[column], 0.7, bottom=bottom, color=colour)
            bottom += row[column]
        axes.text(place, bottom, "%.3g" % bottom if bottom < 999.5 else "{:,.0f}".format(bottom), ha="center", va="bottom", fontsize=9)
    axes.axhline(FRAME_MS, color="black", linestyle="--", linewidth=1)
    axes.set_xticks(range(len(rows)))
    axes.set_xticklabels([str(row["space"]).replace("dSweepAndPruneSpace", "dSweepAnd\nPruneSpace").replace("one line", "one\nline").replace(" contacts", "\ncontacts")
                          for row in rows], fontsize=8)
    axes.set(title="{:,.0f} boxes, {:,.0f} contacts".format(rows[0]["bodies"], max(row["contacts"] or 0 for row in rows)))
    axes.margins(y=0.1)


def step(directory, rows):
    """The pile, and where the time of a whole step goes: a panel a size, a bar a space."""
    sizes = values(rows, "bodies")
    figure, (pile, *panels) = plt.subplots(1, 1 + len(sizes), figsize=(3.6 * (1 + len(sizes)), 4.6))
    pile.imshow(plt.imread(PILE)[:, 150:700])
    pile.set(title="the pile")
    pile.axis("off")
    for axes, bodies in zip(panels, sizes):
        step_axes(axes, [row for row in rows if row["bodies"] == bodies])
    panels[0].set_ylabel("ms a step")
    handles = [matplotlib.patches.Patch(color=colour, label=label) for _, label, colour in reversed(STEP_PARTS)]
    handles.append(matplotlib.lines.Line2D([], [], color="black", linestyle="--", linewidth=1, label="16.7 ms: 60 steps a second"))
    figure.legend(handles=handles, fontsize=9, ncol=len(handles), loc="upper center", frameon=False)
    return save(figure, directory, "step", "A pile of boxes on a terrain, up to %d threads in ours, one in the others; %s" % (
        max(values(rows, "threads")), machine(rows)), top=0.93)


def draw(directory):
    """The figures of the studies that have rows."""
    drawn = [figure(directory, rows) for figure in (figure14, figure15, step) for rows in [read(directory, figure.__name__)] if rows]
    return drawn or sys.exit(directory + ": no results")


if __name__ == "__main__":
    draw(sys.argv[1])
