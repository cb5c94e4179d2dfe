#!/usr/bin/env python3
"""What the tuned constants of the rooms' tuning.h are worth: each is doubled and halved, and the library (for cuda/ the
check program) that is so built is timed in turn with the whole one.

    cmake --preset release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DODE_PARALLEL_SAP_BENCHMARKS=ON -DODE_PARALLEL_SAP_CUDA=OFF
    cmake --build build/release
    build/release/tests/bench/record-piles build/release/tests/bench cubes balls
    tests/bench/tuning.py build build/release variants
    tests/bench/tuning.py measure build/release variants tests/bench/results/<machine>/tuning.csv

    cmake -S cuda -B build/check -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
    cmake --build build/check
    tests/bench/tuning.py build-devices build/check variants    where there is nvcc; no device is needed
    tests/bench/tuning.py measure-devices variants tests/bench/results/<machine>/tuning.csv

    tests/bench/tuning.py fill CSV       write the effects into the comments of tuning.h
    tests/bench/tuning.py table CSV      print them as markdown
    tests/bench/tuning.py check          see that each constant has its comment and was recorded

A row of the CSV is a constant and a factor: the geometric mean over the cells (a scene, a size, a number of threads) of
the time with the changed constant over that without, each the least of the rounds, and the cells with the least and the
greatest. Rows of "nothing" are the library against itself: noise, within which nothing is said of a constant. What was
measured is kept, and only what is missing from the
file is run. A constant that cannot take a value has a row without times that says why.
"""
import argparse
import csv
import glob
import lzma
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
from concurrent.futures import ThreadPoolExecutor

import variants

FACTORS = {"2": "({}) * 2", "0.5": "({}) / 2"}
COLUMNS = ["room", "constant", "factor", "cells", "mean", "least", "least_cell", "greatest", "greatest_cell", "note"]
NOTHING = "nothing"
UNMEASURED = "Doubled: not measured. Halved: not measured."


class Constant:
    """A tuned constant: the lines of its comment, and its number, which is all of its value but in a Grain."""

    def __init__(self, room, comment, kind, name, value):
        self.room, self.comment, self.kind, self.name, self.value = room, comment, kind, name, " ".join(value.split())
        grain = re.match(r"\{([^,]*)(,.*)\}$", self.value)
        self.number, self.rest = (grain.group(1), grain.group(2)) if grain else (self.value, None)

    def changed(self, factor):
        number = FACTORS[factor].format(self.number)
        return number if self.rest is None else "{%s%s}" % (number, self.rest)

    def is_derived(self):
        words = re.sub(r"std::\w+|0x[0-9a-f.]+p?|(?<=\d)(e-?\d+|[uUlLfF]+)", "", self.number)
        return re.search(r"[A-Za-z_]", words) is not None

    def part(self, pattern):
        found = re.search(pattern, " ".join(self.comment), re.S)
        return found.group(1) if found else None

    unit = property(lambda self: self.part(r"\bUnit: (.*?)\. From:"))
    effects = property(lambda self: self.part(r"(Doubled: .*? Halved: .*)$"))


def constants(source):
    """Of all rooms, without those that are computed from others or fixed."""
    found = []
    for path in sorted(glob.glob(os.path.join(source, "space", "**", "tuning.h"), recursive=True) +
                       glob.glob(os.path.join(source, "cuda", "**", "tuning.h"), recursive=True)):
        room = os.path.relpath(os.path.dirname(path), source)
        with open(path) as file:
            text = file.read()
        for comment, kind, name, value in re.findall(
                r"((?://[^\n]*\n)*)constexpr ([\w:]+) (\w+) =\s*([^;]+);", text):
            lines = [line[2:].strip() for line in comment.splitlines()]
            constant = Constant(room, lines, kind, name, value)
            if not constant.is_derived() and not constant.part(r"\b(fixed): "):
                found.append(constant)
    return found


