"""Tests what pile writes and what its options do: pile_test.py <pile>."""

import csv
import os
import re
import resource
import subprocess
import sys
import tempfile
import unittest

program = sys.argv.pop(1)
README = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "README.md")
PARTS = ("broad_ms", "narrow_ms", "joints_ms", "solver_ms")
SMALL = ("--scene", "balls", "--bodies", "60", "--steps", "120")


class Pile(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "pile.csv")

    def run_pile(self, *options, code=0, **how):
        result = subprocess.run([program, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **how)
        self.assertEqual(result.returncode, code, result.stdout)
        return result.stdout

    def rows(self, *options):
        self.run_pile(*options, "--csv", self.file)
        with open(self.file, newline="") as file:
            return list(csv.DictReader(file))

    def part(self, output, name):
        """Milliseconds, and threads where the table has them."""
        ms, threads = re.search(r"^ +%s +([0-9.]+) +[0-9.]+ %%(?: +(\d+))?$" % name, output, re.M).groups()
        return float(ms), threads

    def test_the_csv_file_has_the_columns_that_the_readme_names(self):
        rows = self.rows(*SMALL)
        with open(README) as file:
            text = re.search(r"^CSV columns:.*?\n\n", file.read(), re.M | re.S).group()
        self.assertEqual(list(rows[0]), re.findall(r"`([a-z_]+)`", text))
        self.assertEqual([row["frame"] for row in rows], [str(i + 1) for i in range(120)])
        self.assertGreater(max(int(row["pairs"]) for row in rows), 60)
        self.assertGreater(max(int(row["contacts"]) for row in rows), 10)
        for row in rows:
            self.assertTrue(all(float(row[part]) > 0 for part in PARTS), row)
        self.assertLess(float(rows[-1]["height_m"]), float(rows[0]["height_m"]) - 1)

    def test_a_file_that_ends_too_soon_is_an_error(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

        output = self.run_pile(*SMALL, "--csv", self.file, code=1, preexec_fn=limit, restore_signals=False)
        self.assertIn("pile: cannot write all of the file " + self.file, output)

    def test_a_seed_makes_one_pile_and_another_seed_another(self):
        def heights(seed):
            return [row["height_m"] for row in self.rows(*SMALL, "--seed", seed)]

        first = heights("1")
        self.assertEqual(heights("1"), first)
        self.assertNotEqual(heights("2"), first)

    def test_pairs_of_sleepers_have_no_contacts(self):
        rows = self.rows("--scene", "alphabet", "--bodies", "3", "--steps", "1500")
        asleep = [row for row in rows if row["asleep"] == "3"]
        self.assertGreater(len(asleep), 10)
        for row in asleep[1:]:  # the last one falls asleep at the end of a step
            self.assertEqual(row["contacts"], "0")
            self.assertNotEqual(row["pairs"], "0")

    def test_all_spaces_begin_with_the_pile_that_has_settled(self):
        settled = ("--scene", "balls", "--bodies", "60", "--steps", "1", "--settle", "150")
        first = [self.rows(*settled, "--space", kind)[0] for kind in ("parallel", "hash", "sap", "simple")]
        self.assertGreater(int(first[0]["contacts"]), 30)
        self.assertEqual(len({(row["frame"], row["pairs"], row["contacts"]) for row in first}), 1)

    def test_the_table_has_the_parts_of_a_step_and_their_threads(self):
        many = ("--scene", "balls", "--bodies", "10000", "--steps", "3", "--settle", "90", "--backend", "cpu", "--method", "sweep")
        for options, threads in (("--threads", "1"), "1111"), (("--threads", "3"), "3311"), (
                ("--threads", "3", "--narrow", "serial"), "3111"):
            output = self.run_pile(*many, *options)
            parts = [self.part(output, name) for name in ("broad phase", "narrow phase", "contact joints", "solver")]
            self.assertEqual("".join(part[1] for part in parts), threads)
            self.assertAlmostEqual(sum(part[0] for part in parts), self.part(output, "step")[0], delta=0.003)
            stages = [self.part(output, name)[0] for name in ("update AABBs", "extract pairs", "filter", "report")]
            self.assertLessEqual(sum(stages), parts[0][0] + 0.003)
            self.assertIn("dCollide in a loop" if "serial" in options else "dParallelSAPSpaceCollideContacts", output)
        self.assertNotRegex(self.run_pile(*SMALL, "--space", "hash"), "update|extract")

    def test_three_ways_to_step_the_same_pile_are_compared(self):
        output = self.run_pile(*SMALL, "--compare", "3")
        rows = re.findall(r"^  (\w[\w ]+?) +([0-9.]+) +([0-9.]+)  ([0-9.]+)$", output[output.index("The same pile, 3 steps more"):], re.M)
        self.assertEqual([row[0] for row in rows], ["dHashSpace", "the one line changed", "parallel contacts"])
        for _, step, broad_phase, times in rows:
            self.assertTrue(0 < float(broad_phase) < float(step))
            self.assertAlmostEqual(float(times), float(rows[0][1]) / float(step), delta=0.02 * float(times) + 0.005)

    def test_a_machine_without_opengl_has_no_picture(self):
        # EGL finds no driver where its list of vendors is empty.
        blind = dict(os.environ, __EGL_VENDOR_LIBRARY_FILENAMES=os.devnull)
        picture = ("--snapshot", self.file + ".png")
        self.assertRegex(self.run_pile(*SMALL, *picture, code=2, env=blind), "not in this build|no OpenGL")
        self.assertRegex(self.run_pile(*SMALL, *picture, "--if-possible", env=blind), "No picture of the pile: .*(not in this build|no OpenGL)")
        self.assertEqual(os.listdir(os.path.dirname(self.file)), [])


unittest.main(verbosity=2)
