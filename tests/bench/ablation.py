#!/usr/bin/env python3
"""What each mechanism of space/data/mechanisms.h gains: the library is built once without each, and timed in turn with
the whole one over the scenes of the benchmarks.

    cmake --preset release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DODE_PARALLEL_SAP_BENCHMARKS=ON
    cmake --build build/release
    tests/bench/ablation.py measure build/release ablation.csv
    tests/bench/ablation.py table ablation.csv > tests/bench/ABLATION.md

A row of the CSV is a cell: the time without the mechanism over that with all, each the least of the rounds, on this
machine. "nothing" is the whole library timed against itself: what is smaller than its rows is noise. What was measured
is kept, and only what is missing from the file is run.
"""
import argparse
import csv
import math
import os
import re
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor

import variants

HEADER = "space/data/mechanisms.h"


def mechanisms(source):
    """Names and descriptions, in the header's order."""
    with open(os.path.join(source, HEADER)) as file:
        text = file.read()
    return re.findall(r"// ([^\n]*(?:\n// [^\n]*)*)\nconstexpr bool (\w+) = true;", text)


def measure(options):
    project = variants.Project(options.source, options.build, options.programs, options.database)
    names = [name for _, name in mechanisms(options.source)]
    done = set()
    if os.path.exists(options.csv):
        with open(options.csv) as file:
            done = {row["without"] for row in csv.DictReader(file)}
    wanted = [name for name in options.only or names + ["nothing"] if name not in done]
    with tempfile.TemporaryDirectory(dir=options.temporary) as directory:
        libraries = {}
        project.prepare(directory, options.jobs)
        for name in ["whole"] + wanted:
            edit = None if name in ("whole", "nothing") else (HEADER, name, "false")
            libraries[name] = project.make(os.path.join(directory, name), edit, options.jobs)
            print("built", name, flush=True)
        run(project, libraries, wanted, options)


def run(project, libraries, wanted, options):
    """Each place, a set of processors, takes one mechanism after the other, with and without it by turns."""
    places = options.cores or [None]
    free, lock = list(places), threading.Lock()

    def compare(name):
        with lock:
            core = free.pop()
        try:
            least = {"whole": {}, name: {}}
            for _ in range(options.rounds):
                for library in ("whole", name):
                    for cell, ms in variants.measure(project, libraries[library], options.quick, core).items():
                        least[library][cell] = min(ms, least[library].get(cell, math.inf))
        finally:
            with lock:
                free.append(core)
        with lock:
            write(options.csv, name, least["whole"], least[name])
        print("timed", name, flush=True)

    with ThreadPoolExecutor(len(places)) as pool:
        for result in [pool.submit(compare, name) for name in wanted]:
            result.result()


def write(path, name, whole, without):
    new = not os.path.exists(path)
    with open(path, "a", newline="") as file:
        writer = csv.writer(file)
        if new:
            writer.writerow(["without", "cell", "ms", "ms_without", "ratio"])
        for cell in sorted(set(whole) & set(without)):
            writer.writerow([name, cell, "%.5g" % whole[cell], "%.5g" % without[cell],
                             "%.4g" % (without[cell] / whole[cell])])


def table(options):
    with open(options.csv) as file:
        rows = list(csv.DictReader(file))
    by_name = {}
    for row in rows:
        by_name.setdefault(row["without"], []).append((float(row["ratio"]), row["cell"]))
    mean = lambda ratios: math.exp(sum(math.log(ratio) for ratio, _ in ratios) / len(ratios))
    noise = sorted(ratio for ratio, _ in by_name["nothing"])
    low, high = noise[len(noise) // 40], noise[-1 - len(noise) // 40]
    print("# What each mechanism gains\n")
    print("Time without it over time with it, of %d cells (a scene, a size, a number of threads): their geometric mean,\n"
          "those above 1.05 and beyond the noise, and the largest. Above 1 the mechanism gains. Made by `ablation.py`;\n"
          "descriptions are those of [mechanisms.h](../../%s).\n" % (len(noise), HEADER))
    print("Noise, the library against itself: 95 %% of the cells from %.2f to %.2f, geometric mean %.3f.\n"
          % (low, high, mean(by_name["nothing"])))
    print("| without | mean | cells it gains | most | there | least |")
    print("| --- | ---: | ---: | ---: | --- | ---: |")
    for _, name in mechanisms(options.source):
        ratios = by_name.get(name)
        if not ratios:
            continue
        most, cell = max(ratios)
        gained = sum(ratio > max(1.05, high) for ratio, _ in ratios)
        print("| `%s` | %.3f | %d | %.2f | %s | %.2f |" % (name, mean(ratios), gained, most, cell, min(ratios)[0]))


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
    measuring.add_argument("--rounds", type=int, default=3)
    measuring.add_argument("--quick", action="store_true", help="one small size, to see that it works")
    measuring.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at once")
    measuring.add_argument("--cores", nargs="+", help="sets of processors, as of taskset, that measure at once")
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