# What is timed for a room's constants, and for those that all rooms share.
SETS_OF_ROOM = {
    "space/axes": "paper", "space/cells": "pairs sizes many", "space/coherence": "rest", "space/extract/paper": "paper",
    "space/frame": "small pairs", "space/queries": "queries", "space/simd": "pairs many queries",
    "space/sort": "pairs lists many rest planes", "space/update": "pairs many rest far",
}
SETS_OF_CONSTANT = {
    "smallest_scene": "small", "tasks_a_thread": "pairs sizes many", "chunk_pairs": "pairs many", "chunk_cells": "pairs many",
    "prefetch_distance": "pairs many rest", "retry_frames": "small pairs rest", "back_off_range": "small pairs rest",
    "class_octaves": "pairs sizes", "fewer_larger": "pairs sizes", "shape_octaves": "pairs sizes",
    "least_shape_share": "pairs sizes", "coarse_growth": "far", "least_mapped": "pairs many", "swept_alone": "small pairs",
    "scene": "pairs many", "packed_slots": "rest", "looked_up": "far rest", "box_rows": "pairs", "sorted_records": "pairs many",
    "box_tests": "paper small", "changed_boxes": "rest", "fat_share": "trembling",
    "most_by_branches": "smallest", "least_service": "trembling", "geom_tests": "far planes", "passed_pairs": "rest many",
}


def cells_of(constant, quick, all_threads="1,2"):
    budget = ["--budget=%g" % (0.01 if quick else 0.03), "--rounds=1"]
    pairs = ("scene", "n", "threads", "moving")

    def pair(scenes, sizes, threads=all_threads, peer="parallel-sap", *more):
        return ("pair-benchmark", ["--scenes=" + scenes, "--sizes=" + ("1000" if quick else sizes),
                                   "--threads=" + threads, "--peers=" + peer] + budget + list(more), pairs)

    most_threads = all_threads[-1]
    longer = [] if quick else ["--budget=0.15"]  # where frames differ
    seconds = ["--seconds=%g" % (0.02 if quick else 0.05), "--rounds=1"]
    sets = {
        "pairs": [pair("dense-cube,log-sizes-4,brownian", "10000"), pair("dense-cube,jumps,trembling", "300", "1"),
                  pair("dense-cube", "100000", most_threads)],
        "sizes": [pair("six-decades-of-size,bars-among-cubes,brownian-assorted,thin-bars,giant-among-dust", "10000", "1")],
        "lists": [pair("two-sizes,log-sizes-6,walls,touching-lattice,six-decades-of-size", "1000,10000", "1")],
        "smallest": [pair("dense-cube,heap,one-place", "2,3,4,5,6,8,10,12", "1", "parallel-sap", "--batch=64")],
        "trembling": [pair("trembling,dense-cube,clusters,brownian", "1000,10000", "1", "parallel-sap", *longer),
                      pair("pile-cubes,pile-balls", "10000", all_threads, "parallel-sap", *longer)],
        "far": [pair("far-clusters,two-decades-of-size", "10000")],
        "many": [pair("dense-cube", "400000", most_threads)],
        "small": [pair("dense-cube,heap", "16,32,48,64,120,160,250", "1", "parallel-sap", "--batch=64"),
                  pair("dense-cube", "64,120", "1", "parallel-sap", "--batch=64", "--still"),
                  pair("jumps,crowd-and-cube", "500,2000", "1")],
        "paper": [pair("dense-cube,heap", "300,5000", all_threads, "parallel-sap:axis-lists"),
                  pair("one-place,crowd-and-cube", "500,2000")],
        "rest": [("rest-benchmark", ["--sizes=" + ("2000" if quick else "20000"), "--threads=" + most_threads] + seconds,
                  ("setting", "n", "threads"))],
        "queries": [("query-benchmark", ["--spaces=parallel-sap", "--sizes=" + ("1000" if quick else "3000,32000"),
                                         "--queries=100"] + seconds, ("kind", "n", "queries", "moving"))],
        "planes": [("plane-benchmark", ["--stock=0", "--sizes=" + ("1000" if quick else "10000"),
                                        "--threads=" + most_threads] + seconds, ("variant", "bodies", "threads"))],
    }
    names = SETS_OF_CONSTANT.get(constant.name) or SETS_OF_ROOM.get(constant.room) or "pairs rest"
    return [run for name in names.split() for run in sets[name]]


