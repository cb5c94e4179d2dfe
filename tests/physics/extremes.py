#!/usr/bin/env python3
"""What ODE does to physics, by the rows of results/ that physics-table and physics-truth make:

    extremes.py measure PROGRAM ROWS.csv   plays extremes that have no row there yet, on all cores; goes on where it was
    extremes.py check [PROGRAM]            whether README.md has the tables of the rows, and each extreme of the program a row
    extremes.py draw                       results/truth.png, and README.md's tables
"""
import concurrent.futures
import csv
import math
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
PAGE, RESULTS = os.path.join(HERE, "README.md"), os.path.join(HERE, "results")
PRECISIONS, STARTS = ("double", "single"), "10"
SERIES = (("mass that a box bears, in its own", r"a box on one as large, 1:(\S+) of its mass"), ("boxes in a stack", r"a stack of (\d+)"),
          ("step of a stack of 5, s", r"a stack of 5, steps of (\S+) s"),
          ("speed of 0.2 m at a plate of 0.1 m, m/s", r"boxes of 0.2 m at a plate.* (\d+) m/s"))
# Of the scenes with an answer: CFM as ODE comes, and below which an error is rounding; steps in seconds.
CFM, ROUNDING = dict(double=1e-10, single=1e-5), dict(double=1e-9, single=1e-4)
NEGLIGIBLE, COARSE, FINE = 1e-3, 0.01, 0.000625


def said(*words):
    return subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()


def read(path):
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def rows_of(path):
    return {row["extreme"]: row for row in read(path)}


def recorded():
    return {precision: rows_of(os.path.join(RESULTS, precision + ".csv")) for precision in PRECISIONS}


def measure(program, path):
    names, known = said(program, "list"), rows_of(path)
    with open(path, "a", encoding="utf-8") as file, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        made = [pool.submit(said, program, "row", name) for name in names if name not in known]
        for number, done in enumerate(concurrent.futures.as_completed(made)):
            print(*done.result()[number > 0 or bool(known):], sep="\n", file=file, flush=True)
    known = rows_of(path)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, known[names[0]], lineterminator="\n")
        writer.writeheader()
        writer.writerows(known[name] for name in names)


def thresholds():
    """Of each series, up to where all starts do what they owe, and from where on none does."""
    lines = ["| value | double precision: all up to | none from | single precision: all up to | none from |",
             "| --- | ---: | ---: | ---: | ---: |"]
    for title, pattern in SERIES:
        cells = []
        for rows in recorded().values():
            found = [(match.group(1), row) for match, row in ((re.fullmatch(pattern, name), row) for name, row in rows.items()) if match]
            first = next(number for number, (_, row) in enumerate(found) if row["held"] != STARTS)
            cells += [found[first - 1][0] if first else "< " + found[0][0], next(value for value, row in found if row["held"] == "0")]
        lines.append("| %s | %s |" % (title, " | ".join(cells)))
    return "\n".join(lines) + "\n"


def truths(precision):
    texts = ("scene", "quantity", "precision", "friction", "solver")
    return [{name: value if name in texts else float(value) for name, value in row.items()}
            for row in read(os.path.join(RESULTS, "truth-%s.csv" % precision))]


def as_it_comes(row, *but):
    base = dict(dt=COARSE, iterations=20, contacts=4, erp=0.2, cfm=CFM[row["precision"]], friction="pyramid", solver="quick")
    return all(row[name] == value for name, value in base.items() if name not in but)


def by_step(rows, scene, quantity, solver="quick", friction="pyramid"):
    found = [row for row in rows if (row["scene"], row["quantity"], row["solver"], row["friction"]) == (
        scene, quantity, solver, friction) and as_it_comes(row, "dt", "solver", "friction")]
    return sorted(((row["dt"], row["error"]) for row in found), reverse=True)


def order(points, precision):
    """The p of error = c dt^p, by least squares of the logarithms over steps of 10 ms and less; or NaN and a word."""
    points = [(dt, error) for dt, error in points if dt <= COARSE]
    worst = max(error for _, error in points)
    if worst < NEGLIGIBLE:
        return math.nan, "exact" if worst < ROUNDING[precision] else "small"
    fine = [(math.log(dt), math.log(error)) for dt, error in points if error > ROUNDING[precision]]
    x, y = (sum(values) / len(fine) for values in zip(*fine))
    slope = sum((a - x) * (b - y) for a, b in fine) / sum((a - x) ** 2 for a, _ in fine)
    return (math.nan, "none") if slope < 0.2 else (slope, "%.1f" % slope)


