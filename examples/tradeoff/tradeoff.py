#!/usr/bin/env python3
"""Measures what accuracy costs, and says what to choose: examples/tradeoff/README.md.

Rows that are in the CSV files already are not measured again, so an interrupted run goes on where it
was when it is started again. Ends with 75 where --seconds were up before all was measured."""

import argparse
import importlib
import os
import re
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # this folder is for sources

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))

lacking = None  # main() says so: --help needs none of these
try:
    from tqdm import tqdm

    import accuracy
    import estimate
    import measure
    import settings
    import study
    import traced
    import words
    from table import Table, cpu
except ImportError as error:
    lacking = error

BROAD_COLUMNS = ("ms", "least_ms", "pairs", "exact_pairs", "extra_per_exact", "missed", "extra_of_stored",
                 "missed_of_stored", "took_s")


def find_programs(options):
    """The programs by precision. The double one must be there; without the single one its points are
    left out, and that is said."""
    programs = {}
    for precision, path in (("double", options.double), ("single", options.single)):
        if not os.path.exists(path):
            if precision == "double":
                sys.exit("tradeoff.py: no program %s. Build it: cmake --build build/release --target tradeoff-point" % path)
            print("Single precision is left out: there is no %s. It needs a second build, with an ODE of single "
                  "precision:\n  cmake --preset single && cmake --build build/single --target tradeoff-point" % path)
            continue
        says = subprocess.run([path, "precision"], stdout=subprocess.PIPE, text=True,
                              env=measure.environment_of(path)).stdout.strip()
        if says != precision:
            sys.exit("tradeoff.py: %s is for an ODE of %s precision, not %s" % (path, says or "unknown", precision))
        programs[precision] = path
    return programs


def parser():
    made = argparse.ArgumentParser(description=__doc__)
    mode = made.add_mutually_exclusive_group()
    mode.add_argument("--quick", dest="mode", action="store_const", const="quick", help="about three minutes on two cores")
    mode.add_argument("--smoke", dest="mode", action="store_const", const="smoke", help="seconds; measures nothing of use")
    made.add_argument("--out", help="folder of the results (default: one named by the CPU)")
    made.add_argument("--only", choices=("broad", "scenes"), help="one of the two studies")
    made.add_argument("--scene", choices=("heap", "wall", "tower", "hopper", "vehicle", "meshes"), help="only this one of the scenes")
    made.add_argument("--density", type=float, metavar="D", help="of the scenes' bodies, kg/m^3 (default: 1000)")
    made.add_argument("--program", metavar="FILE", help="study the scene of this program, made with harness.h, instead")
    made.add_argument("--program-single", metavar="FILE", help="the same, built for an ODE of single precision")
    for precision, build in (("double", "release"), ("single", "single")):
        made.add_argument("--" + precision, metavar="PROGRAM", help="tradeoff-point for an ODE of %s precision" % precision,
                          default=os.path.join(TOP, "build", build, "examples", "tradeoff", "tradeoff-point"))
    made.add_argument("--at-once", type=int, metavar="N", help="measure N points at a time, each on its share of the cores "
                      "(default: of scenes as many as there are cores; of the broad phase one). Points of the broad phase "
                      "on more than one thread have all cores")
    made.add_argument("--report", action="store_true",
                      help="measure nothing: draw and conclude from the rows that there are, from whatever machine")
    made.add_argument("--no-figures", dest="figures", action="store_false", help="draw nothing: needs no matplotlib")
    made.add_argument("--seconds", type=float, metavar="S", help="end after so many seconds; what is left, the same command "
                      "measures when it is called again")
    made.add_argument("--estimate", action="store_true", help="say what it costs in core-minutes, by scene and stage; "
                      "measures two points of a scene that has no rows")
    made.add_argument("--trace", metavar="FILE", help="study the program of this trace instead: see examples/trace")
    made.add_argument("--write", metavar="FILE", help="put the advice between <!-- tradeoff --> and <!-- end --> there")
    return made


