#!/usr/bin/env python3
"""Draws every figure of a results directory into it: tests/bench/plot.py DIR"""
import argparse
import os
import sys

try:
    import matplotlib
    import matplotlib.lines
    import matplotlib.patches

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    if __name__ != "__main__":
        raise
    if not {"-h", "--help"} & set(sys.argv):
        sys.exit("plot.py: %s. Debian: apt-get install python3-matplotlib" % error)

sys.dont_write_bytecode = True  # nothing is left beside the sources
from results import LIBRARIES, ODE_SPACES, OURS, RIVALS, best, machine, on_devices, one, read, timed, values

COLOURS = dict(zip(LIBRARIES + ODE_SPACES + RIVALS,
                   ["C%d" % i for i in range(10)] + ["#003c30", "#7f3b08", "#01665e", "#35978f", "#80cdc1", "#c7eae5",
                                                     "#8c510a", "#bf812d", "#dfc27d", "#542788"]))


def style(peer):
    """Ours stands out, ODE's spaces are dashed."""
    if peer.startswith(OURS):
        return {"color": "black", "linewidth": 2.5, "zorder": 3}
    return {"color": COLOURS.get(peer), "linestyle": "--" if peer in ODE_SPACES else "-"}


def save(figure, directory, name, rows):
    figure.text(0.01, 0.003, machine(rows), fontsize=6, color="gray")
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    path = os.path.join(directory, name + ".png")
    figure.savefig(path, dpi=110)
    plt.close(figure)
    print(path)


def line(axes, rows, x, y, label, **look):
    axes.plot([row[x] for row in rows], [row[y] for row in rows], marker="o", markersize=3, label=label, **look)


def peers(directory):
    rows = read(directory, "peers")
    for threads in values(rows, "threads"):
        if len(values(timed(rows, scene="dense-cube", threads=threads), "n")) < 2:
            continue  # no lines
        figure, axes = plt.subplots(figsize=(8, 6))
        for peer in values(rows, "peer"):
            some = timed(rows, scene="dense-cube", peer=peer, threads=threads)
            if some:
                line(axes, some, "n", "median_ms", peer, **style(peer))
        axes.set(xscale="log", yscale="log", xlabel="boxes", ylabel="ms a frame",
                 title="Dense cube, all moving, %d thread%s" % (threads, "s" if threads > 1 else ""))
        axes.grid(True, which="major", alpha=0.3)
        axes.legend(fontsize=8)
        save(figure, directory, "peers-%d-threads" % threads, rows)


def distributions(directory):
    rows = read(directory, "peers")
    threads = max(values(rows, "threads"))
    for n in values(rows, "n"):
        bars = []
        for scene in values(rows, "scene"):
            ours, other = one(rows, scene=scene, n=n, peer=OURS, threads=threads), best(rows, scene, n, threads, LIBRARIES)
            if ours and other:
                bars.append((scene, other["median_ms"] / ours["median_ms"], other["peer"]))
        if not bars:
            continue
        figure, axes = plt.subplots(figsize=(8, 0.5 + 0.3 * len(bars) + 1))
        axes.barh([bar[0] for bar in bars], [bar[1] for bar in bars], color=[COLOURS[bar[2]] for bar in bars])
        for i, bar in enumerate(bars):
            axes.text(bar[1], i, " %.1f× %s" % bar[1:], va="center", fontsize=7)
        axes.axvline(1, color="black", linewidth=1)
        axes.invert_yaxis()
        axes.margins(x=0.2)
        axes.set(xlabel="time of the best other library / ours",
                 title="{:,.0f} boxes, {:.0f} threads".format(n, threads))
        save(figure, directory, "distributions-%d" % n, rows)