def orders():
    """One row for each quantity; with friction also with fdir1, where that makes a difference."""
    lines = ["| scene | off at 10 ms, % | at 0.6 ms, % | order |", "| --- | ---: | ---: | --- |"]
    rows, single = truths("double"), truths("single")
    for scene, quantity in dict.fromkeys((row["scene"], row["quantity"]) for row in rows):
        plain = dict(by_step(rows, scene, quantity))
        for friction in "pyramid", "fdir1":
            points = dict(by_step(rows, scene, quantity, friction=friction))
            if scene.startswith("collide") and quantity == "momentum":  # exact whatever is set
                continue
            if not points or (friction == "fdir1" and (points[COARSE] > plain[COARSE] / 2 or plain[COARSE] < NEGLIGIBLE)):
                continue
            own, own_word = order(points.items(), "double")
            cell = own_word
            for name, some, solver, precision in ("dWorldStep", rows, "step", "double"), ("single", single, "quick", "single"):
                found = by_step(some, scene, quantity, solver, friction)
                other, word = order(found, precision) if found else (own, own_word)
                if abs(own - other) > 0.25 or math.isnan(own + other) and word != own_word:
                    cell += "; %s %s" % (name, word)
            off = [("%.0f" if points[dt] > 0.1 else "%.2g") % (100 * points[dt] if points[dt] > ROUNDING["double"] else 0)
                   for dt in (COARSE, FINE)]
            lines.append("| %s: %s%s | %s | %s |" % (scene.replace(" degrees", "°"), quantity, ", fdir1" * (friction == "fdir1"),
                                                    " | ".join(off), cell))
    return "\n".join(lines) + "\n"


def page():
    """README.md as it is, and with the tables of the rows."""
    with open(PAGE, encoding="utf-8") as file:
        old = new = file.read()
    for name, table in ("truth", orders()), ("thresholds", thresholds()):
        before, rest = new.split("<!-- %s -->\n" % name, 1)
        new = before + "<!-- %s -->\n\n%s\n<!-- end -->\n" % (name, table) + rest.split("<!-- end -->\n", 1)[1]
    return old, new


def check(program=None):
    old, new = page()
    if old != new:
        sys.exit("README.md has other tables than the rows: call extremes.py draw")
    if program:  # of either precision
        lacking = min((set(said(program, "list")) - set(rows) for rows in recorded().values()), key=len)
        if lacking:
            sys.exit("no rows of: %s" % ", ".join(lacking))


def truth(plt):
    """A panel a scene: error against the work of a simulated second."""
    rows, single = truths("double"), truths("single")
    figure, panels = plt.subplots(4, 4, figsize=(17, 15))
    for panel, scene in zip(panels.flat, dict.fromkeys(row["scene"] for row in rows)):
        quantity = next(row["quantity"] for row in rows if row["scene"] == scene)

        def show(some, label, style, name, **wanted):
            found = [row for row in some if (row["scene"], row["quantity"]) == (scene, quantity) and
                     as_it_comes(row, name, *wanted) and all(row[key] == value for key, value in wanted.items())]
            points = sorted((row["iterations"] / row["dt"], max(row["error"], 1e-12)) for row in found)
            if points:
                panel.loglog(*zip(*points), style, label=label, markersize=4, linewidth=1)

        show(rows, "steps", "o-", "dt")
        show(rows, "iterations", "s-", "iterations")
        show(rows, "steps, dWorldStep", "x--", "dt", solver="step")
        show(rows, "steps, fdir1", "v-", "dt", friction="fdir1")
        show(single, "steps, single precision", "+:", "dt")
        for name, label, style in ("erp", "ERP", "C5^"), ("cfm", "CFM", "C6D"), ("contacts", "contacts", "C7*"):
            show(rows, label, style, name)
        panel.set_title("%s: %s" % (scene, quantity), fontsize=9)
        panel.grid(alpha=0.3)
    panels[0][0].legend(fontsize=7)
    for panel in panels[-1]:
        panel.set_xlabel("steps × iterations a simulated second (dWorldStep: as 20)", fontsize=8)
    for panel in panels[:, 0]:
        panel.set_ylabel("error, as a share", fontsize=8)
    return figure


def draw():
    try:
        import matplotlib
    except ImportError as error:
        sys.exit("extremes.py: %s. Debian: apt-get install python3-matplotlib" % error)
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure = truth(plt)
    figure.tight_layout()
    figure.savefig(os.path.join(RESULTS, "truth.png"), dpi=70)
    text = page()[1]
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    what = dict(measure=measure, check=check, draw=draw).get(sys.argv[1] if len(sys.argv) > 1 else "")
    if not what or len(sys.argv) not in {measure: (4,), check: (2, 3), draw: (2,)}[what]:
        sys.exit(__doc__)
    what(*sys.argv[2:])


if __name__ == "__main__":
    main()
