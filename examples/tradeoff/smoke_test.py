"""Tests the study with its programs: smoke_test.py <tradeoff-point> <harness-test>. Exit code 77: a package is missing."""

import csv
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources
HERE = os.path.dirname(os.path.abspath(__file__))
point, own_program = (os.path.abspath(path) for path in sys.argv[1:3])
del sys.argv[1:3]


def command(folder, *words):
    return [sys.executable, os.path.join(HERE, "tradeoff.py"), "--out", folder, *words]


def call(folder, *words):
    return subprocess.run(command(folder, *words), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def rows(folder):
    with open(os.path.join(folder, "scenes.csv"), newline="") as file:
        return list(csv.DictReader(file))


def keys(folder):
    return [tuple(list(row.values())[:12]) for row in rows(folder)]


class Study(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        if "apt-get install" in call(self.folder, "--report").stdout:
            print("Skipped: needs numpy")
            os._exit(77)

    def measure(self, *words):
        said = call(self.folder, *words)
        self.assertIn(said.returncode, (0, 75), said.stdout)
        return said.stdout

    def test_has_an_answer_when_its_budget_is_spent_and_goes_on_from_there(self):
        words = ("--point", point, "--scene", "vehicle", "--budget", "12")
        began = time.monotonic()
        said = self.measure(*words)
        self.assertLess(time.monotonic() - began, 30)
        self.assertIn("| Vehicle |", said[said.rindex(", commit ") - 2000:])
        first = keys(self.folder)
        self.measure(*words)
        self.assertEqual(keys(self.folder)[:len(first)], first)
        self.assertEqual(len(set(keys(self.folder))), len(keys(self.folder)))
        self.assertGreater(len(keys(self.folder)), len(first))
        self.assertEqual(call(self.folder, "--scene", "vehicle", "--report").returncode, 0)

    def test_answers_when_it_is_interrupted_and_leaves_nothing_running(self):
        child = subprocess.Popen(command(self.folder, "--point", point, "--scene", "heap"), stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, text=True)
        while not os.path.exists(os.path.join(self.folder, "scenes.csv")):
            time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        said = child.communicate(timeout=30)[0]
        self.assertEqual(child.returncode, 75, said)
        self.assertIn("| Heap |", said[said.index("Interrupted"):])

    def test_studies_a_program_alone(self):
        said = self.measure("--program", own_program, "--point", "/no/such/file", "--budget", "8")
        self.assertIn("| harness-test |", said)
        self.assertTrue(all(row["scene"].startswith("harness-test-") for row in rows(self.folder)))
        self.assertIn("observed_time", rows(self.folder)[0])

    def test_says_what_a_program_complains_of(self):
        wrong = os.path.join(self.folder, "wrong")
        with open(wrong, "w") as file:
            file.write("#!/bin/sh\necho 'no such setting' >&2\nexit 2\n")
        os.chmod(wrong, 0o755)
        said = call(self.folder, "--program", wrong)
        self.assertEqual(said.returncode, 1)
        self.assertIn("no such setting", said.stdout)

    def test_is_repeatable(self):
        words = [point, "heap", "10", "--seed", "3", "--dt", "0.02"]
        one, other = (subprocess.run(words, stdout=subprocess.PIPE, text=True).stdout.splitlines() for _ in range(2))
        self.assertEqual(one[1].split(",")[1:], other[1].split(",")[1:])  # but for the time


if __name__ == "__main__":
    unittest.main(verbosity=2)
