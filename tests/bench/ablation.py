#!/usr/bin/env python3
"""What each mechanism of space/base/mechanisms.h gains: the library is built once without each, and timed in turn with
the whole one over the scenes of the benchmarks.

    cmake --preset release -DODE_PARALLEL_SAP_BENCHMARKS=ON -DODE_PARALLEL_SAP_CUDA=OFF && cmake --build build/release
    tests/bench/ablation.py measure build/release/tests/bench ablation.csv
    tests/bench/ablation.py check

A row of the CSV is a cell: the time without the mechanism over that with all, each the least of the rounds, on one thread.
"nothing" is the whole library timed against itself. `runs`, by a library that counts, is how often the mechanism ran; where
it did not, what it seems to gain and to lose is what other machine code does by itself, and the cell does not count. `check`
says whether the lines where mechanisms run are there.
"""
import argparse
import csv
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PROJECT = pathlib.Path(__file__).resolve().parents[2]
HEADER = "space/base/mechanisms.h"
# Where each mechanism runs: a file, the beginning of a line, and the condition under which that counts.
RUNS = {
    "kept_pairs": ("frame/frame.cpp", "  if (kept.any) {", "kept.any"),
    "incremental_trees": ("cache/pair_cache.cpp", "  stats.kept = changed_pairs_.replace(", "true"),
    "fat_pairs": ("frame/frame.cpp", "    stats.candidates_kept =", "fat.kept() > 0"),
    "kept_cells": ("pairs/sweep.cpp", "  ++reuses_;", "good"),
    "still_small_scenes": ("frame/small_scenes.cpp", "  lists.changes = changes;", "still"),
    "small_scenes": ("frame/small_scenes.cpp", "  if (stages_) stages_->cache.stop();", "true"),
    "box_classes": ("pairs/cell_order.cpp", "  classes_.clear();",
                    "std::count(most_short_, most_short_ + 3, std::numeric_limits<Real>::max()) < 3"),
    "query_trees": ("queries/geom_tree.cpp", "  stray_rows_ += static_cast", "!must"),
    "kept_query_tree": ("queries/geom_tree.cpp", "  if (few) setUpToDate(", "few && count > 0"),
}
# Into the header of a library that counts: how often each ran, written where the environment says at the end.
COUNTERS = """
#include <cstdio>
#include <cstdlib>
namespace ode_parallel_sap::mechanisms {
struct Runs {
  long of[%d] = {};
  ~Runs() {
    std::FILE* file = std::fopen(std::getenv("ABLATION_RUNS"), "w");
    for (const long n : of) std::fprintf(file, "%%ld\\n", n);
    std::fclose(file);
  }
};
inline Runs runs;
}  // namespace ode_parallel_sap::mechanisms
"""
OURS = "parallel-sap"


def mechanisms():
    """Their names, in the header's order."""
    return re.findall(r"\nconstexpr bool (\w+) = true;", (PROJECT / HEADER).read_text())


def edit(path, change):
    path.write_text(change(path.read_text()))


def counting(source):
    """Has the library count how often each mechanism runs."""
    edit(source / HEADER, lambda text: text + COUNTERS % len(RUNS))
    for place, (path, line, condition) in enumerate(RUNS.values()):
        edit(source / "space" / path, lambda text: text.replace(
            "\n" + line, "\nif (%s) ++mechanisms::runs.of[%d];\n%s" % (condition, place, line)).replace(
            '#include "', '#include "space/base/mechanisms.h"\n#include "', 1))


def build(directory):
    """The folder of the library without each mechanism, "whole", "nothing" and "counting": a copy of the project, edited."""
    source, made = directory / "source", directory / "build"
    shutil.copytree(PROJECT, source, ignore=shutil.ignore_patterns("build", ".git"))
    subprocess.run(["cmake", "-S", source, "-B", made, "-DCMAKE_BUILD_TYPE=Release", "-DODE_PARALLEL_SAP_CUDA=OFF", "-DBUILD_TESTING=OFF",
                    "-DODE_PARALLEL_SAP_EXAMPLES=OFF"], check=True, stdout=subprocess.DEVNULL)
    text = (source / HEADER).read_text()
    libraries = {}
    for name in ["whole"] + mechanisms() + ["nothing", "counting"]:
        edit(source / HEADER, lambda _: text.replace("constexpr bool %s = true;" % name, "constexpr bool %s = false;" % name))
        if name == "counting":
            counting(source)
        subprocess.run(["cmake", "--build", made, "--parallel", str(os.cpu_count()), "--target", "ode-parallel-sap"], check=True,
                       stdout=subprocess.DEVNULL)
        libraries[name] = directory / name
        shutil.copytree(made / "space", libraries[name], symlinks=True,
                        ignore=lambda folder, files: [file for file in files if not file.startswith("libode-parallel-sap.so")])
        print("built", name, flush=True)
    return libraries


