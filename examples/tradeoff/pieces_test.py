"""Tests the study in pieces: side by side, within seconds, resumed, estimated, packed: pieces_test.py <tradeoff-point>.
Exit code 77: a package is missing."""

import csv
import math
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources
HERE = os.path.dirname(os.path.abspath(__file__))

try:
    import measure
    import settings
    import study
    import table
except ImportError as error:
    print("Skipped: %s (Debian: python3-matplotlib python3-tqdm)" % error)
    sys.exit(77)

program = sys.argv.pop(1)


def output_of(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def call(folder, point, *arguments):
    return output_of(sys.executable, os.path.join(HERE, "tradeoff.py"), "--smoke", "--only", "scenes", "--no-figures", "--out",
                     folder, "--double", point, "--single", "/nowhere", *arguments)


def read(folder, name):
    with open(os.path.join(folder, name + ".csv"), newline="") as file:
        return list(csv.DictReader(file))


def script(folder, name, lines):
    """A program in place of tradeoff-point."""
    path = os.path.join(folder, name)
    with open(path, "w") as file:
        file.write("#!/bin/sh\n" + lines)
    os.chmod(path, 0o755)
    return path


class Sleeper:
    """A source whose points take so many seconds; it wants those of one look after the other. All ends are noted."""

    def __init__(self, title, looks, ends):
        self.title, self.looks, self.ends, self.columns, self.table, self.done = title, looks, ends, (), self, 0

    def wanted(self):
        before = 0
        for look in self.looks:
            if self.done == before:
                return [dict(seconds=seconds) for seconds in look]
            before += len(look)
        return []

    def pace(self):
        return self

    def expected(self, point):
        return point["seconds"]

    def alone(self, point):
        return False

    def command(self, point):
        return ["/bin/sh", "-c", "sleep %g; echo row; echo 1" % point["seconds"]]

    def add(self, row, columns):
        self.done += 1
        self.ends.append((self.title, row["seconds"]))


class SideBySide(unittest.TestCase):
    def worked_off(self, sources, parts=2, seconds=math.inf):
        measure.deadline = began = time.monotonic()
        measure.deadline += seconds
        try:
            measure.run(sources, [os.sched_getaffinity(0)] * parts)
        finally:
            measure.deadline = math.inf
        return time.monotonic() - began

    def test_points_of_one_source_fill_the_cores_while_another_waits_for_its_last(self):
        ends = []
        slow, filling = Sleeper("slow", [[0.8], [0.4, 0.4]], ends), Sleeper("filling", [[0.1] * 8], ends)
        took = self.worked_off([slow, filling])
        self.assertEqual(len(ends), 11)
        self.assertEqual(ends[-2:], [("slow", 0.4)] * 2)
        self.assertLess(ends.index(("filling", 0.1)), ends.index(("slow", 0.8)))
        self.assertLess(took, 1.8)  # one after the other 0.8 + 0.4 + 0.4; one on each core 1.2

    def test_what_takes_longest_is_begun_first(self):
        ends = []
        self.worked_off([Sleeper("", [[0.05, 0.3, 0.1, 0.2]], ends)], parts=1)
        self.assertEqual([seconds for _, seconds in ends], [0.3, 0.2, 0.1, 0.05])

    def test_what_would_not_end_in_time_is_not_begun_and_what_would_is(self):
        ends = []
        with self.assertRaises(measure.OutOfTime) as up:
            self.worked_off([Sleeper("", [[0.1, 5, 0.1]], ends)], parts=1, seconds=1)
        self.assertEqual((up.exception.args, [seconds for _, seconds in ends]), ((2,), [0.1, 0.1]))

    def test_what_fails_while_others_measure_ends_all(self):
        broken = Sleeper("broken", [[0.1]], [])
        broken.command = lambda point: 1 / 0
        with self.assertRaises(ZeroDivisionError):
            self.worked_off([broken, Sleeper("", [[0.1] * 20], [])])


class Budget(unittest.TestCase):
    """Where the time for a study is up before it ends."""

    def test_stops_when_seconds_are_up_and_goes_on_when_called_again(self):
        with tempfile.TemporaryDirectory() as folder:
            slow = script(folder, "slow", "[ \"$1\" = scene ] && sleep 0.2\nexec %s \"$@\"\n" % program)
            counts = [0]
            while True:
                result = call(folder, slow, "--seconds", "2")
                counts.append(len(read(folder, "scenes")))
                self.assertGreater(counts[-1], counts[-2], result.stdout)
                if result.returncode == 0:
                    break
                self.assertEqual(result.returncode, 75, result.stdout)
                self.assertIn("2 seconds are up, in which %d points ended" % (counts[-1] - counts[-2]), result.stdout)
                self.assertFalse(os.path.exists(os.path.join(folder, "choices.md")))
            self.assertGreater(len(counts), 2)
            keys = [study.key(row, settings.KEY) for row in read(folder, "scenes")]
            self.assertEqual(len(keys), len(set(keys)))
            self.assertEqual(sorted(os.listdir(folder)), ["choices.md", "scenes.csv", "slow"])

    def test_ends_what_goes_on_when_they_are_up(self):
        with tempfile.TemporaryDirectory() as folder:
            endless = script(folder, "endless", "[ $1 = precision ] && echo double && exit\necho $$ >>%s/begun\nexec sleep 60\n"
                             % folder)
            began = time.monotonic()
            result = call(folder, endless, "--seconds", "2")
            self.assertLess(time.monotonic() - began, 6)
            self.assertEqual(result.returncode, 1)  # the same again would not help: no 75
            self.assertIn("2 seconds are up, in which 0 points ended. More are needed", result.stdout)
            with open(os.path.join(folder, "begun")) as file:
                for process in file.read().split():
                    self.assertFalse(os.path.exists("/proc/" + process))


class Estimate(unittest.TestCase):
    def test_is_an_upper_bound_of_what_is_measured_and_measures_little(self):
        with tempfile.TemporaryDirectory() as folder:
            said = call(folder, program, "--estimate").stdout
            self.assertEqual(len(read(folder, "scenes")), 2)
            most = sum(int(points.replace(",", "")) for points in re.findall(r"^\| Tower.* \| ([\d,]+) \| [\d.]+ \|$", said, re.M))
            self.assertEqual(call(folder, program).returncode, 0)
            done = len(read(folder, "scenes"))
            self.assertTrue(done <= most <= 5 * done, (done, most, said))
            self.assertIn("Wanted now, before more can be said: 0 points", call(folder, program, "--estimate").stdout)


class Packed(unittest.TestCase):
    def test_runs_from_elsewhere_with_its_own_libraries(self):
        with tempfile.TemporaryDirectory() as folder:
            packed, out = os.path.join(folder, "packed"), os.path.join(folder, "out")
            said = output_of(sys.executable, os.path.join(HERE, "pack.py"), packed, "double=" + program)
            self.assertEqual(said.returncode, 0, said.stdout)
            self.assertLess(sum(os.path.getsize(os.path.join(root, name)) for root, _, names in os.walk(packed)
                                for name in names), 60e6)
            plain = dict(env={"PATH": "/usr/bin:/bin"}, cwd="/", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            ran = subprocess.run([os.path.join(packed, "run"), "--smoke", "--no-figures", "--out", out], **plain)
            self.assertEqual(ran.returncode, 0, ran.stdout)
            self.assertEqual({row["status"] for row in read(out, "scenes")}, {"ok"})
            self.assertEqual({row["commit"] for row in read(out, "scenes")}, {table.commit()})
            # The libraries of the build would do as well, and nothing would be seen: so those packed are made none.
            with open(os.path.join(packed, "double", "lib", "libode-parallel-sap.so.0"), "w"):
                pass
            for arguments in ("double", "tradeoff-point", "precision"), ("--smoke", "--no-figures", "--out", out + "2"):
                ran = subprocess.run([os.path.join(packed, "run"), *arguments], **plain)
                self.assertNotEqual(ran.returncode, 0, arguments)
                self.assertIn("libode-parallel-sap.so.0: file too short", ran.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
