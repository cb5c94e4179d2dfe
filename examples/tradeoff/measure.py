"""Runs programs, a point each, side by side on parts of the cores."""

import math
import os
import queue
import re
import subprocess
import time
from multiprocessing.pool import ThreadPool

from tqdm import tqdm

MOST_SECONDS = 1800
deadline = math.inf  # of time.monotonic(): no point is begun later


class OutOfTime(Exception):
    """Something is left to be measured, and the time given for it is up."""


def all_cores():
    return os.sched_getaffinity(0)


def shares(count):
    """The cores dealt into equal parts; what is left over idles."""
    cores, size = sorted(all_cores()), len(all_cores()) // count
    return [set(cores[i * size:(i + 1) * size]) for i in range(count)]


def words_of(point):
    """A point's columns as options of a program."""
    words = []
    for name, value in point.items():
        words += ["--" + name.replace("_", "-"), "%.12g" % value if isinstance(value, float) else str(value)]
    return words


def measure(command):
    """Returns the status and what was measured, in the order of the program."""
    try:
        result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=MOST_SECONDS)
    except subprocess.TimeoutExpired:
        return "left out: more than half an hour", {}
    if result.returncode != 0:
        said = [line for line in result.stderr.strip().splitlines() if line.strip()]
        how = "ended by signal %d" % -result.returncode if result.returncode < 0 else "exit code %d" % result.returncode
        return re.sub(r"[,\n\"]", ";", "%s: %s" % (how, said[-1] if said else "")), {}
    lines = result.stdout.strip().splitlines()
    if len(lines) < 2:
        return "wrote no row", {}
    return "ok", dict(zip(lines[-2].split(","), lines[-1].split(",")))  # a program may say more before


def measured(points, command_of, parts):
    """Yields point, status and what was measured, as they finish. As many are measured at a time as there
    are parts of the cores, each on a part of its own. What would begin after the deadline is left out."""
    def one(point):
        return (point, *measure(command_of(point))) if time.monotonic() < deadline else None

    free = queue.SimpleQueue()
    for part in parts:
        free.put(part)
    # A thread's cores are those of the programs that it starts.
    with ThreadPool(len(parts), lambda: os.sched_setaffinity(0, free.get())) as pool:
        yield from filter(None, pool.imap_unordered(one, points))


def run(table, title, points, command_of, columns, parts, alone=lambda point: False):
    """Measures what is missing. What is to be alone has all cores, and no other point beside it. `columns` are
    those that a table has when it begins without a row; without any they are the first row's."""
    todo = table.missing(points)
    if todo:
        print("%s: %d of %d points to measure" % (title, len(todo), len(points)), flush=True)
    beside, apart = [p for p in todo if not alone(p)], [p for p in todo if alone(p)]
    with tqdm(total=len(todo), desc=title, unit="point", disable=None if todo else True) as bar:
        for some, their_parts in (beside, parts), (apart, [all_cores()]):
            for point, status, values in measured(some, command_of, their_parts):
                if status != "ok" and not (columns or table.columns):
                    raise SystemExit("tradeoff.py: the first run failed: " + status)
                table.add(dict(point, status=status, **values), columns or list(values))
                bar.update()
    if table.missing(todo):
        raise OutOfTime
