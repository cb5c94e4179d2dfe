"""Tests that README.md says what the study does: its figures are those of the settings, and what it concludes is what
the recorded rows say. Exit code 77: a package is missing."""

import glob
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources
HERE = os.path.dirname(os.path.abspath(__file__))

try:
    import accuracy
    import settings
    import stats
    import study
except ImportError as error:
    print("Skipped: %s (Debian: python3-matplotlib python3-tqdm)" % error)
    sys.exit(77)

NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight")
RESULTS = sorted(glob.glob(os.path.join(HERE, "results", "*", "scenes.csv")))


def readme():
    with open(os.path.join(HERE, "README.md")) as file:
        return re.sub(r"\s+", " ", file.read())


def source(name):
    with open(os.path.join(HERE, name)) as file:
        return file.read()


def constant(name, pattern):
    """A number in a source, by what stands around it."""
    found, = set(re.findall(pattern, source(name)))
    return found


def sentences():
    """What README.md has to say, by what the study does."""
    quick, full = settings.PLANS["quick"], settings.PLANS["full"]
    base, small, far = settings.BASE, settings.MOST_BODIES_OF_STEP, study.OFFSETS
    members = {mode: len(settings.REFERENCE[mode]) for mode in ("quick", "full")}
    yield "A setting gets %d seeds (in the whole study %s" % (quick.first, NUMBERS[full.first])
    yield "and there are fewer than %d (%d)" % (quick.most, full.most)
    yield "differs from it in one thing get %d in any case" % full.least
    yield "of %d seeds or more is within the limit" % full.least
    yield "the same is true of %d fresh seeds (%d)" % (quick.fresh, full.fresh)
    yield "at most %s are tried" % NUMBERS[full.tries]
    yield "Intervals** are of %g %%" % (100 * stats.LEVEL)
    yield "with %s steps (%s in the whole study)" % (NUMBERS[members["quick"]], NUMBERS[members["full"]])
    yield "(%g ms, %d iterations, %d contacts" % (1000 * base.dt, base.iterations, base.contacts)
    yield "(only of more than %d bodies" % (settings.LEAST_BODIES_OF_TOLERANCE - 1)
    yield "`dWorldStep` where the scene is small (up to %d bodies)" % small
    yield "Bodies weigh {:,g} kg/m³".format(settings.DENSITY)
    yield "at %d, %s and %s m from the origin" % (far[0], ", ".join("1e%d" % (len("%d" % f) - 1) for f in far[1:-1]),
                                                  "1e%d" % (len("%d" % far[-1]) - 1))
    yield "errors within %s and %d %%" % (", ".join("%d" % (100 * limit) for limit in settings.LIMITS[:-1]),
                                         100 * settings.LIMITS[-1])
    yield "until its time is up (%s s)" % constant("scenes.cpp", r"scene\.seconds = (\d+);")
    yield "than %g %% of √(g × size) would take it in half a second" % (
        100 * float(constant("harness/state.h", r" slow = ([\d.]+);")))
    yield "boxes of %s to %s m fall into a pit" % tuple("%g" % float(v) for v in constant(
        "scenes.cpp", r"length = random\.uniform\(([\d.]+), ([\d.]+)\)"))
    yield "balls of %g to %g m fall into a hopper" % tuple(2 * float(v) for v in constant(
        "scenes.cpp", r"radius = random\.uniform\(([\d.]+), ([\d.]+)\)"))


class Figures(unittest.TestCase):
    def test_are_those_of_the_settings(self):
        text = readme()
        for sentence in sentences():
            self.assertIn(sentence, text)

    def test_the_table_of_scenes_has_those_that_are_studied(self):
        rows = re.findall(r"^\| (\w+) \| [^|]+ \|$", re.search(r"(?s)## The scenes(.*?)\n\n[^|\n]", source("README.md")).group(1),
                          re.M)
        for mode in "quick", "full":
            self.assertEqual(set(rows) - {"scene"}, set(settings.SCENES[mode]))

    def test_what_is_only_in_one_of_the_studies_is_not_in_the_other(self):
        def far_and_single(mode):
            return [p for p in study.broad_points(mode, ["double", "single"], False)
                    if p["offset"] == 1e9 and p["precision"] == "single"]

        self.assertTrue(far_and_single("quick"))
        self.assertFalse(far_and_single("full"))
        grids = [settings.GRID[mode] for mode in ("quick", "full")]
        self.assertEqual([set(grid) for grid in grids], [{"dt", "iterations"}, {"dt", "iterations", "contacts"}])
        self.assertEqual(["all" in settings.VARIED[mode]["skip"] for mode in ("quick", "full")], [False, True])
        self.assertEqual([max(settings.SCENES[mode].values()) >= settings.LEAST_BODIES_OF_TOLERANCE
                          for mode in ("quick", "full")], [False, True])

    def test_steps_of_the_reference_are_apart_as_said(self):
        for mode, least in ("quick", 0.8), ("full", 0.8):
            steps = [setting.dt for setting in settings.REFERENCE[mode]]
            self.assertAlmostEqual(min(steps) / max(steps), least)


class Conclusions(unittest.TestCase):
    """Of rows that are kept, README.md says what a report of them says; where none are, it says so."""

    def test_are_what_the_recorded_rows_say(self):
        text = source("README.md")
        if not RESULTS:
            self.assertIn("No results are kept here", text)
            self.assertNotIn("<!-- tradeoff -->", text)
            return
        self.assertNotIn("No results are kept here", text)
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(folder, "README.md")
            with open(copy, "w") as file:
                file.write(text)
            for path in RESULTS:
                out = os.path.dirname(path)
                with open(os.path.join(out, "choices.md")) as file:
                    before = file.read()
                said = subprocess.run([sys.executable, os.path.join(HERE, "tradeoff.py"), "--report", "--no-figures", "--out",
                                       out, "--write", copy], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                self.assertEqual(said.returncode, 0, said.stdout)
                with open(os.path.join(out, "choices.md")) as file:
                    self.assertEqual(before, file.read(), "%s is not what its rows say" % out)
            with open(copy) as file:
                self.assertEqual(text, file.read())


if __name__ == "__main__":
    unittest.main(verbosity=2)
