#!/usr/bin/env python3
"""What each mechanism of space/base/mechanisms.h gains: the library is built once without each, and timed in turn with
the whole one over the scenes of the benchmarks.

    cmake --preset release -DODE_PARALLEL_SAP_BENCHMARKS=ON -DODE_PARALLEL_SAP_CUDA=OFF && cmake --build build/release
    tests/bench/ablation.py measure build/release/tests/bench ablation.csv
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
import shutil
import statistics
import subprocess
import sys
import tempfile

PROJECT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HEADER = "space/base/mechanisms.h"
MOST_SPREAD = 1.1  # of the libraries that do the same in a cell


def mechanisms():
    """Their names, in the header's order."""
    with open(os.path.join(PROJECT, HEADER)) as file:
        return re.findall(r"\nconstexpr bool (\w+) = true;", file.read())


def build(options, names, directory):
    """The folder of the library without each mechanism: a copy of the project, compiled again after each edit of the header."""
    source, made = os.path.join(directory, "source"), os.path.join(directory, "build")
    shutil.copytree(PROJECT, source, ignore=shutil.ignore_patterns("build", ".git"))
    subprocess.run(["cmake", "-S", source, "-B", made, "-DCMAKE_BUILD_TYPE=Release", "-DODE_PARALLEL_SAP_CUDA=OFF", "-DBUILD_TESTING=OFF",
                    "-DODE_PARALLEL_SAP_EXAMPLES=OFF"] + options.cmake, check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(source, HEADER)) as file:
        text = file.read()
    libraries = {}
    for name in names:
        with open(os.path.join(source, HEADER), "w") as file:
            file.write(text.replace("constexpr bool %s = true;" % name, "constexpr bool %s = false;" % name))
        subprocess.run(["cmake", "--build", made, "--parallel", str(os.cpu_count()), "--target", "ode-parallel-sap"], check=True,
                       stdout=subprocess.DEVNULL)
        libraries[name] = os.path.join(directory, name)
        shutil.copytree(os.path.join(made, "space"), libraries[name], symlinks=True,
                        ignore=lambda folder, files: [file for file in files if not file.startswith("libode-parallel-sap.so")])
        print("built", name, flush=True)
    return libraries


# What is timed: program, arguments, and columns of its CSV that tell cells apart. pair-benchmark checks its pairs first, so a
# variant that finds others is not timed.
def measurements(quick):
    pairs, queries = ("scene", "n", "threads", "moving"), ("kind", "n", "queries", "moving", "threads")
    of = lambda scenes, sizes, quick_sizes, *more, peer="parallel-sap": (
        "pair-benchmark", ["--peers=" + peer, "--seconds=0.03", "--scenes=" + scenes,
                           "--sizes=" + (quick_sizes if quick else sizes)] + list(more), pairs)
    many = "dense-cube,heap,clusters,far-clusters,two-decades-of-size,six-decades-of-size,giant-among-dust,bars-among-cubes," \
           "long-bars,brownian,trembling,touching-lattice,one-place"
    few, small = "dense-cube,heap,straight-line", "2,4,8,16,32,64,96,120"
    # Of a program that tells what it changes, and asks what began and ended.
    notified = "parallel-sap:notified-begun-ended"
    return [
        of(many, "300,3000,30000", "1000"),
        of("dense-cube", "10000,200000", "2000"),
        of(few, small, small, "--batch=64"),
        of(few, small, small, "--batch=64", "--moving=0"),
        of(few, "300,30000", "300", "--moving=0"),
        of("dense-cube", "20000", "2000", "--moving=0.01", peer=notified),
        of("dense-cube", "20000", "2000", "--moving=0", peer=notified),
        ("rest-benchmark", ["--sizes=" + ("2000" if quick else "1000,30000"), "--seconds=0.05"], ("setting", "n", "threads")),
        ("query-benchmark", ["--spaces=parallel-sap", "--sizes=" + ("1000" if quick else "32000"), "--queries=100",
                             "--seconds=0.05"], queries),
        ("query-benchmark", ["--spaces=parallel-sap", "--kinds=spaces", "--sizes=" + ("1000" if quick else "1000,32000"),
                             "--queries=100" + ("" if quick else ",10000"), "--threads=2", "--seconds=0.05"], queries),
    ]


def timeOf(program, row):
    """The least of all frames is what others on the machine disturb least; but where frames differ all count."""
    if row.get("scene") == "trembling" or row.get("setting") == "others-move":
        return "mean_ms"
    return "min_ms"