def check_packages(options):
    missing = lacking
    if options.figures and not missing:
        try:
            importlib.import_module("figures")
        except ImportError as error:
            missing = error
    if missing:
        sys.exit("tradeoff.py: %s. Debian: apt-get install python3-matplotlib python3-tqdm" % missing)


def draw(options, kind, *what):
    if options.figures:
        print(getattr(importlib.import_module("figures"), kind)(*what))


def parse():
    made = parser()
    options = made.parse_args()
    options.mode = options.mode or "full"
    check_packages(options)
    if options.seconds is not None:
        measure.deadline = time.monotonic() + options.seconds
    if options.at_once is not None and not 1 <= options.at_once <= len(measure.all_cores()):
        made.error("--at-once must be from 1 to the number of cores, %d" % len(measure.all_cores()))
    for name in ("trace", "program", "program_single"):
        path = getattr(options, name)
        if path and not os.path.isfile(path):
            made.error("--%s: there is no file %s" % (name.replace("_", "-"), path))
    if options.trace and (options.program or options.only or options.write or options.report or options.seconds):
        made.error("--trace goes with --out, --smoke and the programs only")
    if options.program_single and not options.program:
        made.error("--program-single goes with --program")
    if options.program and (options.only or options.scene or options.density):
        made.error("--program: the scene and what is in it are the program's")
    name = re.sub(r"[^a-z0-9]+", "-", cpu().lower()).strip("-")
    instead = options.trace or options.program
    options.out = options.out or (instead + ".study" if instead else os.path.join(HERE, "results", "%s-%s-cores%s" % (
        name, len(measure.all_cores()), "" if options.mode == "full" else "-" + options.mode)))
    options.density = options.density or settings.DENSITY
    return options


def note(rows, points):
    """Where and from which versions the rows are, and whether some are missing."""
    commits = sorted({row["commit"] for row in rows}, key=[row["commit"] for row in rows].index)
    cores = "one core a point" if rows[0]["cores"] == "1" else "%s cores" % rows[0]["cores"]
    text = "%s, %s, commit %s, %s" % (rows[0]["cpu"], cores, " and ".join(commits), rows[-1]["date"])
    missing = len(points) - len(rows)
    return text + ", %d of %d points not measured" % (missing, len(points)) if missing else text


def broad_source(options, programs):
    """What the study of the broad phase measures, or has rows of."""
    table = Table(os.path.join(options.out, "broad.csv"), study.BROAD_KEY, len(measure.all_cores()))
    if options.report:
        points = study.broad_points(options.mode, table.values("precision"), "cuda" in table.values("backend"))
    else:
        found = measure.measure([programs["double"], "broad", "--backend", "cuda", "--boxes", "2", "--frames", "1"])
        points = study.broad_points(options.mode, list(programs), bool(found) and found[0] == "ok")
        table.check_machine()

    def command_of(point):
        given = {name: value for name, value in point.items() if name != "precision"}
        return [programs[point["precision"]], "broad", *measure.words_of(given)]

    return measure.Source("broad", table, points, command_of, BROAD_COLUMNS,
                          lambda point: point["threads"] != 1 or options.at_once is None, study.broad_seconds)


def conclude_broad(source, options):
    """Draws, and returns what there is to say: the advice, and the tables."""
    rows = source.table.of(source.points)
    entries = study.broad_entries(rows)
    if not entries:
        sys.exit("tradeoff.py: no rows to report on in " + source.table.path)
    said = note(rows, source.points)
    draw(options, "broad", entries, options.out, said)
    boxes = source.points[0]["boxes"]
    advice = "Broad phase, {:,} boxes, %s:\n%s".format(boxes) % (said, words.broad_advice(entries))
    return advice, words.broad_failures(rows) + "\n" + words.broad_table(entries)


def scenes_of(options, programs):
    """What is to be studied: the user's program, or the study's own scenes."""
    if options.program:
        single = {"single": options.program_single} if options.program_single else {}
        return [accuracy.own(options.program, dict(double=options.program, **single))]
    programs = programs or {"double": options.double}
    return [accuracy.preset(name, options.mode, options.density, programs) for name in settings.SCENES[options.mode]
            if options.scene in (None, name)]


