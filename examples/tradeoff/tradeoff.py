#!/usr/bin/env python3
"""Measures what accuracy costs, and says what to choose: examples/tradeoff/README.md.

Rows that are in the CSV files already are not measured again, so an interrupted run goes on where it
was when it is started again."""

import argparse
import csv
import datetime
import os
import queue
import re
import subprocess
import sys
from multiprocessing.pool import ThreadPool

sys.dont_write_bytecode = True  # this folder is for sources

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))

lacking = None  # main() says so: --help needs none of these
try:
    from tqdm import tqdm

    import figures
    import study
    import traced
    import words
except ImportError as error:
    lacking = error


def cpu():
    with open("/proc/cpuinfo") as lines:
        names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown CPU"


def commit():
    """Of the sources, with a word if they were changed since; unknown without git, or outside a repository."""
    try:
        described = subprocess.run(["git", "-C", TOP, "describe", "--always", "--exclude=*", "--abbrev=10",
                                    "--dirty=-changed"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    except FileNotFoundError:
        return "unknown"
    return described.stdout.strip() or "unknown"


def all_cores():
    return os.sched_getaffinity(0)


def shares(count):
    """The cores dealt into equal parts; what is left over idles."""
    cores, size = sorted(all_cores()), len(all_cores()) // count
    return [set(cores[i * size:(i + 1) * size]) for i in range(count)]


def machine(cores):
    return dict(cpu=cpu(), cores=str(cores), commit=commit(), date=datetime.date.today().isoformat())


def parsed(row):
    return {name: float(value) if study.is_number(value) and name not in ("cores", "commit") else value
            for name, value in row.items()}


def written(row):
    return {name: "%.9g" % value if isinstance(value, float) else value for name, value in row.items()}


class Table:
    """A CSV file that grows by a row at a time. Its points have so many cores each."""

    def __init__(self, path, key_columns, cores):
        self.path, self.key_columns, self.rows, self.columns = path, key_columns, [], None
        self.machine = machine(cores)
        if os.path.exists(path):
            with open(path, newline="") as file:
                reader = csv.DictReader(file)
                # A row that was cut short when the run was interrupted is measured again.
                self.rows = [parsed(row) for row in reader if None not in row.values() and None not in row]
                self.columns = reader.fieldnames
            self.write_all()
        self.known = {study.key(row, key_columns) for row in self.rows}

    def write_all(self):
        with open(self.path, "w", newline="") as file:
            writer = csv.DictWriter(file, self.columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(written(row) for row in self.rows)

    def missing(self, points):
        return [p for p in points if study.key(p, self.key_columns) not in self.known]

    def of(self, points):
        """The rows of those of these points that were measured, in the order of the points."""
        rows = {study.key(row, self.key_columns): row for row in self.rows}
        return [rows[study.key(p, self.key_columns)] for p in points if study.key(p, self.key_columns) in rows]

    def values(self, column):
        return sorted({row[column] for row in self.rows})

    def add(self, row, measured_columns):
        if not self.columns:
            self.columns = [*self.key_columns, "status", *measured_columns, *self.machine]
            self.write_all()
        row = dict({name: "" for name in self.columns}, **row, **self.machine)
        with open(self.path, "a", newline="") as file:
            csv.DictWriter(file, self.columns, lineterminator="\n").writerow(written(row))
        self.rows.append(parsed({name: str(value) for name, value in row.items()}))
        self.known.add(study.key(row, self.key_columns))

    def check_machine(self):
        others = {(row["cpu"], row["cores"]) for row in self.rows} - {(self.machine["cpu"], self.machine["cores"])}
        if others:
            sys.exit("tradeoff.py: %s has rows of another machine (%s, %s cores). Name another folder by --out." %
                     (self.path, *others.pop()))


def arguments(command, point):
    words = [command]
    for name, value in point.items():
        if name == "stepping":
            words += ["--parallel"] if value == "parallel" else []
        elif name != "precision":
            words += ["--" + name.replace("_", "-"), "%.12g" % value if isinstance(value, float) else str(value)]
    return words


def measure(program, command, point):
    """Returns the status and what was measured, in the order of the program."""
    try:
        result = subprocess.run([program, *arguments(command, point)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True, timeout=1800)
    except subprocess.TimeoutExpired:
        return "left out: more than half an hour", {}
    if result.returncode != 0:
        said = [line for line in result.stderr.strip().splitlines() if line.strip()]
        how = "ended by signal %d" % -result.returncode if result.returncode < 0 else "exit code %d" % result.returncode
        return re.sub(r"[,\n\"]", ";", "%s: %s" % (how, said[-1] if said else "")), {}
    names, values = result.stdout.strip().splitlines()
    return "ok", dict(zip(names.split(","), values.split(",")))


def measured(command, points, programs, parts):
    """Yields point, status and what was measured, as they finish. As many are measured at a time as there
    are parts of the cores, each on a part of its own."""
    free = queue.SimpleQueue()
    for part in parts:
        free.put(part)
    # A thread's cores are those of the programs that it starts.
    with ThreadPool(len(parts), lambda: os.sched_setaffinity(0, free.get())) as pool:
        yield from pool.imap_unordered(lambda p: (p, *measure(programs[p["precision"]], command, p)), points)


def run(table, command, points, programs, columns, parts, alone=lambda point: False):
    """Measures what is missing. What is to be alone has all cores, and no other point beside it."""
    todo = table.missing(points)
    print("%s: %d of %d points to measure" % (command, len(todo), len(points)), flush=True)
    beside, apart = [p for p in todo if not alone(p)], [p for p in todo if alone(p)]
    with tqdm(total=len(todo), desc=command, unit="point", disable=None if todo else True) as bar:
        for some, their_parts in (beside, parts), (apart, [all_cores()]):
            for point, status, values in measured(command, some, programs, their_parts):
                table.add(dict(point, status=status, **values), columns)
                bar.update()


BROAD_COLUMNS = ("ms", "least_ms", "pairs", "exact_pairs", "extra_per_exact", "missed", "extra_of_stored",
                 "missed_of_stored")
PILE_COLUMNS = ("wall_s_per_s", "height_m", "penetration_mm", "largest_mm", "largest_falling_mm", "energy_gain_falling",
                "energy_gain_rest", "energy_drift_rest", "momentum_drift", "angular_drift", "fastest_m_s", "lost")


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
        says = subprocess.run([path, "precision"], stdout=subprocess.PIPE, text=True).stdout.strip()
        if says != precision:
            sys.exit("tradeoff.py: %s is for an ODE of %s precision, not %s" % (path, says or "unknown", precision))
        programs[precision] = path
    return programs


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--quick", dest="mode", action="store_const", const="quick", help="about two minutes")
    mode.add_argument("--smoke", dest="mode", action="store_const", const="smoke", help="seconds; measures nothing of use")
    parser.add_argument("--out", help="folder of the results (default: one named by the CPU)")
    parser.add_argument("--only", choices=("broad", "pile"), help="one of the two studies")
    for precision, build in (("double", "release"), ("single", "single")):
        parser.add_argument("--" + precision, metavar="PROGRAM", help="tradeoff-point for an ODE of %s precision" % precision,
                            default=os.path.join(TOP, "build", build, "examples", "tradeoff", "tradeoff-point"))
    parser.add_argument("--at-once", type=int, default=1, metavar="N",
                        help="measure N points at a time: of the heap each on its share of the cores; of the broad "
                        "phase only those on one thread")
    parser.add_argument("--report", action="store_true",
                        help="measure nothing: draw and conclude from the rows that there are, from whatever machine; "
                        "a setting that lacks a seed is left out")
    parser.add_argument("--trace", metavar="FILE", help="study the program of this trace instead: see examples/trace")
    parser.add_argument("--write", metavar="FILE", help="put the advice between <!-- tradeoff --> and <!-- end --> there")
    options = parser.parse_args()
    options.mode = options.mode or "full"
    if not 1 <= options.at_once <= len(all_cores()):
        parser.error("--at-once must be from 1 to the number of cores, %d" % len(all_cores()))
    name = re.sub(r"[^a-z0-9]+", "-", cpu().lower()).strip("-")
    if options.trace and not os.path.isfile(options.trace):
        parser.error("--trace: there is no file %s" % options.trace)
    if options.trace and (options.only or options.write or options.report):
        parser.error("--trace goes with --out, --smoke and the programs only")
    if options.trace:
        options.out = options.out or options.trace + ".study"
    options.out = options.out or os.path.join(HERE, "results", "%s-%s-cores%s" % (
        name, len(all_cores()), "" if options.mode == "full" else "-" + options.mode))
    return options


def note(rows, points):
    """Where and from which versions the rows are, and whether some are missing."""
    commits = sorted({row["commit"] for row in rows}, key=[row["commit"] for row in rows].index)
    text = "%s, %s cores, commit %s, %s" % (rows[0]["cpu"], rows[0]["cores"], " and ".join(commits), rows[-1]["date"])
    missing = len(points) - len(rows)
    return text + ", %d of %d points not measured" % (missing, len(points)) if missing else text


def study_broad(options, programs):
    """Measures, draws, and returns what there is to say: the advice, and the tables."""
    table = Table(os.path.join(options.out, "broad.csv"), study.BROAD_KEY, len(all_cores()))
    if options.report:
        points = study.broad_points(options.mode, table.values("precision"), "cuda" in table.values("backend"))
    else:
        probe = measure(programs["double"], "broad", dict(backend="cuda", boxes=2, frames=1))
        points = study.broad_points(options.mode, list(programs), probe[0] == "ok")
        table.check_machine()
        run(table, "broad", points, programs, BROAD_COLUMNS, [all_cores()] * options.at_once,
            alone=lambda point: point["threads"] != 1)
    rows = table.of(points)
    entries = study.broad_entries(rows)
    if not entries:
        sys.exit("tradeoff.py: no rows to report on in " + table.path)
    print(figures.broad(entries, options.out, note(rows, points)))
    advice = "Broad phase, {:,} boxes, %s:\n%s".format(points[0]["boxes"]) % (note(rows, points), words.broad_advice(entries))
    return advice, words.broad_failures(rows) + "\n" + words.broad_table(entries)


def study_pile(options, programs):
    """Likewise."""
    parts = shares(options.at_once)
    table = Table(os.path.join(options.out, "pile.csv"), study.PILE_KEY, len(parts[0]))
    if options.report:
        points = study.pile_points(options.mode, table.values("precision"))
    else:
        points = study.pile_points(options.mode, list(programs))
        table.check_machine()
        run(table, "pile", points, programs, PILE_COLUMNS, parts)
    rows = table.of(points)
    entries = study.pile_errors(rows, options.mode)
    reference = [e for e in entries if study.is_reference(e, options.mode)]
    settings = [e for e in entries if e not in reference]
    if not settings:
        sys.exit("tradeoff.py: %s has no setting with all its seeds, or lacks the reference" % table.path)
    for path in figures.pile(settings, options.out, note(rows, points), reference):
        print(path)
    advice = "A heap of %d boxes, %s:\n\n%s" % (points[0]["bodies"], note(rows, points), words.pile_advice(settings, reference))
    return advice, words.pile_limits(settings) + "\n" + words.pile_table(settings, reference)


def study_trace(options, programs):
    """Measures the frames of another program, one setting at a time, and says what each gives."""
    table = Table(os.path.join(options.out, "trace.csv"), traced.KEY, len(all_cores()))
    table.check_machine()
    probe = measure(programs["double"], "trace", dict(file=options.trace, devices=1, turns=1))
    if probe[0] != "ok" and "GPU" not in probe[0]:
        sys.exit("tradeoff.py: " + probe[0])
    points = list(traced.points(options.trace, len(all_cores()), probe[0] == "ok"))
    todo = table.missing(points)
    turns = 1 if options.mode == "smoke" else 5
    for point in tqdm(todo, desc="trace", unit="point", disable=None if todo else True):
        status, values = measure(programs["double"], "trace", dict(traced.command_line(point), turns=turns))
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


def main():
    options = parse()
    if lacking:
        sys.exit("tradeoff.py: %s. Debian: apt-get install python3-matplotlib python3-tqdm" % lacking)
    programs = {} if options.report else find_programs(options)
    os.makedirs(options.out, exist_ok=True)
    if options.trace:
        return study_trace(options, programs)
    said = [part(options, programs) for name, part in (("broad", study_broad), ("pile", study_pile))
            if options.only in (None, name)]
    text = "\n".join(advice + "\n" + tables for advice, tables in said)
    path = os.path.join(options.out, "choices.md")
    with open(path, "w") as file:
        file.write(text)
    print(path + "\n\n" + text)
    if options.write:
        write_between(options.write, "\n".join(advice for advice, _ in said))


main()