# No program here collides geoms: the study of parts does, with the piles of the example.
COLLIDING = "not among the cells"
UNMEASURABLE = {("space/contacts", None): COLLIDING, ("space/data", "collided_pairs"): COLLIDING,
                ("space/data", "block_pairs"): "not among the cells",
                ("space/data", "heavy_pairs"): COLLIDING, ("space/frame", "least_callback_ms"): "not among the cells"}


class Table:
    """The recorded rows, to which others are added one by one."""

    def __init__(self, path):
        self.path, self.rows = path, []
        if os.path.exists(path):
            with open(path) as file:
                self.rows = list(csv.DictReader(file))

    def has(self, room, name, factor):
        return self.find(room, name, factor) is not None

    def find(self, room, name, factor):
        for row in self.rows:
            if (row["room"], row["constant"], row["factor"]) == (room, name, factor):
                return row
        return None

    def add(self, room, name, factor, whole=None, changed=None, note=""):
        row = dict.fromkeys(COLUMNS, "")
        row.update(room=room, constant=name, factor=factor, note=note)
        cells = sorted((changed[cell] / whole[cell], cell) for cell in set(whole or ()) & set(changed or ()))
        if cells:
            mean = math.exp(sum(math.log(ratio) for ratio, _ in cells) / len(cells))
            row.update(cells=len(cells), mean="%.4g" % mean, least="%.4g" % cells[0][0], least_cell=cells[0][1],
                       greatest="%.4g" % cells[-1][0], greatest_cell=cells[-1][1])
        new = not os.path.exists(self.path)
        with open(self.path, "a", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if new:
                writer.writeheader()
            writer.writerow(row)
        self.rows.append(row)


def wanted_of(options, rooms, table):
    """Constants of which something is missing, and factors that are."""
    wanted = []
    for constant in constants(options.source) + [Constant(rooms, [], "", NOTHING, "1")]:
        if not constant.room.startswith(rooms) or (options.only and constant.name not in options.only):
            continue
        factors = [factor for factor in ("1",) if not table.has(constant.room, constant.name, factor)] \
            if constant.name == NOTHING else \
            [factor for factor in FACTORS if not table.has(constant.room, constant.name, factor)]
        if factors:
            wanted.append((constant, factors))
    return wanted


def make(project, directory, constant, factor, jobs):
    """The variant's directory, or a note why there is none."""
    edit = None if factor == "1" else (os.path.join(constant.room, "tuning.h"), constant.name, constant.changed(factor))
    target = os.path.join(directory, "%s-%s-%s" % (constant.room.replace("/", "-"), constant.name, factor))
    try:
        return project.make(target, edit, jobs), ""
    except subprocess.CalledProcessError:
        return None, "does not compile"
    except RuntimeError as error:
        return None, str(error)


def in_turn(libraries, rounds, measure):
    """The least times of each library, `measure(library)` by turns."""
    least = {name: {} for name in libraries}
    for _ in range(rounds):
        for name, library in libraries.items():
            for cell, ms in measure(library).items():
                least[name][cell] = min(ms, least[name].get(cell, math.inf))
    return least


# What stands in front of a tuning.h in which constants are variables: ODE_PARALLEL_SAP_TUNED=NAME=FACTOR in the
# environment changes one of them.
TUNED = """
#include <cstdlib>
#include <cstring>
#ifndef ODE_PARALLEL_SAP_TUNED
#define ODE_PARALLEL_SAP_TUNED
template <class Number>
Number tuned(const char* name, Number number) {
  const char* const text = std::getenv("ODE_PARALLEL_SAP_TUNED");
  const std::size_t length = std::strlen(name);
  if (!text || std::strncmp(text, name, length) != 0 || text[length] != '=') return number;
  return static_cast<Number>(static_cast<double>(number) * std::atof(text + length + 1));
}
#endif
"""


def with_variables(source, copy, names):
    """Copies the sources, with those of the constants that have these names, and what is computed of them, variables."""
    for room in ("space", "cuda"):
        shutil.copytree(os.path.join(source, room), os.path.join(copy, room))
    for path in glob.glob(os.path.join(copy, "space", "**", "tuning.h"), recursive=True):
        with open(path) as file:
            text = file.read()
        for name in names:
            text = re.sub(r"constexpr ([\w:]+) %s = \{([^,]*)," % name,
                          r'inline const \1 %s = {tuned<std::uint64_t>("%s", \2),' % (name, name), text)
            text = re.sub(r"constexpr ([\w:]+) %s =\s*([^;{]+);" % name,
                          r'inline const \1 %s = tuned<\1>("%s", \2);' % (name, name), text)
        variables = set(names)
        for kind, name, value in re.findall(r"constexpr ([\w:]+) (\w+) =\s*([^;]+);", text):
            if variables & set(re.findall(r"\w+", value)):
                variables.add(name)
                text = re.sub(r"constexpr ([\w:]+ %s =)" % name, r"inline const \1", text)
        text = re.sub(r"(#pragma once\n)", lambda match: match.group(1) + TUNED, text, count=1)
        with open(path, "w") as file:
            file.write(text)


def constant_expressions(project, copy, names, jobs):
    """Those of the names that the compiler must know the values of."""
    def errors(number):
        words = [word for word in project.command(number, copy) if word not in ("-c", "-o")]
        words = [word for word in words if not word.endswith(".o")] + ["-fsyntax-only", "-fno-diagnostics-color"]
        done = subprocess.run(words, cwd=project.commands[number]["directory"], stderr=subprocess.PIPE,
                              universal_newlines=True)
        return done.stderr if done.returncode else ""

    with ThreadPoolExecutor(jobs) as pool:
        text = "".join(pool.map(errors, range(len(project.commands))))
    named = set(re.findall(r"\w+", " ".join(line for line in text.splitlines() if "constant" in line or "variab" in line)))
    if text and not named & set(names):
        sys.exit(text)
    return named & set(names)


def build(options):
    """The library with variables for constants, and a variant each of those that it cannot have as variables."""
    project = variants.Project(options.source, options.build)
    names = {constant.name for constant in constants(options.source)
             if constant.room.startswith("space") and not unmeasurable(constant)}
    needed = set()
    while True:
        with tempfile.TemporaryDirectory(dir=options.temporary) as copy:
            with_variables(options.source, copy, names - needed)
            found = constant_expressions(project, copy, names - needed, options.jobs)
            needed |= found
            if not found:
                library = os.path.join(options.variants, "variables")
                os.makedirs(library)
                with ThreadPoolExecutor(options.jobs) as pool:
                    list(pool.map(lambda number: project.compile(number, copy, library), range(len(project.commands))))
                project.link([os.path.join(library, "%d.o" % number) for number in range(len(project.commands))], library)
                break
    print("variables: all but", " ".join(sorted(needed)), flush=True)
    options.only = sorted(needed)
    make_missing(project, options, "space", options.jobs, lambda made, name: os.rename(made, name))


def make_missing(project, options, rooms, at_once, keep):
    """Makes `whole` and a variant a constant and factor in options.variants, where it is missing: `keep(made, place)`
    takes it from the directory it was made in. A variant that cannot be made is a file NAME.note that says why."""
    os.makedirs(options.variants, exist_ok=True)
    missing = [(name_of(constant, factor), constant, factor) for constant in constants(options.source)
               for factor in FACTORS if constant.room.startswith(rooms) and not unmeasurable(constant)
               and (not options.only or constant.name in options.only)]
    missing = [variant for variant in missing if not glob.glob(os.path.join(options.variants, variant[0] + "*"))]
    with tempfile.TemporaryDirectory(dir=options.temporary or options.variants) as directory:
        project.prepare(directory, options.jobs)
        whole = project.make(os.path.join(directory, "whole"), None, options.jobs)
        if not glob.glob(os.path.join(options.variants, "whole*")):
            keep(whole, os.path.join(options.variants, "whole"))

        def one(variant):
            name, constant, factor = variant
            made, note = make(project, directory, constant, factor, options.jobs // at_once)
            place = os.path.join(options.variants, name)
            if made:
                keep(made, place)
            else:
                with open(place + ".note", "w") as file:
                    file.write(note)
            print(name, note or "built", flush=True)

        with ThreadPoolExecutor(at_once) as pool:
            list(pool.map(one, missing))


def name_of(constant, factor):
    return "whole" if constant.name == NOTHING else "%s-%s-%s" % (constant.room.replace("/", "-"), constant.name, factor)


def unmeasurable(constant):
    return UNMEASURABLE.get((constant.room, constant.name), UNMEASURABLE.get((constant.room, None)))


def measure(options):
    """A variant that was not built is the library with variables."""
    project = variants.Project(options.source, options.build)
    variables = os.path.join(options.variants, "variables")

    def place_of(name, constant):
        built = os.path.join(options.variants, name)
        if os.path.exists(built):
            return built, None
        if not os.path.exists(variables):
            sys.exit("%s is missing: tuning.py build" % variables)
        factor = name.rsplit("-", 1)[1] if "-" in name else None
        return variables, factor and "%s=%s" % (constant.name, factor)

    def times_of(constant):
        runs = cells_of(constant, options.quick, options.threads)
        is_variant = os.path.exists(os.path.join(options.variants, name_of(constant, "2")))
        return lambda place: variants.measure(
            project, place[0] if is_variant else variables, options.quick, options.core, runs, place[1])

    compare_all(options, "space", times_of, place_of)


def compare_all(options, rooms, times_of, place_of):
    """Adds to the table what is missing there. `times_of(constant)`: what gives the times of a variant,
    `place_of(name, constant)` that variant."""
    table = Table(options.csv)
    for constant, factors in wanted_of(options, rooms, table):
        compared = {"whole": place_of("whole", constant)}
        for factor in factors:
            note = unmeasurable(constant)
            path = os.path.join(options.variants, name_of(constant, factor) + ".note")
            if os.path.exists(path):
                with open(path) as file:
                    note = file.read()
            if note:
                table.add(constant.room, constant.name, factor, note=note)
            else:
                compared[factor] = place_of(name_of(constant, factor), constant)
        if len(compared) > 1:
            least = in_turn(compared, options.rounds, times_of(constant))
            for factor in compared:
                if factor != "whole":
                    table.add(constant.room, constant.name, factor, least["whole"], least[factor])
        print("timed", constant.room, constant.name, flush=True)


class DeviceProject(variants.Project):
    """The check program of cuda/ on its own, by the compile commands of such a build."""
    preprocessing = []

    def takes(self, entry):
        return True

    def link(self, objects, directory):
        runtime = os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(shutil.which("nvcc")))), "lib64")
        program = os.path.join(directory, "cuda_sweep_check")
        subprocess.run(["c++", "-o", program] + objects + ["-L" + runtime, "-fopenmp", "-lcudart_static", "-ldl", "-lrt",
                        "-pthread"], check=True)
        subprocess.run(["strip", program], check=True)


