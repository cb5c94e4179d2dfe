"""Runs programs, a point each, side by side on parts of the cores."""

import bisect
import math
import os
import re
import subprocess
import threading
import time
from typing import NamedTuple

from tqdm import tqdm

MOST_SECONDS = 1800
MARGIN = 1.5  # of what a point is expected to take, where it has to end before the deadline
deadline = math.inf  # of time.monotonic(): no point goes on later


class OutOfTime(Exception):
    """Something is left to be measured, and the time given for it is up. Says how many points ended."""


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


def environment_of(program):
    """A program that was packed has its libraries beside it."""
    libraries = os.path.join(os.path.dirname(os.path.abspath(program)), "lib")
    return dict(os.environ, LD_LIBRARY_PATH=libraries) if os.path.isdir(libraries) else None


def measure(command):
    """Returns the status and what was measured, in the order of the program; None where the deadline came first."""
    left = deadline - time.monotonic()
    if left <= 0:
        return None
    try:
        result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                timeout=min(left, MOST_SECONDS), env=environment_of(command[0]))
    except subprocess.TimeoutExpired:
        return ("left out: more than half an hour", {}) if left > MOST_SECONDS else None
    if result.returncode != 0:
        said = [line for line in result.stderr.strip().splitlines() if line.strip()]
        how = "ended by signal %d" % -result.returncode if result.returncode < 0 else "exit code %d" % result.returncode
        return re.sub(r"[,\n\"]", ";", "%s: %s" % (how, said[-1] if said else "")), {}
    lines = result.stdout.strip().splitlines()
    if len(lines) < 2:
        return "wrote no row", {}
    return "ok", dict(zip(lines[-2].split(","), lines[-1].split(",")))  # a program may say more before


class Source(NamedTuple):
    """Points that are all known beforehand. Whatever else has these is one, too: `wanted` are the points that are to be
    measured before it can say more, `columns` those that its table has when it begins without a row; without any they
    are the first row's. What is to be `alone` has all cores, and no other point beside it."""
    title: str
    table: object
    points: list
    command: object  # of a point
    columns: tuple
    alone: object
    seconds: object  # that a point takes, about

    def wanted(self):
        return self.table.missing(self.points)

    def pace(self):
        return self

    def expected(self, point):
        return self.seconds(point)


class Task(NamedTuple):
    seconds: float  # expected
    source: object
    point: dict


class Crew:
    """Works on the points of all sources at once, what takes longest first, on a part of the cores each. As soon as a
    source has all that it wanted it is asked for more, while the others' points go on. A point that would not
    end before the deadline is not begun, and one that does not after all is ended."""

    def __init__(self, parts):
        self.parts, self.turn = parts, threading.Condition()
        self.tasks, self.open, self.error, self.ended = [], {}, None, 0
        self.bar = tqdm(unit="point", total=0, disable=None)

    def run(self, sources):
        for source in sources:
            self.open[id(source)] = 1
        # A thread's cores are those of the programs that it starts.
        threads = [threading.Thread(target=self.work, args=(part,), daemon=True) for part in self.parts]
        for thread in threads:
            thread.start()
        try:
            for source in sources:
                self.ask(source)
        except BaseException as error:
            self.stop(error)
        for thread in threads:
            thread.join()
        self.bar.close()
        if self.error:
            raise self.error
        if self.tasks or any(self.open.values()):
            raise OutOfTime(self.ended)

    def ask(self, source):
        """Not under the lock: a source may have to think."""
        wanted = source.wanted()
        pace = source.pace()
        with self.turn:
            if wanted:
                announce(source, len(wanted))
            for point in wanted:
                bisect.insort(self.tasks, Task(pace.expected(point), source, point), key=lambda task: task.seconds)
            self.open[id(source)] = len(wanted)
            self.bar.total += len(wanted)
            self.bar.refresh()
            self.turn.notify_all()

    def work(self, part):
        try:
            os.sched_setaffinity(0, part)
            for task in iter(self.next_task, None):
                self.do(task)
        except BaseException as error:  # for the thread that waits
            self.stop(error)

    def stop(self, error):
        with self.turn:
            self.error = self.error or error
            self.turn.notify_all()

    def next_task(self):
        """None where there will be no more. Waits while what others measure may lead to more."""
        with self.turn:
            while not self.error:
                left = deadline - time.monotonic()
                fits = next((i for i in reversed(range(len(self.tasks))) if MARGIN * self.tasks[i].seconds <= left), None)
                if fits is not None:
                    return self.tasks.pop(fits)
                if left <= 0 or not any(self.open.values()) or (self.tasks and not self.measured_elsewhere()):
                    return None
                self.turn.wait(timeout=min(left, 1))
            return None

    def measured_elsewhere(self):
        return sum(self.open.values()) > len(self.tasks)

    def do(self, task):
        found = timed(task.source.command(task.point))
        with self.turn:
            if found is None:
                return
            record(task.source, task.point, *found)
            self.ended += 1
            self.bar.update()
            self.open[id(task.source)] -= 1
            last = self.open[id(task.source)] == 0
            if last:
                self.open[id(task.source)] = 1  # until it is asked
        if last:
            self.ask(task.source)


def announce(source, count, how=""):
    print("%s: %d point%s to measure%s" % (source.title, count, "" if count == 1 else "s", how), flush=True)


def timed(command):
    began = time.monotonic()
    found = measure(command)
    return found and (found[0], dict(found[1], took_s="%.4g" % (time.monotonic() - began)))


def record(source, point, status, values):
    table = source.table
    if status != "ok" and not (source.columns or table.columns):
        raise SystemExit("tradeoff.py: the first run failed: " + status)
    table.add(dict(point, status=status, **values), source.columns or list(values))


def run(sources, parts):
    """Measures what all of them want until they want no more; first what has to be alone."""
    ended = 0
    for source in sources:
        apart = [point for point in source.wanted() if source.alone(point)]
        if apart:
            announce(source, len(apart), ", one at a time")
        for point in tqdm(apart, desc=source.title, unit="point", disable=None if apart else True):
            found = timed(source.command(point))
            if found is None:
                raise OutOfTime(ended)
            record(source, point, *found)
            ended += 1
    try:
        Crew(parts).run(sources)
    except OutOfTime as up:
        raise OutOfTime(ended + up.args[0]) from None