def small(directory):
    rows = read(directory, "small")
    for moving in values(rows, "moving"):
        scenes = values([row for row in rows if row["moving"] == moving], "scene")
        figure, grid = plt.subplots(2, (len(scenes) + 1) // 2, figsize=(14, 8), squeeze=False)
        for axes, scene in zip(grid.flat, scenes):
            for peer in values(rows, "peer"):
                some = [row for row in timed(rows, scene=scene, peer=peer, moving=moving) if row["median_ms"] > 0]
                if some:
                    line(axes, [dict(row, us=1000 * row["median_ms"]) for row in some], "n", "us", peer, **style(peer))
            axes.set(xscale="log", yscale="log", xlabel="geoms", ylabel="µs a collide", title=scene)
            axes.grid(True, alpha=0.3)
        grid.flat[0].legend(fontsize=8)
        save(figure, directory, "small-" + ("moving" if moving else "still"), rows)


def speed_up(axes, series, title):
    """Each of `series` is a label, threads and milliseconds; beside them what would be ideal."""
    most = max(max(threads) for _, threads, _ in series)
    axes.plot([1, most], [1, most], color="gray", linestyle=":", label="ideal")
    for label, threads, times in series:
        axes.plot(threads, [times[0] / time for time in times], marker="o", label=label)
    axes.set(xlabel="threads", ylabel="speed-up", title=title)
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)


def scaling(directory):
    rows = read(directory, "scaling")
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5))
    for axes, stage, title in ((left, "median_ms", "Whole"), (right, "extract_ms", "Extraction")):
        series = []
        for peer in values(rows, "peer"):
            some = [row for row in timed(rows, peer=peer) if row[stage]]
            if some:
                series.append(("{}, {:,.0f} boxes".format(peer, some[0]["n"]), [row["threads"] for row in some],
                               [row[stage] for row in some]))
        speed_up(axes, series, title)
    save(figure, directory, "scaling", rows)


def cost(directory):
    rows = read(directory, "cost")
    threads = max(values(rows, "threads"))
    scenes = values(rows, "scene")
    figure, axes = plt.subplots(figsize=(9, 0.45 * len(scenes) + 1.5))
    for i, n in enumerate(values(rows, "n")):
        found = [one(rows, scene=scene, n=n, threads=threads) for scene in scenes]
        axes.barh([k + 0.4 * i for k in range(len(scenes))], [row["ns_per_pair"] if row else 0 for row in found],
                  height=0.38, label="{:,.0f} boxes".format(n))
    axes.set_yticks([k + 0.2 for k in range(len(scenes))])
    axes.set_yticklabels(scenes)
    axes.invert_yaxis()
    axes.set(xlabel="ns a pair", title="Cost of a pair, %d threads" % threads)
    axes.legend()
    save(figure, directory, "cost", rows)


def memory(directory):
    rows = [row for row in timed(read(directory, "memory")) if row["scene"] == "dense-cube"]
    figure, axes = plt.subplots(figsize=(8, 5))
    for peer in values(rows, "peer"):
        some = [dict(row, each=row["held_bytes"] / row["n"]) for row in timed(rows, peer=peer)]
        line(axes, some, "n", "each", peer, **style(peer))
    ours = [dict(row, each=150 + 16 * row["pairs"] / row["n"]) for row in timed(rows, peer=OURS)]
    line(axes, ours, "n", "each", "150 bytes + 16 a pair", color="gray", linestyle=":")
    axes.set(xscale="log", yscale="log", xlabel="boxes", ylabel="resident bytes a box", title="Memory, dense cube")
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)
    save(figure, directory, "memory", rows)