def build_devices(options):
    """Packs a program a variant. What is there already is not made again."""
    make_missing(DeviceProject(options.source, options.build, options.build), options, "cuda", 1, pack)


def pack(made, place):
    with open(os.path.join(made, "cuda_sweep_check"), "rb") as file, lzma.open(place + ".xz", "wb") as packed:
        shutil.copyfileobj(file, packed)
    shutil.rmtree(made)


def measure_devices(options):
    with tempfile.TemporaryDirectory(dir=options.temporary) as directory:

        def unpack(name):
            program = os.path.join(directory, name)
            if not os.path.exists(program):
                with lzma.open(os.path.join(options.variants, name + ".xz")) as packed, open(program, "wb") as file:
                    shutil.copyfileobj(packed, file)
                os.chmod(program, 0o755)
            return program

        def times(program):
            out = os.path.join(directory, "cells.csv")
            subprocess.run([program, "cells", str(options.threads), out], check=True, stdout=subprocess.DEVNULL)
            with open(out) as file:
                return {row["cell"]: float(row["ms"]) for row in csv.DictReader(file)}

        compare_all(options, "cuda", lambda constant: times, lambda name, constant: unpack(name))


def noise(table):
    """The least and the greatest mean of the library against itself."""
    means = [float(row["mean"]) for row in table.rows if row["constant"] == NOTHING]
    return (min(means), max(means)) if means else (1, 1)