def scene_sources(options, programs, parts):
    table = Table(os.path.join(options.out, "scenes.csv"), settings.KEY, len(parts[0]))
    if not options.report:
        table.check_machine()
    return [accuracy.Study(scene, options.mode, table, table.values("precision") if options.report else list(scene.commands))
            for scene in scenes_of(options, programs)]


def conclude_scene(source, options):
    """Likewise."""
    try:
        result = accuracy.examine(source)
    except accuracy.Missing as missing:
        sys.exit("tradeoff.py: %s lacks %s. Without --report it is measured" % (source.table.path, missing))
    rows = [row for found in result.rows.values() for row in found]
    said = note(rows, rows)
    draw(options, "scene", result, settings.LIMITS, options.out, said)
    return words.scene_advice(result, said), "%s:\n\n%s" % (source.title, words.scene_tables(result))


def study_trace(options, programs):
    """Measures the frames of another program, one setting at a time, and says what each gives."""
    table = Table(os.path.join(options.out, "trace.csv"), traced.KEY, len(measure.all_cores()))
    table.check_machine()
    base = [programs["double"], "trace"]
    probe = measure.measure([*base, "--file", options.trace, "--devices", "1", "--turns", "1"])
    if probe[0] != "ok" and "GPU" not in probe[0]:
        sys.exit("tradeoff.py: " + probe[0])
    points = list(traced.points(options.trace, len(measure.all_cores()), probe[0] == "ok"))
    todo = table.missing(points)
    turns = 1 if options.mode == "smoke" else 5
    for point in tqdm(todo, desc="trace", unit="point", disable=None if todo else True):
        status, values = measure.measure([*base, *measure.words_of(dict(traced.command_line(point), turns=turns))])
        table.add(dict(point, status=status, **values), traced.COLUMNS)
    rows = table.of(points)
    text = "%s, %d frames, %s:\n\n%s" % (options.trace, max((row["frames"] or 0 for row in rows), default=0),
                                        note(rows, points), traced.table(rows))
    path = os.path.join(options.out, "trace.md")
    with open(path, "w") as file:
        file.write(text)
    print(path + "\n\n" + text)


def write_between(path, text):
    """Replaces what stands between the two marks in a document."""
    begin, end = "<!-- tradeoff -->\n", "<!-- end -->"
    with open(path) as file:
        before, rest = file.read().split(begin, 1)
    with open(path, "w") as file:
        file.write(before + begin + "\n" + text + "\n" + end + rest.split(end, 1)[1])


def measure_all(sources, parts, options):
    try:
        measure.run(sources, parts)
    except measure.OutOfTime as up:
        ended, = up.args
        print("tradeoff.py: %g seconds are up, in which %d points ended. %s" % (
            options.seconds, ended, "The same command goes on from here." if ended else "More are needed for any."))
        sys.exit(75 if ended else 1)


def main():
    options = parse()
    programs = {} if options.report or options.program else find_programs(options)
    os.makedirs(options.out, exist_ok=True)
    if options.trace:
        return study_trace(options, programs)
    only = "scenes" if options.program or options.scene else options.only
    parts = measure.shares(options.at_once or len(measure.all_cores()))
    broad = [broad_source(options, programs)] if only != "scenes" else []
    scenes = scene_sources(options, programs, parts) if only != "broad" else []
    if options.estimate:
        return print(estimate.text(broad, scenes, parts))
    if not options.report:
        measure_all(broad + scenes, parts, options)
    said = [conclude_broad(source, options) for source in broad] + [conclude_scene(source, options) for source in scenes]
    text = "\n".join(advice + "\n" + tables for advice, tables in said)
    path = os.path.join(options.out, "choices.md")
    with open(path, "w") as file:
        file.write(text)
    print(path + "\n\n" + text)
    if options.write:
        write_between(options.write, "\n".join(advice for advice, _ in said))


main()