def percent(directory, stage, figure_name, title):
    """The paper's figures 6 and 8: percent of the time of one thread, a block of bars a scene."""
    rows = read(directory, "paper")
    methods, threads = values(rows, "method"), values(rows, "threads")
    figure, grid = plt.subplots(1, len(methods), figsize=(6 * len(methods), 4.5), squeeze=False)
    for axes, method in zip(grid.flat, methods):
        scenes = values(timed(rows, method=method), "scene")
        for i, number in enumerate(threads):
            heights = []
            for scene in scenes:
                first, row = (one(rows, scene=scene, method=method, threads=t) for t in (1, number))
                heights.append(100 * row[stage] / first[stage])
            axes.bar([k + i * 0.8 / len(threads) for k in range(len(scenes))], heights, 0.75 / len(threads),
                     label="%d thread%s" % (number, "s" if number > 1 else ""))
        axes.set_xticks([k + 0.4 - 0.4 / len(threads) for k in range(len(scenes))])
        axes.set_xticklabels(scenes)
        axes.set(ylabel="% of one thread", title="%s, %s" % (title, method))
        axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
        axes.legend(fontsize=8, ncol=(len(threads) + 1) // 2, loc="upper center")
    save(figure, directory, figure_name, rows)


def paper(directory):
    percent(directory, "update_ms", "paper-figure-6", "AABB update")
    percent(directory, "overlap_ms", "paper-figure-8", "Overlapping pairs")
    rows = read(directory, "paper")
    methods = values(rows, "method")
    figure, grid = plt.subplots(1, len(methods), figsize=(6 * len(methods), 5), squeeze=False)
    for axes, method in zip(grid.flat, methods):
        series = []
        for scene in values(rows, "scene"):
            some = timed(rows, scene=scene, method=method)
            series.append((scene, [row["threads"] for row in some], [row["total_ms"] for row in some]))
        speed_up(axes, series, "Whole collide, " + method)
    save(figure, directory, "paper-figure-9", rows)


def persistent(directory):
    rows = read(directory, "persistent")
    scenes = values(rows, "scene")
    figure, grid = plt.subplots(1, len(scenes), figsize=(5 * len(scenes), 4.5), squeeze=False)
    for axes, scene in zip(grid.flat, scenes):
        most = max(values(rows, "threads"))
        for peer in values(rows, "peer"):
            some = timed(rows, scene=scene, peer=peer)
            if len(some) == 1 and most > 1:  # takes no number of threads
                axes.axhline(some[0]["median_ms"], label=peer, **style(peer))
            elif some:
                look = dict(style(peer), linestyle="--" if "brute" in peer else "-")
                line(axes, some, "threads", "median_ms", peer, **look)
        axes.set(yscale="log", xlabel="threads", ylabel="ms a frame", title=scene)
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=7)
    save(figure, directory, "persistent", rows)


def figure14(directory):
    """The paper's figure 14: percent of the time of the paper's sequential CPU method, brute force."""
    rows = read(directory, "figure14")
    scenes = values(rows, "scene")
    figure, grid = plt.subplots(1, 2, figsize=(13, 5), sharey=True)
    for axes, (title, series) in zip(grid, on_devices(rows)):
        for i, (label, wanted) in enumerate(series):
            for k, scene in enumerate(scenes):
                reference = one(rows, scene=scene, method="brute-force", threads=1)
                row = one(rows, scene=scene, **wanted)
                if not row or not reference:
                    continue
                percent_of_cpu = 100 * row["total_ms"] / reference["total_ms"]
                place = k + i * 0.8 / len(series)
                axes.bar(place, percent_of_cpu, 0.75 / len(series), color="C%d" % i, label=label if k == 0 else None)
                axes.text(place, percent_of_cpu, "%.3g" % percent_of_cpu, ha="center", va="bottom", fontsize=6)
        axes.axhline(100, color="black", linewidth=0.8)
        axes.set_xticks([k + 0.4 - 0.4 / len(series) for k in range(len(scenes))])
        axes.set_xticklabels(["%s\n%d bodies" % (scene, one(rows, scene=scene)["bodies"]) for scene in scenes])
        axes.set(yscale="log", title=title)
        axes.legend(fontsize=8, ncol=2, loc="upper left")
    tops = [bar.get_height() for axes in grid for bar in axes.patches]
    grid[0].set_ylim(min(tops) / 2, max(tops) * 8)
    grid[0].set_ylabel("% of brute force on one thread, whole collide")
    save(figure, directory, "paper-figure-14", rows)


def figure15(directory):
    """The paper's figure 15: the broad phase through the run of the balls."""
    rows = read(directory, "figure15")
    figure, grid = plt.subplots(1, 2, figsize=(13, 5), sharey=True)
    for axes, (title, series) in zip(grid, on_devices(rows)):
        for label, wanted in series:
            some = timed(rows, **wanted)
            if some:
                line(axes, some, "step", "total_ms", label)
        axes.set(yscale="log", xlabel="step", title=title)
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8)
    grid[0].set_ylabel("ms a collide, balls")
    save(figure, directory, "paper-figure-15", rows)


