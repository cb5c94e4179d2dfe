#!/usr/bin/env python3
"""What ODE does to physics, by the rows of results/ that physics-table and physics-truth make:

    extremes.py measure PROGRAM ROWS.csv   plays extremes that have no row there yet, on all cores; goes on where it was
    extremes.py check [PROGRAM]            whether README.md has the tables of the rows, and each extreme of the program a row
    extremes.py draw                       results/outcomes.png, rescues.png and truth.png, and README.md's tables
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
GOOD = ("stands", "stops", "settles", "holds", "keeps")
SLIGHT = ("creeps", "jitters", "shifts", "drifts", "stretches", "sags", "never rests")
GREEN, YELLOW, RED, DARK = "#9bd08f", "#f6dd7d", "#ea8a75", "#8d7b9c"
WORDS = {"dSimpleSpace,\nour order": "simple", "dHashSpace": "hash", "dParallelSAPSpace": "ours"}
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
    columns, = said(program, "columns")
    names, known = said(program, "list"), rows_of(path)
    with open(path, "a", encoding="utf-8") as file, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        if not known:
            print(columns, file=file, flush=True)
        made = [pool.submit(said, program, "row", name) for name in names if name not in known]
        for done in concurrent.futures.as_completed(made):
            print(*done.result(), file=file, flush=True)
    known = rows_of(path)
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns.split(","), lineterminator="\n")
        writer.writeheader()
        writer.writerows(known[name] for name in names)


def thresholds():
    """In how many starts of ten each series does what it owes, and what rescues the first that does not in all."""
    lines = ["| value: starts of ten | double precision | single precision | cheapest rescue of the first that fails |",
             "| --- | --- | --- | --- |"]
    for title, pattern in SERIES:
        cells, rescues = [], []
        for rows in recorded().values():
            found = [(match.group(1), row) for match, row in ((re.fullmatch(pattern, name), row) for name, row in rows.items()) if match]
            cells.append(", ".join("%s:%s" % (value, row["held"]) for value, row in found))
            rescues.append(next(row["rescue"] for _, row in found if row["held"] != STARTS))
        lines.append("| %s | %s | %s |" % (title, " | ".join(cells), "; ".join(dict.fromkeys(rescues))))
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
    """The p of error = c dt^p, by least squares of the logarithms over steps of 10 ms and less; or a word."""
    points = [(dt, error) for dt, error in points if dt <= COARSE]
    worst = max(error for _, error in points)
    if worst < NEGLIGIBLE:
        return "exact" if worst < ROUNDING[precision] else "below 0.1 %"
    fine = [(math.log(dt), math.log(error)) for dt, error in points if error > ROUNDING[precision]]
    x, y = (sum(values) / len(fine) for values in zip(*fine))
    slope = sum((a - x) * (b - y) for a, b in fine) / sum((a - x) ** 2 for a, _ in fine)
    return "does not converge" if slope < 0.2 else "%.1f" % slope


def percent(error):
    return "0" if error < ROUNDING["double"] else "%.2g %%" % (100 * error) if error < 0.995 else "100 %"


def orders():
    """One row for each quantity; with friction also with fdir1, where that makes a difference."""
    lines = ["| scene | off at 10 ms | at 0.6 ms | order | dWorldStep | single |", "| --- | ---: | ---: | --- | --- | --- |"]
    rows, single = truths("double"), truths("single")
    for scene, quantity in dict.fromkeys((row["scene"], row["quantity"]) for row in rows):
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


def colour(outcome):
    good = GREEN if outcome in GOOD else YELLOW if outcome in SLIGHT else RED
    return DARK if outcome in ("aborts", "not finite", "crashes", "too slow") else good


def outcomes(plt, shared, rows):
    half = (len(shared) + 1) // 2
    figure, panels = plt.subplots(1, 2, figsize=(19, 0.235 * half + 1.2))
    for panel, part in zip(panels, (shared[:half], shared[half:])):
        for y, name in enumerate(part):
            for x, (precision, column) in enumerate((p, c) for p in rows for c in WORDS.values()):
                outcome = rows[precision][name][column].split(" at step ")[0]
                panel.add_patch(plt.Rectangle((x, y), 1, 1, facecolor=colour(outcome), edgecolor="white"))
                panel.text(x + 0.5, y + 0.5, outcome, ha="center", va="center", fontsize=6.5)
        panel.set(xlim=(0, 6), ylim=(len(part), 0))
        panel.set_yticks([y + 0.5 for y in range(len(part))],
                         ["%s: %s" % (rows["double"][name]["theme"], name) for name in part], fontsize=7)
        panel.set_xticks([x + 0.5 for x in range(6)], list(WORDS) * 2, fontsize=6.5)
        panel.xaxis.tick_top()
        panel.tick_params(length=0)
        for x, precision in ((1.5, "double"), (4.5, "single")):
            panel.text(x, -1.6, precision + " precision", ha="center", va="bottom", fontsize=9)
        for side in panel.spines.values():
            side.set_visible(False)
    return figure, 110


def rescues(plt, shared, rows):
    def cost_of(row):
        return float(row["rescue_cost"])  # 0 where there is none

    themes = list(dict.fromkeys(rows["double"][name]["theme"] for name in shared))
    figure, panel = plt.subplots(figsize=(9, 5.5))
    none = 4 * max(cost_of(r) for p in rows for r in rows[p].values())
    for precision, mark, shift in (("double", "o", -0.15), ("single", "s", 0.15)):
        xs, ys = [], []
        for name in shared:
            row = rows[precision][name]
            if row["held"] == STARTS and row["ours"] in GOOD:
                continue
            theme = themes.index(row["theme"])
            beside = sum(1 for x, y in zip(xs, ys) if int(round(y - shift)) == theme and x == none)
            xs.append(cost_of(row) or none)
            ys.append(theme + shift + (0 if cost_of(row) else 0.02 * beside))
        panel.scatter(xs, ys, marker=mark, s=26, alpha=0.7, label=precision + " precision")
    panel.axvline(none / 2, color="grey", linewidth=0.8)
    panel.set(xscale="log", xlabel="processor's time of the cheapest rescue, times that as ODE comes; right of the line: none")
    panel.set_yticks(range(len(themes)), themes)
    panel.invert_yaxis()
    panel.legend(loc="upper center", ncol=2, bbox_to_anchor=(0.5, 1.1), frameon=False)
    panel.grid(axis="x", alpha=0.3)
    return figure, 110


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
    return figure, 70


def draw():
    try:
        import matplotlib
    except ImportError as error:
        sys.exit("extremes.py: %s. Debian: apt-get install python3-matplotlib" % error)
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    rows = recorded()
    shared = [name for name in rows["double"] if name in rows["single"]]
    for name, (figure, dpi) in dict(outcomes=outcomes(plt, shared, rows), rescues=rescues(plt, shared, rows), truth=truth(plt)).items():
        figure.tight_layout()
        figure.savefig(os.path.join(RESULTS, name + ".png"), dpi=dpi)
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
