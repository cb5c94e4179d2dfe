"""Tests that what step.py records is what pile measured and plot.py draws: step_test.py <pile>."""
import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

program = sys.argv.pop(1)
sys.dont_write_bytecode = True  # nothing is left beside the sources
import step


class Step(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder, self.file = folder.name, os.path.join(folder.name, "step.csv")

    def record(self, *options, path=os.environ["PATH"]):
        subprocess.run([sys.executable, step.__file__, "--pile", program, "--out", self.file, "--steps", "4", "--settle", "120",
                        "--turns", "2", *options], check=True, stdout=subprocess.DEVNULL, env=dict(os.environ, PATH=path))
        with open(self.file, newline="") as rows:
            return list(csv.DictReader(rows))

    def test_each_size_has_each_space_and_all_begin_with_the_same_pile(self):
        rows = self.record("--bodies", "150", "300", path="/nowhere")  # no git either
        self.assertEqual([(row["bodies"], row["space"]) for row in rows],
                         [(size, space) for size in ("150", "300") for space in step.SPACES])
        for row in rows:
            self.assertEqual((row["status"], row["steps"], row["commit"]), ("ok", "8", ""))
            cpus = pathlib.Path("/proc/cpuinfo").read_text()
            self.assertTrue("model name" not in cpus or ": %s\n" % row["cpu"] in cpus, row["cpu"])
            ours = not row["space"].startswith("d")
            self.assertEqual(int(row["threads"]), len(os.sched_getaffinity(0)) if ours else 1)
            self.assertGreater(int(row["contacts"]), 50)
            self.assertAlmostEqual(sum(float(row[part]) for part in step.PARTS), float(row["step_ms"]), delta=0.001)
        for four in rows[:4], rows[4:]:
            pairs = [int(row["pairs"]) for row in four]
            self.assertLess(max(pairs) - min(pairs), 0.03 * max(pairs))

    def test_what_takes_too_long_is_left_out_and_the_figure_has_the_recorded_bars(self):
        slow = self.record("--bodies", "150", "--limit", "0.001")
        self.assertEqual({(row["status"], row["step_ms"]) for row in slow}, {("left out: longer than 0.001 s", "")})
        try:
            import plot
        except SystemExit as reason:
            self.skipTest(str(reason))
        rows = self.record("--bodies", "150")[:3] + slow[3:]
        with open(self.file, "w", newline="") as file:
            out = csv.DictWriter(file, step.COLUMNS)
            out.writeheader()
            out.writerows(dict(row, commit="3e04000") for row in rows)  # a commit that looks like a number
        [figure] = plot.draw(self.folder)
        pile, axes = figure.axes
        self.assertEqual(len(pile.images), 1)
        self.assertEqual([round(bar.get_height(), 6) for bar in axes.patches],
                         [float(row[part]) for row in rows[:3] for part in step.PARTS])
        self.assertAlmostEqual(axes.lines[0].get_ydata()[0], 1000 / 60)
        self.assertIn(" " + slow[3]["status"], [text.get_text() for text in axes.texts])
        self.assertGreater(os.path.getsize(os.path.join(self.folder, "step.png")), 10000)


unittest.main(verbosity=2)
