#!/usr/bin/env python3
"""What ODE does to physics, by the rows of results/ that physics-rows makes:

    extremes.py check [PROGRAM]   whether README.md has the tables of the rows, and each scene of the program a row
    extremes.py draw              README.md's tables
"""
import csv
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

def recorded(name):
    with open(os.path.join(RESULTS, name + ".csv"), newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def thresholds():
    """Of each series, up to where all starts do what they owe, and from where on none does."""
    lines = ["| value | double precision: all up to | none from | single precision: all up to | none from |",
             "| --- | ---: | ---: | ---: | ---: |"]
    for title, pattern in SERIES:
        cells = []
        for precision in PRECISIONS:
            found = [(match.group(1), row) for row in recorded(precision) for match in [re.fullmatch(pattern, row["extreme"])] if match]
            first = next(number for number, (_, row) in enumerate(found) if row["held"] != STARTS)
            cells += [found[first - 1][0] if first else "< " + found[0][0], next(value for value, row in found if row["held"] == "0")]
        lines.append("| %s | %s |" % (title, " | ".join(cells)))
    return "\n".join(lines) + "\n"


def percent(text):
    value = 100 * float(text)
    return "0" if value < 1e-5 else "%.2g" % value if value < 99.5 else "%.0f" % value


def ranged(row):
    return "%s (%s–%s)" % tuple(percent(row[name]) for name in ("error", "least", "most"))


def table(rows, titles, names, cell):
    """A line for each name, a column for each setting."""
    settings = list(dict.fromkeys(row["setting"] for row in rows))
    lines = ["| %s | %s |" % (" | ".join(titles), " | ".join(settings)), "| --- " * len(titles) + "| ---: " * len(settings) + "|"]
    groups = {}
    for row in rows:
        groups.setdefault(names(row), {})[row["setting"]] = cell(row)
    lines += ["| %s | %s |" % (" | ".join(name), " | ".join(cells.get(setting, "") for setting in settings))
              for name, cells in groups.items()]
    return "\n".join(lines) + "\n"


def trades():
    """What a step costs, the median over scenes; errors in percent; of those that starts change much, the range."""
    rows, costs, first = recorded("truth"), {}, {}
    own = {row["scene"]: float(row["us_a_step"]) for row in rows if row["setting"] == "as ODE comes"}
    for row in rows:
        costs.setdefault(row["setting"], []).append(float(row["us_a_step"]) / own[row["scene"]])
        first.setdefault(row["of"], row["scene"] + row["quantity"])
    costs = [dict(scene="cost of a step", setting=setting, cell="%.2g" % sorted(found)[len(found) // 2]) for setting, found in costs.items()]

    def cell(row):
        if "cell" in row:
            return row["cell"]
        if row["quantity"] == "half-life":
            return "%.2g s" % abs(float(row["value"]))
        return ranged(row) if row["scene"] == "elastic balls" else percent(row["error"])

    def names(row):
        if "cell" in row:
            return row["scene"], ""
        said = "%s: %.2g" % (row["quantity"], float(row["exact"]))
        if row["quantity"] == "half-life":
            said = "%s, %.2g s at 10 ms" % (("halves", "doubles")[row["value"][0] == "-"], abs(float(row["exact"])) * float(row["dt"]) / 0.01)
        of = ": " + row["of"] if first[row["of"]] == row["scene"] + row["quantity"] else ""
        return row["scene"].replace(" degrees", "°") + of, said

    return table(costs + rows, ("scene", "quantity: truth"), names, cell)


def swept():
    """Of scenes that differ by a number, the one in which swept contacts are worst."""
    rows, errors, worst = recorded("swept"), {}, {}
    for row in rows:
        errors.setdefault((row["scene"], row["quantity"]), []).insert(0, float(row["error"]))
    for (scene, quantity), found in errors.items():
        key = scene.split(": ")[0], quantity
        worst[key] = max(worst.get(key, (found, scene)), (found, scene))
    rows = [row for row in rows if worst[row["scene"].split(": ")[0], row["quantity"]][1] == row["scene"]]
    return table(rows, ("scene", "error"), lambda row: (row["scene"].split(": ")[0], row["quantity"]), ranged)


def machines():
    def names(row):
        return (row["machine"] + ("" if row["step_s"] == "0.01" else ", %g ms" % (1000 * float(row["step_s"]))),)

    return table(recorded("machines"), ("machine",), names, lambda row: "%s (%s)" % (row["held"], percent(row["off"])))


def page():
    """README.md as it is, and with the tables of the rows."""
    with open(PAGE, encoding="utf-8") as file:
        old = new = file.read()
    for name, made in ("trades", trades), ("swept", swept), ("machines", machines), ("thresholds", thresholds):
        before, rest = new.split("<!-- %s -->\n" % name, 1)
        new = before + "<!-- %s -->\n\n%s\n<!-- end -->\n" % (name, made()) + rest.split("<!-- end -->\n", 1)[1]
    return old, new


def check(program=None):
    old, new = page()
    if old != new:
        sys.exit("README.md has other tables than the rows: call extremes.py draw")
    if program:  # of either precision
        names = set(subprocess.run([program, "list"], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines())
        known = {row["scene"] for name in ("truth", "swept") for row in recorded(name)}
        lacking = min((names ^ known ^ {row["extreme"] for row in recorded(precision)} for precision in PRECISIONS), key=len)
        if lacking:
            sys.exit("rows and scenes differ: %s" % ", ".join(lacking))


def draw():
    text = page()[1]
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    what = dict(check=check, draw=draw).get(sys.argv[1] if len(sys.argv) > 1 else "")
    if not what or len(sys.argv) not in {check: (2, 3), draw: (2,)}[what]:
        sys.exit(__doc__)
    what(*sys.argv[2:])


if __name__ == "__main__":
    main()
