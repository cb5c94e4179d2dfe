"""Tests what ablation.py makes of recorded times."""

import csv
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True  # nothing is left beside the sources
sys.path.insert(0, HERE)
import ablation  # noqa: E402

NAMES = [name for _, name in ablation.mechanisms(os.path.dirname(os.path.dirname(HERE)))] + ["nothing"]


class Ablation(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "ablation.csv")

    def write(self, cells, names=NAMES):
        """Of each cell the time of the whole library, and what the time without a mechanism is if it is not 2."""
        with open(self.file, "w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(["without", "cell", "ms", "ms_without", "ratio"])
            for cell, (whole, others) in cells.items():
                for name in names:
                    rows.writerow([name, cell, whole, others.get(name, 2), ""])

    def table(self):
        return subprocess.run([sys.executable, os.path.join(HERE, "ablation.py"), "table", self.file],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)

    def test_a_cell_whose_whole_library_was_slow_makes_nobody_gain(self):
        self.write({"slow": (3, {}), "usual": (2, {"kept_pairs": 8})})
        by_name, unsteady = ablation.ratios_of(self.file)
        self.assertEqual(unsteady, [])
        self.assertEqual(by_name["kept_pairs"], [(1, "slow"), (4, "usual")])
        self.assertEqual(by_name["whole"], [(1.5, "slow"), (1, "usual")])

    def test_a_cell_in_which_half_of_the_libraries_differ_is_left_out_and_named(self):
        half = {name: 3 for name in NAMES[::2]}
        self.write({"steady": (2, {"kept_pairs": 4}), "unsteady": (2, half)})
        self.assertEqual(ablation.ratios_of(self.file)[1], ["unsteady"])
        said = self.table()
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn("in 1 cells", said.stdout)
        self.assertIn("1 other cells are left out", said.stdout)
        self.assertIn("| `kept_pairs` | 2.000 | 1 | 2.00 | steady | 2.00 | steady |", said.stdout)

    def test_a_gain_within_what_idle_mechanisms_show_counts_for_nothing(self):
        self.write({"cell": (2, {"kept_pairs": 2.4, ablation.IDLE[0]: 2.6, "query_trees": 2.8})})
        said = self.table().stdout
        self.assertIn("| `kept_pairs` | 1.200 | 0 |", said)
        self.assertIn("| `query_trees` | 1.400 | 1 |", said)

    def test_a_file_without_what_tells_the_noise_is_refused(self):
        self.write({"cell": (2, {})}, names=["kept_pairs", "query_trees"])
        said = self.table()
        self.assertEqual(said.returncode, 1)
        self.assertIn("of which the noise is taken", said.stderr)


if __name__ == "__main__":
    unittest.main()