def timesOf(options, library, runs):
    """Milliseconds a cell, by its name."""
    times = {}
    environment = dict(os.environ, LD_LIBRARY_PATH=library + ":" + os.environ.get("LD_LIBRARY_PATH", ""),
                       OMP_WAIT_POLICY="active")
    for program, arguments, keys in runs:
        with tempfile.TemporaryDirectory() as directory:
            table = os.path.join(directory, "table.csv")
            command = [os.path.join(options.programs, program)] + arguments + ["--rounds=1", "--csv=" + table]
            if options.cores is not None:
                command = ["taskset", "-c", options.cores] + command
            subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            with open(table) as file:
                for row in csv.DictReader(file):
                    if row.get("status", "ok") != "ok":
                        continue
                    name = " ".join([program.split("-")[0]] + ["%s=%s" % (key, row[key]) for key in keys])
                    times[name] = float(row[timeOf(program, row)])
    return times


def measure(options):
    """In each round each program is run with every library in turn; the file is written after each program."""
    wanted = mechanisms() + ["nothing"]
    least = {name: {} for name in ["whole"] + wanted}
    with tempfile.TemporaryDirectory() as directory:
        libraries = build(options, list(least), directory)
        for number in range(options.rounds):
            for measurement in measurements(options.quick):
                for name, library in libraries.items():
                    for cell, ms in timesOf(options, library, [measurement]).items():
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
    than one library, as most mechanisms have nothing to do in a cell. The machine was unsteady in a cell
    in which libraries that do the same differ."""
    with open(path) as file:
        rows = list(csv.DictReader(file))
    times = {}
    for row in rows:
        cell = times.setdefault(row["cell"], {"whole": float(row["ms"])})
        cell[row["without"]] = float(row["ms_without"])
    by_name, unsteady = {}, []
    for cell, of in times.items():
        ordered = sorted(of.values())
        same = [of[name] for name in ("whole", "nothing") if name in of]
        if max(same) > MOST_SPREAD * min(same):
            unsteady.append(cell)
            continue
        for name, ms in of.items():
            by_name.setdefault(name, []).append((ms / statistics.median(ordered), cell))
    return by_name, unsteady


def table(options):
    by_name, unsteady = ratios_of(options.csv)
    missing = {"whole", "nothing"} - set(by_name)
    if missing:
        sys.exit("%s: no steady cells of %s, of which the noise is taken" % (options.csv, ", ".join(sorted(missing))))
    mean = lambda ratios: math.exp(sum(math.log(ratio) for ratio, _ in ratios) / len(ratios))

    def range_of(names):
        ratios = sorted(ratio for name in names for ratio, _ in by_name[name])
        return ratios[len(ratios) // 40], ratios[-1 - len(ratios) // 40]

    noise = range_of(("whole", "nothing"))
    print("# What each mechanism gains\n")
    print("Time without a mechanism divided by the median of all libraries' times, in %d cells (a scene, a size, a number of\n"
          "threads). Above 1 the mechanism gains. A cell gains if it is above the noise. Descriptions:\n"
          "[mechanisms.h](../../%s).\n" % (len(by_name["whole"]), HEADER))
    print("| noise, 95 %% of the cells | from | to |\n| --- | ---: | ---: |\n| the whole library, made twice | %.2f | %.2f |\n" % noise)
    if unsteady:
        print("%d other cells are left out, as libraries that do the same differ by more than %.1f times there.\n"
              % (len(unsteady), MOST_SPREAD))
        print("\n".join(sorted(unsteady)), file=sys.stderr)
    print("| without | mean | cells it gains | most | there | least | there |")
    print("| --- | ---: | ---: | ---: | --- | ---: | --- |")
    for name in mechanisms():
        ratios = by_name.get(name)
        if not ratios:
            continue
        (most, best), (least, worst) = max(ratios), min(ratios)
        gained = sum(ratio > noise[1] for ratio, _ in ratios)
        print("| `%s` | %.3f | %d | %.2f | %s | %.2f | %s |" % (name, mean(ratios), gained, most, best, least, worst))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    measuring = commands.add_parser("measure")
    measuring.set_defaults(run=measure)
    measuring.add_argument("programs", help="where the benchmarks are")
    measuring.add_argument("csv")
    measuring.add_argument("--rounds", type=int, default=3)
    measuring.add_argument("--quick", action="store_true", help="one small size, to see that it works")
    measuring.add_argument("--cores", help="processors to keep to, as of taskset")
    measuring.add_argument("--cmake", action="append", default=[], metavar="-DX=Y", help="for the configuration of the library")
    tabulating = commands.add_parser("table")
    tabulating.set_defaults(run=table)
    tabulating.add_argument("csv")
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    sys.exit(main())
