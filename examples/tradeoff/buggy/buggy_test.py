"""Tests the study of ODE's demo_buggy: buggy_test.py <buggy>. Exit code 77: a package is missing."""

import csv
import os
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources
HERE = os.path.dirname(os.path.abspath(__file__))
program = sys.argv.pop(1)


def point(*arguments):
    result = subprocess.run([program, *arguments], stdout=subprocess.PIPE, text=True, check=True)
    names, values = result.stdout.splitlines()
    return {name: float(value) for name, value in zip(names.split(","), values.split(",")) if name not in ("ignores", "digest")}


class Buggy(unittest.TestCase):
    def test_drives_over_the_ramp_and_comes_closer_to_one_place_with_finer_steps(self):
        coarse, fine, finer = (point("--dt", dt, "--iterations", "100") for dt in ("0.05", "0.002", "0.001"))
        for row in coarse, fine, finer:
            self.assertEqual([row["bodies_seen"], row["lost"]], [4, 0])
            self.assertGreater(0.7 * row["observed_way"], 4)  # metres: beyond the ramp's edge
        place = [(row["observed_way"], row["observed_aside"]) for row in (coarse, fine, finer)]
        off = [max(abs(a - b) for a, b in zip(one, place[2])) for one in place]
        self.assertLess(4 * off[1], off[0])

    def test_seeds_are_other_ways(self):
        self.assertNotEqual(point("--seed", "1")["observed_way"], point("--seed", "2")["observed_way"])

    def test_is_studied_as_any_program_with_the_harness(self):
        with tempfile.TemporaryDirectory() as folder:
            result = subprocess.run([sys.executable, os.path.join(HERE, "..", "tradeoff.py"), "--program", program, "--budget", "8",
                                     "--out", folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            if "apt-get install" in result.stdout:
                print("Skipped: " + result.stdout)
                os._exit(77)
            self.assertEqual(result.returncode, 75, result.stdout)
            with open(os.path.join(folder, "scenes.csv"), newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual({row["status"] for row in rows}, {"ok"})
            self.assertIn("observed_aside", rows[0])


if __name__ == "__main__":
    unittest.main(verbosity=2)
