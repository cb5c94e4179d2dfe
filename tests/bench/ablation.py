#!/usr/bin/env python3
"""What each mechanism of space/base/mechanisms.h gains: the library is built once without each, and timed in turn with
the whole one over the scenes of the benchmarks.

    cmake --preset release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DODE_PARALLEL_SAP_BENCHMARKS=ON -DODE_PARALLEL_SAP_CUDA=OFF
    cmake --build build/release
    tests/bench/ablation.py measure build/release ablation.csv
    tests/bench/ablation.py table ablation.csv > tests/bench/ABLATION.md

A row of the CSV is a cell: the time without the mechanism over that with all, each the least of the rounds. "nothing"
is the whole library timed against itself. One mechanism has nothing to do in these cells: what it seems to gain and to
lose is what other machine code does by itself. All run on one thread but dSpaceCollide2
of two spaces (two: give --cores two processors).
"""
import argparse
import csv
import math
import os
import re
import statistics
import sys
import tempfile

import variants

HEADER = "space/base/mechanisms.h"
# There is one thread but in few cells.
IDLE = ("learned_teams",)
MOST_SPREAD = 1.1  # of the middle three fifths of the libraries of a cell


def mechanisms(source):
    """Names and descriptions, in the header's order."""
    with open(os.path.join(source, HEADER)) as file:
        text = file.read()
    return re.findall(r"// ([^\n]*(?:\n// [^\n]*)*)\nconstexpr bool (\w+) = true;", text)


def measure(options):
    project = variants.Project(options.source, options.build, options.programs, options.database)
    names = [name for _, name in mechanisms(options.source)]
    wanted = options.only or names + ["nothing"]
    with tempfile.TemporaryDirectory(dir=options.temporary) as directory:
        libraries = {}
        project.prepare(directory, options.jobs)
        for name in ["whole"] + wanted:
            edit = None if name in ("whole", "nothing") else (HEADER, name, "false")
            libraries[name] = project.make(os.path.join(directory, name), edit, options.jobs)
            print("built", name, flush=True)
        run(project, libraries, wanted, options)


def run(project, libraries, wanted, options):
    """In each round each program is run with every library in turn; the file is written after each program."""
    least = {name: {} for name in libraries}
    for number in range(options.rounds):
        for measurement in variants.measurements(options.quick):
            if options.of and measurement[0] not in options.of:
                continue
            for name, library in libraries.items():
                times = variants.measure(project, library, options.quick, options.cores, [measurement])
                for cell, ms in times.items():
                    least[name][cell] = min(ms, least[name].get(cell, math.inf))
            write(options.csv, wanted, least)
        print("round", number + 1, flush=True)


def write(path, wanted, least):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["without", "cell", "ms", "ms_without", "ratio"])
        for name in wanted:
            for cell in sorted(set(least["whole"]) & set(least[name])):
                whole, without = least["whole"][cell], least[name][cell]
                writer.writerow([name, cell, "%.5g" % whole, "%.5g" % without, "%.4g" % (without / whole)])


def ratios_of(path):
    """By library: (time over the median of all libraries, cell); and the cells that are left out. The median is steadier
    than one library, as most mechanisms have nothing to do in a cell. For the same reason the machine was unsteady in a cell
    in which the middle libraries differ."""
    with open(path) as file:
        rows = list(csv.DictReader(file))
    times = {}
    for row in rows:
        cell = times.setdefault(row["cell"], {"whole": float(row["ms"])})
        cell[row["without"]] = float(row["ms_without"])
    by_name, unsteady = {}, []
    for cell, of in times.items():
        ordered = sorted(of.values())
        fifth = len(ordered) // 5
        if ordered[-1 - fifth] > MOST_SPREAD * ordered[fifth]:
            unsteady.append(cell)
            continue
        for name, ms in of.items():
            by_name.setdefault(name, []).append((ms / statistics.median(ordered), cell))
    return by_name, unsteady


def table(options):
    by_name, unsteady = ratios_of(options.csv)
    missing = {"whole", "nothing", *IDLE} - set(by_name)
    if missing:
        sys.exit("%s: no steady cells of %s, of which the noise is taken" % (options.csv, ", ".join(sorted(missing))))
    mean = lambda ratios: math.exp(sum(math.log(ratio) for ratio, _ in ratios) / len(ratios))

    def range_of(names):
        ratios = sorted(ratio for name in names for ratio, _ in by_name[name])
        return ratios[len(ratios) // 40], ratios[-1 - len(ratios) // 40]

    noise, others = range_of(("whole", "nothing")), range_of(IDLE)
    print("# What each mechanism gains\n")
    print("Time without a mechanism divided by the median of all libraries' times, in %d cells (a scene, a size, a number of\n"
          "threads). Above 1 the mechanism gains. A cell gains if it is above the noise. Descriptions:\n"
          "[mechanisms.h](../../%s).\n" % (len(by_name["whole"]), HEADER))
    print("| noise, 95 %% of the cells | from | to |\n| --- | ---: | ---: |\n| the whole library, made twice | %.2f | %.2f |" % noise)
    print("| without %s, which does nothing on one thread | %.2f | %.2f |\n" % ((", ".join("`%s`" % name for name in IDLE),) + others))
    if unsteady:
        print("%d other cells are left out, as the middle three fifths of the libraries differ by more than %.1f times there.\n"
              % (len(unsteady), MOST_SPREAD))
        print("\n".join(sorted(unsteady)), file=sys.stderr)
    print("| without | mean | cells it gains | most | there | least | there |")
    print("| --- | ---: | ---: | ---: | --- | ---: | --- |")
    for _, name in mechanisms(options.source):
        ratios = by_name.get(name)
        if not ratios:
            continue
        (most, best), (least, worst) = max(ratios), min(ratios)
        gained = sum(ratio > others[1] for ratio, _ in ratios)
        print("| `%s` | %.3f | %d | %.2f | %s | %.2f | %s |" % (name, mean(ratios), gained, most, best, least, worst))


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", default=os.path.dirname(os.path.dirname(here)), help="the project")
    commands = parser.add_subparsers(required=True)
    measuring = commands.add_parser("measure")
    measuring.set_defaults(run=measure)
    measuring.add_argument("build")
    measuring.add_argument("csv")
    measuring.add_argument("--only", nargs="+", metavar="MECHANISM")
    measuring.add_argument("--of", nargs="+", metavar="PROGRAM", help="only what these benchmarks time")
    measuring.add_argument("--rounds", type=int, default=3)
    measuring.add_argument("--quick", action="store_true", help="one small size, to see that it works")
    measuring.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at once")
    measuring.add_argument("--cores", help="processors to keep to, as of taskset")
    measuring.add_argument("--programs", help="where the benchmarks are; default: in the build")
    measuring.add_argument("--database", help="compile_commands.json; default: the build's")
    measuring.add_argument("--temporary", help="directory for the variants")
    tabulating = commands.add_parser("table")
    tabulating.set_defaults(run=table)
    tabulating.add_argument("csv")
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    sys.exit(main())
