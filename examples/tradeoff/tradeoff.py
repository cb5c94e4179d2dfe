#!/usr/bin/env python3
"""Says what accuracy costs in a scene: examples/tradeoff/README.md.

Goes from coarse to fine, and has an answer at every moment: each time it changes, after --budget seconds, and after
Ctrl-C, when the same command goes on later. Ends with 0 where all is said, and with 75 where more could be."""

import argparse
import hashlib
import os
import re
import signal
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True  # this folder is for sources

HERE = os.path.dirname(os.path.abspath(__file__))
TOP = os.path.dirname(os.path.dirname(HERE))
POINT = os.path.join(TOP, "build", "release", "examples", "tradeoff", "tradeoff-point")
SCENES = dict(arm=7, tower=12, vehicle=10, heap=40)  # and how many bodies
GO_ON = 75
MARGIN = 1.3  # of what a point is expected to take, where it has to end in time

lacking = None  # main() says so: --help needs none of these
try:
    import report
    import study
    from table import Table, cpu
except ImportError as error:
    lacking = error


def parse():
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("--budget", type=float, metavar="SECONDS", help="end after so many seconds (default: when all is said)")
    made.add_argument("--quick", dest="budget", action="store_const", const=150.0, help="--budget 150")
    made.add_argument("--program", metavar="FILE", help="study the scene of this program, made with harness.h")
    made.add_argument("--scene", choices=tuple(SCENES), help="only this one of the study's own scenes")
    made.add_argument("--point", metavar="FILE", default=POINT, help="the program tradeoff-point")
    made.add_argument("--out", metavar="DIR", help="folder of the results (default: one named by the CPU)")
    made.add_argument("--report", action="store_true", help="measure nothing: conclude from the rows that there are")
    made.add_argument("--write", metavar="FILE", help="put the answer between <!-- tradeoff --> and <!-- end --> there")
    options = made.parse_args()
    if lacking:
        sys.exit("tradeoff.py: %s. Debian: apt-get install python3-numpy" % lacking)
    for name in ("program", "point"):
        path = getattr(options, name)
        if path and not os.path.isfile(path) and not (options.report or name == "point" and options.program):
            made.error("--%s: there is no file %s" % (name, path))
    cores = len(os.sched_getaffinity(0))
    machine = "%s-%d-cores" % (re.sub(r"[^a-z0-9]+", "-", cpu().lower()).strip("-"), cores)
    options.out = options.out or (options.program + ".study" if options.program else os.path.join(HERE, "results", machine))
    return options


def studies_of(options, table):
    if options.program:
        name = os.path.basename(options.program)
        with open(options.program, "rb") as file:  # a new build is measured anew
            digest = hashlib.sha256(file.read()).hexdigest()[:10]
        return [study.Study("%s-%s" % (name, digest), name, "", [options.program], table)]
    return [study.Study(name, name.capitalize(), float(bodies), [options.point, name, str(bodies)],
                        table) for name, bodies in SCENES.items() if options.scene in (None, name)]


def command_of(one, point):
    words = []
    for name in (*study.Setting._fields, "seed"):
        words += ["--" + name, "%.12g" % point[name] if isinstance(point[name], float) else str(point[name])]
    return [*one.command, *words]


class Crew:
    """Runs points side by side, each on a core, until none is wanted or the time is up."""

    def __init__(self, studies, table, until):
        self.studies, self.table, self.until, self.lock = studies, table, until, threading.Condition()
        self.busy, self.children, self.stopped, self.error, self.said = set(), set(), False, None, {}
        self.began = time.monotonic()

    def run(self, cores):
        threads = [threading.Thread(target=self.work, args=(core,), daemon=True) for core in cores]
        for thread in threads:
            thread.start()
        try:
            while any(thread.is_alive() for thread in threads):
                time.sleep(0.1)
                if time.monotonic() > self.until:
                    self.stop()
        except KeyboardInterrupt:
            print("Interrupted. What is known so far:", flush=True)
            self.stop()
        for thread in threads:
            thread.join()
        if self.error:
            raise SystemExit("tradeoff.py: %s" % self.error)

    def stop(self, error=None):
        with self.lock:
            self.error = self.error or error
            self.stopped = True
            for child in self.children:
                child.kill()
            self.lock.notify_all()

    def next_task(self):
        """Of the study that had the least time so far; None where there will be no more."""
        with self.lock:
            while not self.stopped:
                left = self.until - time.monotonic()
                for one in sorted(self.studies, key=lambda one: one.spent):
                    for point in one.wanted():
                        seconds = one.expected(point)
                        if self.table.key(point) not in self.busy and MARGIN * seconds < left:
                            self.busy.add(self.table.key(point))
                            one.spent += seconds
                            return one, point, seconds
                if not self.busy:
                    return None
                self.lock.wait(timeout=1)
            return None

    def work(self, core):
        os.sched_setaffinity(0, {core})  # and that of the programs that this thread starts
        try:
            for one, point, seconds in iter(self.next_task, None):
                began = time.monotonic()
                with self.lock:
                    if self.stopped:
                        return
                    child = subprocess.Popen(command_of(one, point), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                             start_new_session=True)
                    self.children.add(child)
                out, complaint = child.communicate()
                took = time.monotonic() - began
                with self.lock:
                    self.children.discard(child)
                    self.busy.discard(self.table.key(point))
                    one.spent += took - seconds
                    if not self.stopped:
                        self.note(one, point, child.returncode, (out, complaint), took)
                    self.lock.notify_all()
        except BaseException as error:  # for the thread that waits
            self.stop(error)

    def note(self, one, point, code, said, took):
        lines = said[0].strip().splitlines()
        if code == 2 or (code == 0 and len(lines) < 2):
            raise RuntimeError("%s: %s" % (" ".join(command_of(one, point)), said[1].strip() or "it wrote no row"))
        values = dict(zip(lines[-2].split(","), lines[-1].split(","))) if code == 0 else {}
        status = "ok" if code == 0 else "exit code %d" % code
        self.table.add(dict(point, status=status, took_s="%.4g" % took, **values))
        key = [(winner.setting, winner.why) for winner in one.winners()]
        if one.level() >= 0 and key != self.said.get(one.name):
            self.said[one.name] = key
            print("\n%.0f s:\n" % (time.monotonic() - self.began) + report.answer([one]), flush=True)


def write_between(path, text):
    begin, end = "<!-- tradeoff -->\n", "<!-- end -->"
    with open(path) as file:
        before, rest = file.read().split(begin, 1)
    with open(path, "w") as file:
        file.write(before + begin + "\n" + text + "\n" + end + rest.split(end, 1)[1])


def main():
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    options = parse()
    began = time.monotonic()
    os.makedirs(options.out, exist_ok=True)
    table = Table(os.path.join(options.out, "scenes.csv"), study.KEY)
    studies = studies_of(options, table)
    if not options.report:
        Crew(studies, table, began + options.budget if options.budget else float("inf")).run(os.sched_getaffinity(0))
    text = report.answer(studies) + "\n" + report.origin(table)
    print("\n" + text)
    for one in studies:
        if one.settings():
            print("%s:\n\n%s" % (one.title, report.table_of(one)))
    if options.write:
        write_between(options.write, text)
    sys.exit(0 if options.report or not any(True for one in studies for _ in one.wanted()) else GO_ON)


if __name__ == "__main__":
    main()
