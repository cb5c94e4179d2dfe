#!/usr/bin/env python3
"""What becomes of the extremes of physics, by rows that physics-table makes:

    extremes.py measure PROGRAM ROWS.csv   plays what has no row there yet, on all cores; goes on where it was
    extremes.py check PROGRAM ROWS.csv     whether each extreme has a row, and README.md the table of thresholds
    extremes.py draw FOLDER                outcomes.png and rescues.png of FOLDER/double.csv and single.csv, and that table
"""
import concurrent.futures
import csv
import os
import re
import subprocess
import sys

GOOD = ("stands", "stops", "settles", "holds", "keeps")
SLIGHT = ("creeps", "jitters", "shifts", "drifts", "stretches", "sags", "never rests")
GREEN, YELLOW, RED, DARK = "#9bd08f", "#f6dd7d", "#ea8a75", "#8d7b9c"
WORDS = {"dSimpleSpace,\nour order": "simple", "dHashSpace": "hash", "dParallelSAPSpace": "ours"}


HERE = os.path.dirname(os.path.abspath(__file__))
PAGE = os.path.join(HERE, "README.md")
BEGIN, END = "<!-- thresholds -->\n", "<!-- end -->\n"
STARTS = "10"
SERIES = (("a box that bears another of so many times its mass", r"a box on one as large, 1:(\S+) of its mass"),
          ("a stack of so many boxes", r"a stack of (\d+)"), ("a stack of 5, with steps of so many seconds",
          r"a stack of 5, steps of (\S+) s"), ("0.2 m at a plate of 0.1 m, so many m/s", r"boxes of 0.2 m at a plate.* (\d+) m/s"))


def said(*words):
    return subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()


def rows_of(path):
    if not os.path.exists(path):
        return {}
    with open(path, newline="", encoding="utf-8") as file:
        return {row["extreme"]: row for row in csv.DictReader(file)}


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
    lines = ["| | " + " | ".join(("does what it owes, of 10 starts", "cheapest rescue where it does not first")) + " |",
             "| --- | --- | --- |"]
    for precision in "double", "single":
        for title, pattern in SERIES:
            found = [(re.fullmatch(pattern, name), row) for name, row in rows_of(os.path.join(HERE, "results", precision + ".csv")).items()]
            found = [(match.group(1), row) for match, row in found if match and "held" in row]
            if not found:  # rows of one start
                continue
            first = next((row for _, row in found if row["held"] != STARTS), None)
            cost = " (%.2g×)" % float(first["rescue_cost"]) if first and float(first["rescue_cost"]) else ""
            lines.append("| %s, %s | %s | %s |" % (title, precision, ", ".join("%s: %s" % (value, row["held"]) for value, row in found),
                                                  first["rescue"] + cost if first else ""))
    return "\n".join(lines) + "\n"


def page():
    with open(PAGE, encoding="utf-8") as file:
        before, rest = file.read().split(BEGIN, 1)
    return before + BEGIN + "\n" + thresholds() + "\n" + END + rest.split(END, 1)[1]


def check(program, path):
    with open(PAGE, encoding="utf-8") as file:
        if file.read() != page():
            sys.exit("README.md has other thresholds than the rows: call extremes.py draw")
    columns, = said(program, "columns")
    known = rows_of(path)
    lacking = [name for name in said(program, "list") if name not in known]
    if lacking or list(next(iter(known.values()))) != columns.split(","):
        sys.exit("%s lacks rows, or has other columns: %s" % (path, ", ".join(lacking)))


def read(folder):
    rows = {p: rows_of(os.path.join(folder, p + ".csv")) for p in ("double", "single")}
    names = {p: [(r["theme"], r["extreme"]) for r in rows[p].values()] for p in rows}
    shared = [name for name in names["double"] if name in names["single"]]
    return shared, {p: {name: rows[p][name[1]] for name in shared} for p in rows}


def pyplot():
    try:
        import matplotlib
    except ImportError as error:
        sys.exit("extremes.py: %s. Debian: apt-get install python3-matplotlib" % error)
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    return plt


def colour(outcome):
    if outcome in GOOD:
        return GREEN
    if outcome in SLIGHT:
        return YELLOW
    return DARK if outcome in ("aborts", "not finite", "crashes", "too slow") else RED


def outcomes(shared, rows, path):
    plt = pyplot()
    half = (len(shared) + 1) // 2
    figure, panels = plt.subplots(1, 2, figsize=(19, 0.235 * half + 1.2))
    for panel, part in zip(panels, (shared[:half], shared[half:])):
        for y, name in enumerate(part):
            for x, (precision, column) in enumerate((p, c) for p in rows for c in WORDS.values()):
                outcome = rows[precision][name][column].split(" at step ")[0]
                panel.add_patch(plt.Rectangle((x, y), 1, 1, facecolor=colour(outcome), edgecolor="white"))
                panel.text(x + 0.5, y + 0.5, outcome, ha="center", va="center", fontsize=6.5)
        panel.set_xlim(0, 6)
        panel.set_ylim(len(part), 0)
        panel.set_yticks([y + 0.5 for y in range(len(part))], [f"{t}: {n}" for t, n in part], fontsize=7)
        panel.set_xticks([x + 0.5 for x in range(6)], list(WORDS) * 2, fontsize=6.5)
        panel.xaxis.tick_top()
        panel.tick_params(length=0)
        for x, precision in ((1.5, "double"), (4.5, "single")):
            panel.text(x, -1.6, precision + " precision", ha="center", va="bottom", fontsize=9)
        for side in panel.spines.values():
            side.set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def cost_of(row):
    """Of the rescue; 0 where there is none."""
    return float(row["rescue_cost"])


def rescues(shared, rows, path):
    plt = pyplot()
    themes = list(dict.fromkeys(theme for theme, _ in shared))
    figure, panel = plt.subplots(figsize=(9, 5.5))
    costs = [cost_of(r) for p in rows for r in rows[p].values() if cost_of(r)]
    none = 4 * max(costs)
    for precision, mark, shift in (("double", "o", -0.15), ("single", "s", 0.15)):
        xs, ys = [], []
        for name in shared:
            row = rows[precision][name]
            if row.get("held", STARTS) == STARTS and row["ours"] in GOOD:
                continue
            beside = sum(1 for x, y in zip(xs, ys) if int(round(y - shift)) == themes.index(name[0]) and x == none)
            xs.append(cost_of(row) or none)
            ys.append(themes.index(name[0]) + shift + (0 if cost_of(row) else 0.02 * beside))
        panel.scatter(xs, ys, marker=mark, s=26, alpha=0.7, label=precision + " precision")
    panel.axvline(none / 2, color="grey", linewidth=0.8)
    panel.set_xscale("log")
    panel.set_yticks(range(len(themes)), themes)
    panel.invert_yaxis()
    panel.set_xlabel("processor's time of the cheapest rescue, times that as ODE comes; right of the line: none")
    panel.legend(loc="upper center", ncol=2, bbox_to_anchor=(0.5, 1.1), frameon=False)
    panel.grid(axis="x", alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def draw(folder):
    shared, rows = read(folder)
    outcomes(shared, rows, os.path.join(folder, "outcomes.png"))
    rescues(shared, rows, os.path.join(folder, "rescues.png"))
    text = page()
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    what = dict(measure=measure, check=check, draw=draw).get(sys.argv[1] if len(sys.argv) > 1 else "")
    if not what or len(sys.argv) != (3 if what is draw else 4):
        sys.exit(__doc__)
    what(*sys.argv[2:])


if __name__ == "__main__":
    main()