def effect(row, between):
    """Words for a row: by how much time grows, if by more than noise."""
    if row is None:
        return "not measured"
    if not row["mean"]:
        return row["note"] or "not measured"
    if between[0] <= float(row["mean"]) <= between[1]:
        return "no difference"
    return "%+.0f %% of time" % ((float(row["mean"]) - 1) * 100)


def fill(options):
    table = Table(options.csv)
    for constant in constants(options.source):
        path = os.path.join(options.source, constant.room, "tuning.h")
        words = "Doubled: %s. Halved: %s." % tuple(effect(table.find(constant.room, constant.name, factor), noise(table))
                                                   for factor in ("2", "0.5"))
        lines = "".join("// %s\n" % line for line in textwrap.wrap(words, 97))
        with open(path) as file:
            text = re.sub(r"^(// .+) (Doubled: )", r"\1\n// \2", file.read(), flags=re.M)
        text, count = re.subn(r"// Doubled: [^\n]*\n(?://[^\n]*\n)*(?=constexpr [\w:]+ %s =)" % constant.name,
                              lambda _: lines, text)
        if count != 1:
            sys.exit("%s: %s has no line for its effects" % (path, constant.name))
        with open(path, "w") as file:
            file.write(text)


def show(options):
    table = Table(options.csv)
    print("| constant | value | unit | doubled | halved |\n| --- | --- | --- | --- | --- |")
    for constant in constants(options.source):
        print("| `%s` `%s` | %s | %s | %s | %s |" % ((constant.room, constant.name, constant.number, constant.unit) + tuple(
            effect(table.find(constant.room, constant.name, factor), noise(table)) for factor in ("2", "0.5"))))