def devices(directory):
    """Time by size on the CPU, on GPUs and as Auto chooses; and what further GPUs bring."""
    rows = [row for row in read(directory, "devices") if row["scene"] == "cube"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5))
    for on in values(rows, "on"):
        some = timed(rows, on=on)
        label = "Auto" if on == "auto" else "CPU" if on == 0 else "%d GPU%s" % (on, "s" if on > 1 else "")
        look = {"color": "black", "linestyle": ":", "linewidth": 2.5} if on == "auto" else {}
        line(left, some, "n", "median_ms", label, **look)
        if on not in (0, 1, "auto"):
            pairs = [(row, one(rows, n=row["n"], on=1)) for row in some if row["n"] >= 1e5]
            right.plot([row["n"] for row, single in pairs],
                       [single["median_ms"] / row["median_ms"] for row, single in pairs], marker="o", label=label)
    left.plot([row["n"] for row in timed(rows, on=1)], [row["floor_ms"] for row in timed(rows, on=1)],
              color="gray", linewidth=1, label="24 n + 8 pairs bytes at 55 GB/s")
    left.set(xscale="log", yscale="log", xlabel="boxes", ylabel="ms, boxes to pairs in host memory",
             title="Dense cube: finding the pairs")
    right.set(xscale="log", xlabel="boxes", ylabel="times as fast as one GPU", title="Several GPUs")
    right.axhline(1, color="black", linewidth=0.8)
    for axes in (left, right):
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8)
    save(figure, directory, "devices", rows)


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
    axes.set_xticklabels([str(row["space"]).replace("dSweepAndPruneSpace", "dSweepAnd\nPruneSpace").replace("ours, ", "ours,\n").replace(" contacts", "\ncontacts")
                          for row in rows], fontsize=8)
    axes.set(title="{:,.0f} boxes, {:,.0f} contacts".format(rows[0]["bodies"], max(row["contacts"] or 0 for row in rows)))
    axes.margins(y=0.1)


def step(directory):
    """Where the time of a whole step goes: a panel a size, a bar a space."""
    rows = read(directory, "step")
    sizes = values(rows, "bodies")
    figure, grid = plt.subplots(1, len(sizes), figsize=(4.2 * len(sizes), 4.6), squeeze=False)
    for axes, bodies in zip(grid.flat, sizes):
        step_axes(axes, [row for row in rows if row["bodies"] == bodies])
    grid.flat[0].set_ylabel("ms a step")
    handles = [matplotlib.patches.Patch(color=colour, label=label) for _, label, colour in reversed(STEP_PARTS)]
    handles.append(matplotlib.lines.Line2D([], [], color="black", linestyle="--", linewidth=1, label="16.7 ms: 60 steps a second"))
    figure.legend(handles=handles, fontsize=9, ncol=len(handles), loc="upper center", frameon=False)
    row = rows[0]
    figure.text(0.01, 0.005, "A pile of boxes on a terrain, up to %d threads in ours, one in the others; %s, %d cores; commit %s, %s" % (
        max(values(rows, "threads")), row["cpu"], row["cores"], row["commit"] or "unknown", row["date"]), fontsize=7, color="gray")
    figure.tight_layout(rect=(0, 0.02, 1, 0.93))
    path = os.path.join(directory, "step.png")
    figure.savefig(path, dpi=110)
    print(path)
    return figure


FIGURES = ((peers, "peers"), (distributions, "peers"), (small, "small"), (scaling, "scaling"), (cost, "cost"),
           (memory, "memory"), (paper, "paper"), (persistent, "persistent"), (figure14, "figure14"),
           (figure15, "figure15"), (devices, "devices"), (step, "step"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directories", nargs="+", metavar="DIR")
    parser.add_argument("--only", choices=sorted({study for _, study in FIGURES}), help="the figures of this study alone")
    options = parser.parse_args()
    for directory in options.directories:
        drawn = 0
        for figure, study in FIGURES:
            if options.only in (None, study) and read(directory, study):
                figure(directory)
                drawn += 1
        if not drawn:
            sys.exit(directory + ": no results")


if __name__ == "__main__":
    main()
