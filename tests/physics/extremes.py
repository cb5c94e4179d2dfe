#!/usr/bin/env python3
"""What ODE does to physics, by the rows of results/ that physics-table and physics-truth make:

    extremes.py measure PROGRAM ROWS.csv   plays extremes that have no row there yet, on all cores; goes on where it was
    extremes.py check [PROGRAM]            whether README.md has the tables of the rows, and each extreme of the program a row
    extremes.py draw                       README.md's tables
"""
import concurrent.futures
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


def percent(text):
    value = 100 * float(text)
    return "0" if value < 1e-9 else "%.2g" % value if value < 99.5 else "%.0f" % value


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
    """Errors in percent; of those that starts change much, the range."""
    def cell(row):
        if row["quantity"] == "half-life":
            return "%.2g s" % abs(float(row["value"]))
        least, most = percent(row["least"]), percent(row["most"])
        return "%s (%s to %s)" % (percent(row["error"]), least, most) if row["scene"] == "elastic balls" else percent(row["error"])

    def names(row):
        said = "%s: %.2g" % (row["quantity"], float(row["exact"]))
        if row["quantity"] == "half-life":
            said = "%s, %.2g s at 10 ms" % (("halves", "doubles")[row["value"][0] == "-"], abs(float(row["exact"])) * float(row["dt"]) / 0.01)
        return row["scene"].replace(" degrees", "°"), row["of"], said

    rows = [row for row in read(os.path.join(RESULTS, "truth.csv")) if row["quantity"] != "momentum" or not row["scene"].startswith("coll")]
    return table(rows, ("scene", "measured in", "quantity: truth"), names, cell)


def costs():
    """Of a step, in parts of that as ODE comes: the median over scenes, and the range."""
    rows, found = read(os.path.join(RESULTS, "truth.csv")), {}
    own = {row["scene"]: float(row["us_a_step"]) for row in rows if row["setting"] == "as ODE comes"}
    for row in rows:
        found.setdefault(row["setting"], []).append(float(row["us_a_step"]) / own[row["scene"]])
    lines = ["| setting | cost of a step: median | range |", "| --- | ---: | ---: |"]
    lines += ["| %s | %.2g | %.2g to %.2g |" % (name, sorted(values)[len(values) // 2], min(values), max(values))
              for name, values in found.items()]
    return "\n".join(lines) + "\n"


def machines():
    return table(read(os.path.join(RESULTS, "machines.csv")), ("machine", "step"),
                 lambda row: (row["machine"], "%g ms" % (1000 * float(row["step_s"]))),
                 lambda row: "%s, off by %s %%" % (row["held"], percent(row["off"])))


def page():
    """README.md as it is, and with the tables of the rows."""
    with open(PAGE, encoding="utf-8") as file:
        old = new = file.read()
    for name, made in ("trades", trades()), ("costs", costs()), ("machines", machines()), ("thresholds", thresholds()):
        before, rest = new.split("<!-- %s -->\n" % name, 1)
        new = before + "<!-- %s -->\n\n%s\n<!-- end -->\n" % (name, made) + rest.split("<!-- end -->\n", 1)[1]
    return old, new


def check(program=None):
    old, new = page()
    if old != new:
        sys.exit("README.md has other tables than the rows: call extremes.py draw")
    if program:  # of either precision
        lacking = min((set(said(program, "list")) - set(rows) for rows in recorded().values()), key=len)
        if lacking:
            sys.exit("no rows of: %s" % ", ".join(lacking))


def draw():
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