def check(options):
    """Exit code 77 where the comments are as they should be, but nothing was recorded."""
    faults = []
    found = constants(options.source)
    for constant in found:
        for name, part in (("Unit: ... From: ...", constant.unit), ("Doubled: ... Halved: ...", constant.effects)):
            if not part:
                faults.append("%s/tuning.h: the comment of %s has no '%s'" % (constant.room, constant.name, name))
    tables = [Table(path) for path in glob.glob(os.path.join(options.source, "tests/bench/results/*/tuning.csv"))]
    for table in tables:
        known = {(constant.room, constant.name) for constant in found}
        faults += ["%s knows of %s %s, which is no more" % (table.path, row["room"], row["constant"]) for row in table.rows
                   if row["constant"] != NOTHING and (row["room"], row["constant"]) not in known and row["factor"] == "2"]
    if tables:
        faults += ["%s %s is in no tests/bench/results/*/tuning.csv with factor %s" % (constant.room, constant.name, factor)
                   for constant in found for factor in FACTORS
                   if not any(table.has(constant.room, constant.name, factor) for table in tables)]
    print("\n".join(faults) or "%d constants" % len(found))
    if faults:
        return 1
    if not tables:
        print("skipped: there is no tests/bench/results/*/tuning.csv")
        return 77
    return 0


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", default=os.path.dirname(os.path.dirname(here)), help="the project")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name, run, *arguments):
        command = commands.add_parser(name)
        command.set_defaults(run=run)
        for argument in arguments:
            command.add_argument(argument)
        return command

    building = add("build", build, "build", "variants")
    measuring = add("measure", measure, "build", "variants", "csv")
    building_devices = add("build-devices", build_devices, "build", "variants")
    on_devices = add("measure-devices", measure_devices, "variants", "csv")
    for command in (building, measuring, building_devices, on_devices):
        command.add_argument("--only", nargs="+", metavar="CONSTANT")
        command.add_argument("--temporary", help="directory for what is made on the way")
    for command in (building, building_devices):
        command.add_argument("--jobs", type=int, default=os.cpu_count(), help="compilers at once")
    for command in (measuring, on_devices):
        command.add_argument("--rounds", type=int, default=2)
    on_devices.add_argument("--threads", type=int, default=os.cpu_count())
    measuring.add_argument("--quick", action="store_true", help="one small size, to see that it works")
    measuring.add_argument("--threads", default="1,2", help="of the cells")
    measuring.add_argument("--core", help="processors to keep to, as of taskset")
    add("fill", fill, "csv")
    add("table", show, "csv")
    add("check", check)
    options = parser.parse_args()
    if "variants" in options:
        options.variants = os.path.abspath(options.variants)
    return options.run(options)


if __name__ == "__main__":
    sys.exit(main())