def cells():
    """What is timed: a program and its arguments. pair-benchmark checks its pairs first, so a variant that finds others is
    not timed."""
    many = "dense-cube heap clusters far-clusters two-decades-of-size six-decades-of-size giant-among-dust bars-among-cubes " \
           "long-bars brownian trembling touching-lattice one-place"
    few, small = "dense-cube heap straight-line", (2, 4, 8, 16, 32, 64, 96, 120)
    found = []

    def of(scenes, sizes, peers="", program="pair", **more):
        found.extend((program, dict({"scenes": scene} if scene else {}, sizes=n, peers=OURS + peer, **more))
                     for scene in scenes.split() or [""] for n in sizes for peer in peers.split(" "))

    of(many, (300, 3000, 30000))
    of("dense-cube", (10000, 200000))
    for moving in (1, 0):
        of(few, small, moving=moving, batch=64)
    of(few, (300, 30000), moving=0)
    for moving in (0.01, 0):
        of("dense-cube", (20000,), ":notified-begun-ended", moving=moving)  # a program that wants events
    of("shaking", (1000, 30000), ":tolerance-0.2 :tolerance-0.002")
    of("shaking", (1000, 30000), " :notified :skip-asleep :notified-skip-asleep :skip-static", moving=0.01)
    of("shaking", (1000, 30000), " :notified", moving=0)
    of("shaking some-shaking", (1000, 30000))
    of("", (3000, 30000), program="warehouse")  # rays and probes, one by one and all at once
    of("", (3000, 30000), ":batches", program="warehouse")
    return found


def name_of(cell):
    name = " ".join([cell[0]] + ["%s=%s" % item for item in cell[1].items()])
    return name.replace("sizes=", "n=").replace(" peers=" + OURS + ":", " ").replace(" peers=" + OURS, "")


def time_of(options, library, cell, **environment):
    """Milliseconds; none where the pairs were wrong or would take a minute. The least of all frames is what others on the machine
    disturb least; but where frames differ all count."""
    program, arguments = cell
    with tempfile.TemporaryDirectory() as directory:
        table = os.path.join(directory, "table.csv")
        command = [os.path.join(options.programs, program + "-benchmark"), "--seconds=0.05", "--rounds=1", "--csv=" + table]
        environment.update(OMP_WAIT_POLICY="active", LD_LIBRARY_PATH="%s:" % library + os.environ.get("LD_LIBRARY_PATH", ""))
        subprocess.run(command + ["--%s=%s" % item for item in arguments.items()], env=dict(os.environ, **environment), check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(table) as file:
            rows = list(csv.DictReader(file))
    if not rows or rows[-1].get("status", "ok") != "ok":
        return None
    return float(rows[-1]["mean_ms" if {"trembling", "some-shaking"} & set(arguments.values()) else "min_ms"])


def measure(options):
    """In each round each cell is run with every library in turn; the file is written after each round."""
    wanted = cells()
    with tempfile.TemporaryDirectory() as directory:
        libraries = build(pathlib.Path(directory))
        counts, least = {}, {}
        runs = pathlib.Path(directory, "runs")
        for cell in wanted:
            time_of(options, libraries["counting"], cell, ABLATION_RUNS=str(runs))
            counts[name_of(cell)] = dict(zip(RUNS, runs.read_text().split()))
        del libraries["counting"]
        for number in range(options.rounds):
            for cell in wanted:
                for name, library in libraries.items():
                    ms = time_of(options, library, cell)
                    if ms is not None:
                        least[name, name_of(cell)] = min(ms, least.get((name, name_of(cell)), math.inf))
            write(options.csv, [name for name in libraries if name != "whole"], least, counts)
            print("round", number + 1, flush=True)


def write(path, libraries, least, counts):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["without", "cell", "ms", "ms_without", "ratio", "runs"])
        for name in libraries:
            for cell in sorted(counts):
                whole, without = least.get(("whole", cell)), least.get((name, cell))
                if whole and without:
                    writer.writerow([name, cell, "%.5g" % whole, "%.5g" % without, "%.4g" % (without / whole), counts[cell].get(name, "")])


def check(_):
    """Each mechanism has one line where it runs."""
    wrong = ["%s: in %s only" % (name, HEADER if name in mechanisms() else "RUNS") for name in set(mechanisms()) ^ set(RUNS)]
    for name, (path, line, _) in RUNS.items():
        if (PROJECT / "space" / path).read_text().count("\n" + line) != 1:
            wrong.append("%s: no one line `%s` of %s" % (path, line, name))
    sys.exit("\n".join(wrong) or 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    measuring = commands.add_parser("measure")
    measuring.set_defaults(run=measure)
    measuring.add_argument("programs", help="where the benchmarks are")
    measuring.add_argument("csv")
    measuring.add_argument("--rounds", type=int, default=3)
    commands.add_parser("check").set_defaults(run=check)
    options = parser.parse_args()
    options.run(options)


if __name__ == "__main__":
    sys.exit(main())
