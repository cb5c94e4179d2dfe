"""Tests that all rows of the example find the same and save what is said: scene_test.py <scene> <README.md>."""

import os
import re
import subprocess
import sys
import tempfile
import unittest

program, readme = sys.argv.pop(1), sys.argv.pop(1)

ROW = re.compile(r"^(\S.*?)" + r" +([0-9.]+)" * 4 + r" +[0-9.]+x" + r" +(\d+)" * 4 + "$", re.M)
FLAGS = {"--rays": "rays in a batch", "--overlaps": "probes in a batch", "--contacts": "parallel contacts",
         "--skip-static": "static pairs skipped", "--skip-asleep": "asleep pairs skipped", "--notified": "changes notified",
         "--layers": "categories as layers", "--apart": "static world apart"}


def run(*options, code=0, **variables):
    result = subprocess.run([program, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env=dict(os.environ, **variables))
    assert result.returncode == code, result.stdout
    return result.stdout


def rows(*options):
    """Pairs, contacts, hits and free poses by the row's name."""
    return {name: tuple(map(int, numbers)) for name, _, _, _, _, *numbers in ROW.findall(run(*options))}


class Scene(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = rows("--check", "--shelves", "1500", "--frames", "3")

    def test_all_rows_find_the_same(self):
        """And enough of it; the program has compared the pairs, distances and poses themselves."""
        self.assertEqual(list(self.rows), ["hash", "the one line", *FLAGS.values(), "all in one space"])
        for name, (_, contacts, hits, free) in self.rows.items():
            self.assertEqual((contacts, hits, free), self.rows["hash"][1:], name)
        self.assertGreater(contacts, 80)  # a wheel on the floor has one
        self.assertTrue(1000 < hits < 7200 and 100 < free < 900, (hits, free))

    def test_other_spaces_and_sizes(self):
        for options in (("--space", "sap"), ("--space", "simple", "--rays", "--overlaps", "--contacts"),
                        ("--space", "parallel-sap", "--threads", "3")):
            for shelves in ("10", "333"):
                output = run("--check", "--shelves", shelves, "--frames", "4", *options)
                pairs, frames = re.search(r"Checked: all rows have the same (\d+) pairs, .* (\d+) frames", output).groups()
                self.assertTrue(int(pairs) > 200 * int(frames) and frames == "5", output)

    def test_options_leave_out_pairs(self):
        pairs = {name: row[0] for name, row in self.rows.items()}
        for name, most in (("static pairs skipped", 0.3), ("categories as layers", 0.3), ("static world apart", 0.3),
                           ("asleep pairs skipped", 0.95), ("parallel contacts", 1), ("all in one space", 0.1)):
            self.assertLess(pairs[name], most * pairs["the one line"], name)

    def test_flags_choose_what_is_done(self):
        few = ("--shelves", "200", "--frames", "2")
        alone = rows(*few)
        for flag, name in FLAGS.items():
            chosen = rows(*few, flag)
            self.assertEqual(list(chosen), ["hash", "the one line", "what was asked for"])
            self.assertEqual(chosen["what was asked for"], alone[name])
        self.assertEqual(list(rows(*few, "--space", "parallel-sap", *FLAGS)), ["the one line", "what was asked for"])

    def test_wrong_options_are_refused(self):
        for words in (("--sleep",), ("--shelves",), ("--shelves", "9"), ("--shelves", "nan"), ("--frames", "0"), ("--frames", "2x"),
                      ("3",), ("--space", "tree"), ("--threads", "-1")):
            self.assertIn("Run with --help", run(*words, code=2))

    def test_the_picture(self):
        if "--picture" not in run("--help"):
            self.skipTest("built without drawstuff")
        self.assertIn("cannot write the file", run("--picture", "/no/such/folder/a.png", code=2))
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "a.png")
            run("--space", "parallel-sap", "--rays", "--frames", "1", "--picture", file)
            self.assertGreater(os.path.getsize(file), 20000)

    def test_the_page_names_each_row_and_flag(self):
        with open(readme) as file:
            page = file.read()
        for name in self.rows:
            self.assertRegex(page, r"\| (\w+, )*" + name)
        for flag in re.findall(r"--\w[\w-]*", run("--help")):
            self.assertTrue(flag == "--help" or flag in page, flag)


if __name__ == "__main__":
    unittest.main()
