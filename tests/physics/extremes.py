#!/usr/bin/env python3
"""Pictures of what physics-table found: pictures.py FOLDER [OUT]

Reads FOLDER/double.csv and single.csv, as physics-table writes them, and makes in OUT (the same folder if not given)
outcomes.png, what becomes of every extreme, and rescues.png, what it costs to make each do what it owes.
"""
import csv
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit("pictures.py: %s. Debian: apt-get install python3-matplotlib" % error)

GOOD = ("stands", "stops", "settles", "holds", "keeps")
SLIGHT = ("creeps", "jitters", "shifts", "drifts", "stretches", "sags", "never rests")
GREEN, YELLOW, RED, DARK = "#9bd08f", "#f6dd7d", "#ea8a75", "#8d7b9c"
WORDS = {"dSimpleSpace,\nour order": "simple", "dHashSpace": "hash", "dParallelSAPSpace": "ours"}


def read(folder):
    rows = {}
    for precision in ("double", "single"):
        path = os.path.join(folder, precision + ".csv")
        if not os.path.exists(path):
            sys.exit(f"{path} is missing: physics-table writes it")
        with open(path, newline="", encoding="utf-8") as file:
            rows[precision] = list(csv.DictReader(file))
    names = {p: [(r["theme"], r["extreme"]) for r in rows[p]] for p in rows}
    shared = [n for n in names["double"] if n in names["single"]]
    for precision in rows:  # some extremes are of one precision's numbers
        apart = [n for n in names[precision] if n not in shared]
        if apart:
            print(f"in {precision} precision only, not in the picture: {', '.join(n[1] for n in apart)}")
        rows[precision] = {n: r for n, r in zip(names[precision], rows[precision])}
    return shared, rows


def colour(outcome):
    if outcome in GOOD:
        return GREEN
    if outcome in SLIGHT:
        return YELLOW
    return DARK if outcome in ("aborts", "not finite", "crashes", "too slow") else RED


def outcomes(shared, rows, path):
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
    themes = list(dict.fromkeys(theme for theme, _ in shared))
    figure, panel = plt.subplots(figsize=(9, 5.5))
    costs = [cost_of(r) for p in rows for r in rows[p].values() if cost_of(r)]
    none = 4 * max(costs)
    for precision, mark, shift in (("double", "o", -0.15), ("single", "s", 0.15)):
        if any(row["rescue"] == "not looked for" for row in rows[precision].values()):
            continue
        xs, ys = [], []
        for name in shared:
            row = rows[precision][name]
            if row["ours"] in GOOD:
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


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    folder = sys.argv[1]
    out = sys.argv[-1]
    shared, rows = read(folder)
    outcomes(shared, rows, os.path.join(out, "outcomes.png"))
    rescues(shared, rows, os.path.join(out, "rescues.png"))


if __name__ == "__main__":
    main()
