#!/usr/bin/env python3
"""What the solver of the example pile takes, by what the program gives it: the table of examples/SOLVER.md.

    examples/pile/solver.py --pile build/release/examples/pile/pile            prints it
    examples/pile/solver.py --pile … --write examples/SOLVER.md                puts it into the page
    examples/pile/solver.py --pile … --quick                                   few boxes, to see that it works

All heaps have settled in the same way before they are measured, so that all rows of a block begin with the same
boxes in the same places. The rows are run in turn, --rounds times; a cell is the median over all their steps.
"""
import argparse
import csv
import datetime
import os
import re
import statistics
import subprocess
import sys
import tempfile

# Of each block: the scene, and its rows: what is done, and the options that do it. The first is compared with.
HEAP = ["--bodies", "8000", "--steps", "40", "--settle", "200"]
REST = ["--bodies", "1000", "--steps", "40", "--settle", "1000"]
BLOCKS = (
    ("8,000 boxes, fallen onto a terrain", HEAP, (
        ("created by place, contacts in this space's order, 4 a pair, 20 iterations", []),
        ("bodies created in random order", ["--creation-order", "random"]),
        ("contacts shuffled", ["--contact-order", "random"]),
        ("all contacts", ["--contacts", "64"]),
        ("the 4 deepest (`dParallelSAPKeepDeepest`)", ["--reduce", "deepest"]),
        ("4 that span the most (`dParallelSAPKeepSpread`)", ["--reduce", "spread"]),
        ("2 that span the most", ["--reduce", "spread", "--contacts", "2"]),
        ("the deepest alone", ["--reduce", "deepest", "--contacts", "1"]),
        ("on ODE's own threads", ["--stepping", "parallel"]),
        ("10 iterations", ["--iterations", "10"]),
        ("50 iterations", ["--iterations", "50"]))),
    ("1,000 boxes at rest", REST, (
        ("may not sleep", ["--sleep", "off"]),
        ("asleep (`dBodySetAutoDisableFlag`)", ["--sleep", "on"]))))
COLUMNS = ("contacts", "solver_ms", "deepest_m", "fastest_m_s")


def frames_of(pile, options):
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "frames.csv")
        subprocess.run([pile, "--scene", "cubes"] + options + ["--csv", file], check=True, stdout=subprocess.DEVNULL)
        with open(file, newline="") as rows:
            return list(csv.DictReader(rows))


def with_bodies(scene, bodies):
    at = scene.index("--bodies") + 1
    return scene[:at] + [str(bodies)] + scene[at + 1:]


def measure(pile, scene, rows, rounds):
    """A dict of medians for each row."""
    frames = [[] for _ in rows]
    for _ in range(rounds):
        for own, (_, options) in zip(frames, rows):
            own += frames_of(pile, scene + options)
    return [{name: statistics.median(float(frame[name]) for frame in own) for name in COLUMNS} for own in frames]


def table(title, rows, medians):
    first = medians[0]["solver_ms"]
    lines = ["| %s | options of `pile` | contacts | solver ms | of the first | deepest contact mm |" % title,
             "| --- | --- | ---: | ---: | ---: | ---: |"]
    for (what, options), row in zip(rows, medians):
        lines.append("| %s | %s | %s | %.3g | %.2f | %.1f |" % (
            what, "`%s`" % " ".join(options) if options else "–", "{:,.0f}".format(row["contacts"]), row["solver_ms"],
            row["solver_ms"] / first, 1000 * row["deepest_m"]))
    return "\n".join(lines)


def machine():
    with open("/proc/cpuinfo") as file:
        cpu = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "unknown")
    return "%s, %d cores; %s" % (cpu, len(os.sched_getaffinity(0)), datetime.date.today().isoformat())


def replaced(document, text):
    """The document with the text between its two marks."""
    found = re.subn(r"(<!-- solver -->\n).*?(<!-- end -->)", lambda marks: marks[1] + "\n" + text + "\n" + marks[2],
                    document, flags=re.S)
    if found[1] != 1:
        sys.exit("solver.py: the page has not one place between <!-- solver --> and <!-- end -->")
    return found[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pile", required=True, help="the program")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="few boxes and steps")
    parser.add_argument("--write", metavar="FILE", help="the page to put the table into")
    options = parser.parse_args()
    parts = []
    for title, scene, rows in BLOCKS:
        if options.quick:
            scene, title = with_bodies(scene, 150), title.replace("8,000", "150").replace("1,000", "150")
        parts.append(table(title, rows, measure(options.pile, scene, rows, 1 if options.quick else options.rounds)))
    text = "\n\n".join(parts + [machine()]) + "\n"
    if not options.write:
        print(text)
        return
    with open(options.write) as file:
        document = replaced(file.read(), text)
    with open(options.write, "w") as file:
        file.write(document)


if __name__ == "__main__":
    main()
