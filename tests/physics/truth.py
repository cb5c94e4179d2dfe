#!/usr/bin/env python3
"""What the rows of physics-truth say: truth.py writes the table of orders into README.md and draws results/truth.png;
truth.py --check tests that README.md has the table of the rows."""

import csv
import math
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
PAGE = os.path.join(HERE, "README.md")
BEGIN, END = "<!-- truth -->\n", "<!-- end -->\n"
# As ODE comes, and below which an error is rounding.
CFM = {"double": 1e-10, "single": 1e-5}
ROUNDING = {"double": 1e-9, "single": 1e-4}
NEGLIGIBLE = 1e-3
COARSE, FINE = 0.01, 0.000625  # steps, seconds


def read(precision):
    path = os.path.join(HERE, "results", "truth-%s.csv" % precision)
    if not os.path.exists(path):
        return []
    texts = ("scene", "quantity", "precision", "friction", "solver")
    with open(path, newline="", encoding="utf-8") as file:
        return [{name: value if name in texts else float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def as_it_comes(row, *but):
    base = dict(dt=COARSE, iterations=20, contacts=4, erp=0.2, cfm=CFM[row["precision"]], friction="pyramid", solver="quick")
    return all(row[name] == value for name, value in base.items() if name not in but)


def by_step(rows, scene, quantity, solver="quick", friction="pyramid"):
    found = [row for row in rows if row["scene"] == scene and row["quantity"] == quantity and row["solver"] == solver and
             row["friction"] == friction and as_it_comes(row, "dt", "solver", "friction")]
    return sorted(((row["dt"], row["error"]) for row in found), reverse=True)


def order(points, precision):
    """The p of error = c dt^p, by least squares of the logarithms over steps of 10 ms and less; or a word."""
    points = [(dt, error) for dt, error in points if dt <= COARSE]
    worst = max(error for _, error in points)
    if worst < NEGLIGIBLE:
        return "exact" if worst < ROUNDING[precision] else "below 0.1 %"
    fine = [(math.log(dt), math.log(error)) for dt, error in points if error > ROUNDING[precision]]
    x, y = (sum(values) / len(fine) for values in zip(*fine))
    slope = sum((a - x) * (b - y) for a, b in fine) / sum((a - x) ** 2 for a, _ in fine)
    return "does not converge" if slope < 0.2 else "%.1f" % slope


def quantities(rows):
    return list(dict.fromkeys((row["scene"], row["quantity"]) for row in rows))


def percent(error):
    return "0" if error < ROUNDING["double"] else "%.2g %%" % (100 * error) if error < 0.995 else "100 %"


def table(rows):
    """One row for each quantity; with friction also with fdir1, where that makes a difference."""
    lines = ["| scene | off at 10 ms | at 0.6 ms | order | dWorldStep | single |", "| --- | ---: | ---: | --- | --- | --- |"]
    single = read("single")
    for scene, quantity in quantities(rows):
        plain = dict(by_step(rows, scene, quantity))
        for friction in "pyramid", "fdir1":
            points = dict(by_step(rows, scene, quantity, friction=friction))
            if not points or (friction == "fdir1" and points[COARSE] > plain[COARSE] / 2):
                continue
            cells = [percent(points[dt]) for dt in (COARSE, FINE)]
            for some, solver, precision in (rows, "quick", "double"), (rows, "step", "double"), (single, "quick", "single"):
                found = by_step(some, scene, quantity, solver, friction)
                cells.append(order(found, precision) if found else "-")
            lines.append("| %s: %s%s | %s |" % (scene, quantity, ", fdir1" * (friction == "fdir1"), " | ".join(cells)))
    return "\n".join(lines) + "\n"


def draw(rows, path):
    """A panel a scene: error against the work of a simulated second."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure, panels = plt.subplots(4, 4, figsize=(17, 15))
    varied = (("dt", "steps"), ("iterations", "iterations"), ("erp", "ERP"), ("cfm", "CFM"), ("contacts", "contacts"))
    single = read("single")
    for panel, scene in zip(panels.flat, scenes):
        quantity = next(row["quantity"] for row in rows if row["scene"] == scene)
        here = [row for row in rows if row["scene"] == scene and row["quantity"] == quantity]

        def show(some, label, style):
            points = sorted((row["iterations"] / row["dt"], max(row["error"], 1e-12)) for row in some)
            if points:
                panel.loglog(*zip(*points), style, label=label, markersize=4, linewidth=1)

        for name, label in varied[:2]:
            show([r for r in here if as_it_comes(r, name)], label, "o-" if name == "dt" else "s-")
        show([r for r in here if as_it_comes(r, "dt", "solver") and r["solver"] == "step"], "steps, dWorldStep", "x--")
        show([r for r in here if as_it_comes(r, "dt", "friction") and r["friction"] == "fdir1"], "steps, fdir1", "v-")
        show([r for r in single if r["scene"] == scene and r["quantity"] == quantity and as_it_comes(r, "dt")],
             "steps, single precision", "+:")
        for (name, label), mark in zip(varied[2:], "^D*"):
            show([r for r in here if as_it_comes(r, name)], label, "C%d%s" % (5 + "^D*".index(mark), mark))
        panel.set_title("%s: %s" % (scene, quantity), fontsize=9)
        panel.grid(alpha=0.3)
    panels[0][0].legend(fontsize=7)
    for panel in panels[-1]:
        panel.set_xlabel("steps × iterations a simulated second (dWorldStep: as 20)", fontsize=8)
    for panel in panels[:, 0]:
        panel.set_ylabel("error, as a share", fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=70)


def main():
    rows = read("double")
    with open(PAGE, encoding="utf-8") as file:
        text = file.read()
    before, rest = text.split(BEGIN, 1)
    new = before + BEGIN + "\n" + table(rows) + "\n" + END + rest.split(END, 1)[1]
    if sys.argv[1:] == ["--check"]:
        sys.exit(0 if new == text else "README.md has another table than the rows: call truth.py")
    if sys.argv[1:]:
        sys.exit(__doc__)
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(new)
    draw(rows, os.path.join(HERE, "results", "truth.png"))


main()
