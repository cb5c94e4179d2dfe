"""Tests that what step.py records is what pile measured and plot.py draws: step_test.py <pile>."""

import csv
import os
import subprocess
import sys
import tempfile
import unittest

program = sys.argv.pop(1)
HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True  # nothing is left beside the sources
sys.path.insert(0, HERE)
PARTS = ("broad_ms", "narrow_ms", "joints_ms", "solver_ms")


class Step(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def record(self, *options, path=os.environ["PATH"]):
        file = os.path.join(self.folder, "step.csv")
        subprocess.run([sys.executable, os.path.join(HERE, "step.py"), "--pile", program, "--out", file, "--steps", "4",
                        "--settle", "120", *options], check=True, stdout=subprocess.DEVNULL, env=dict(os.environ, PATH=path))
        with open(file, newline="") as rows:
            return list(csv.DictReader(rows))

    def test_each_size_has_each_space_and_all_begin_with_the_same_pile(self):
        rows = self.record("--bodies", "150", "300", path="/nowhere")  # no git either
        self.assertEqual([(row["bodies"], row["space"]) for row in rows], [
            (size, space) for size in ("150", "300") for space in
            ("dHashSpace", "dSweepAndPruneSpace", "ours, serial contacts", "ours, parallel contacts")])
        for row in rows:
            self.assertEqual((row["status"], row["steps"], row["commit"]), ("ok", "4", ""))
            self.assertGreater(int(row["contacts"]), 50)
            self.assertAlmostEqual(sum(float(row[part]) for part in PARTS), float(row["step_ms"]), delta=0.001)
        for four in rows[:4], rows[4:]:
            pairs = [int(row["pairs"]) for row in four]
            self.assertLess(max(pairs) - min(pairs), 0.03 * max(pairs))

    def test_what_takes_too_long_is_left_out(self):
        for row in self.record("--bodies", "150", "--limit", "0.001"):
            self.assertEqual(row["status"], "left out: longer than 0.001 s")
            self.assertEqual(row["step_ms"], "")

    def test_the_figure_has_the_recorded_bars(self):
        try:
            import plot
        except ImportError:
            self.skipTest("needs Debian's python3-matplotlib")
        rows = self.record("--bodies", "150", "300")
        rows[1]["status"] = "left out: a reason"
        with open(os.path.join(self.folder, "step.csv"), "w", newline="") as file:
            out = csv.DictWriter(file, list(rows[0]))
            out.writeheader()
            out.writerows(rows)
        figure = plot.step(self.folder)
        self.assertGreater(os.path.getsize(os.path.join(self.folder, "step.png")), 10000)
        self.assertEqual(len(figure.axes), 2)
        for axes, some in zip(figure.axes, (rows[:4], rows[4:])):
            heights = [round(bar.get_height(), 6) for bar in axes.patches]
            expected = [float(row[part]) for row in some if row["status"] == "ok" for part in PARTS]
            self.assertEqual(heights, expected)
            self.assertAlmostEqual(axes.lines[0].get_ydata()[0], 1000 / 60)
        self.assertIn(" left out: a reason", [text.get_text() for text in figure.axes[0].texts])


unittest.main(verbosity=2)
