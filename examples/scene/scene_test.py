"""Tests that each measure of the example spares what it is said to: scene_test.py <scene> <README.md>."""

import re
import subprocess
import sys
import unittest

program, readme = sys.argv.pop(1), sys.argv.pop(1)

ROW = re.compile(r"^(\S.*?) +(\d+) +(\d+) +([0-9.]+) +(-|-?[0-9.]+ %) +(-|-?[0-9.]+ %) +(\d+)$", re.M)


def run(*options, code=0):
    result = subprocess.run([program, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert result.returncode == code, result.stdout
    return result.stdout


def rows(*options):
    """Pairs, contacts, milliseconds and bullets behind the wall, and the pairs saved as printed, by the row's name."""
    output = run(*options)
    found = {}
    for name, pairs, contacts, ms, saved, _, behind in ROW.findall(output):
        found[name] = (int(pairs), int(contacts), float(ms), int(behind), saved)
    return found


class Scene(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = rows("--size", "0.6", "--frames", "15")
        cls.plain = cls.rows["nothing done"]

    def share(self, name):
        return self.rows[name][0] / self.plain[0]

    def test_each_measure_spares_pairs(self):
        for name, most in (("categories as layers", 0.5), ("static world apart", 0.5), ("who rests sleeps", 0.95),
                           ("sub-steps of the fast only", 0.15), ("coarse proxies far away", 0.97), ("all of these", 0.05)):
            self.assertLess(self.share(name), most, name)
            self.assertGreater(self.rows[name][2], 0)

    def test_layers_and_the_world_apart_cost_no_contact(self):
        """The callback would have turned all those pairs away."""
        self.assertEqual(self.rows["categories as layers"][1], self.plain[1])
        # The order of contacts is another one.
        self.assertAlmostEqual(self.rows["static world apart"][1] / self.plain[1], 1, delta=0.15)

    def test_who_sleeps_is_not_collided(self):
        self.assertLess(self.rows["who rests sleeps"][1], 0.2 * self.plain[1])

    def test_proxies_need_fewer_contacts(self):
        self.assertLess(self.rows["coarse proxies far away"][1], 0.9 * self.plain[1])

    def test_bullets_are_stopped_unless_nothing_is_stepped_often_enough(self):
        for name, row in self.rows.items():
            if name == "(no sub-steps at all)":
                self.assertGreater(row[3], 10)
            else:
                self.assertEqual(row[3], 0, name)

    def test_what_is_printed_as_saved_is(self):
        for name, row in self.rows.items():
            if name == "nothing done":
                self.assertEqual(row[4], "-")
            else:
                self.assertAlmostEqual(float(row[4].split()[0]), 100 * (1 - self.share(name)), delta=0.06)

    def test_flags_choose_what_is_done(self):
        few = ("--size", "0.1", "--frames", "2")
        alone = rows(*few)
        for flags, name in ((("--layers",), "categories as layers"), (("--apart",), "static world apart"),
                            (("--asleep",), "who rests sleeps"), (("--substeps",), "sub-steps of the fast only"),
                            (("--proxies",), "coarse proxies far away"),
                            (("--layers", "--apart", "--asleep", "--substeps", "--proxies"), "all of these")):
            chosen = rows(*few, *flags)
            self.assertEqual(list(chosen), ["nothing done", "what was asked for"])
            self.assertEqual(chosen["what was asked for"][:2], alone[name][:2])

    def test_bad_arguments_are_refused(self):
        for words in (("--sleep",), ("--size",), ("--size", "0"), ("--size", "nan"), ("--frames", "0"), ("--frames", "2x"), ("3",)):
            self.assertIn("usage: scene", run(*words, code=2))

    def test_the_page_names_each_measure_and_flag(self):
        with open(readme) as file:
            page = file.read()
        for name in self.rows:
            self.assertIn(name.strip("()"), page)
        for flag in re.findall(r"--\w+", run("--help", code=2)):
            self.assertIn("`" + flag, page)


if __name__ == "__main__":
    unittest.main()
