"""Tests that the page's table is what solver.py makes: solver_test.py <pile> <page>."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

page = sys.argv.pop(2)
program = sys.argv.pop(1)
sys.dont_write_bytecode = True  # nothing is left beside the sources
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import solver


def rows(text):
    """What and options of each row, and its numbers."""
    found = re.findall(r"^\| (.*?) \| (.*?) \| ([\d,]+) \| (\S+) \| (\S+) \| (\S+) \|$", text, re.M)
    return [row[:2] for row in found], [[float(cell.replace(",", "")) for cell in row[2:]] for row in found]


class Solver(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(folder, "page.md")
            shutil.copy(page, copy)
            subprocess.run([sys.executable, solver.__file__, "--pile", program, "--quick", "--write", copy], check=True)
            with open(copy) as file:
                cls.made = file.read()
        with open(page) as file:
            cls.kept = file.read()

    def test_the_page_has_the_rows_that_the_script_makes(self):
        self.assertEqual(rows(self.kept)[0], rows(self.made)[0])
        self.assertEqual(len(rows(self.kept)[0]), sum(len(block[2]) for block in solver.BLOCKS))

    def test_only_the_table_is_replaced(self):
        outside = [re.sub(r"<!-- solver -->.*?<!-- end -->", "", text, flags=re.S) for text in (self.kept, self.made)]
        self.assertEqual(outside[0], outside[1])
        self.assertGreater(len(outside[0]), 1000)

    def test_the_numbers_are_those_of_what_was_done(self):
        names, numbers = rows(self.made)
        by_options = {options: cells for (_, options), cells in zip(names, numbers)}
        contacts = {options: cells[0] for options, cells in by_options.items()}
        self.assertLess(contacts["`--reduce deepest --contacts 1`"], contacts["`--reduce spread --contacts 2`"])
        self.assertLess(contacts["`--reduce spread --contacts 2`"], contacts["–"])
        self.assertLess(contacts["–"], contacts["`--contacts 64`"])
        self.assertEqual(contacts["`--sleep on`"], 0)
        self.assertEqual(numbers[0][2], 1)
        for ms, ratio in (cells[1:3] for cells in numbers[:11]):
            self.assertAlmostEqual(ratio, ms / numbers[0][1], delta=0.006 + 0.006 * ratio)

    def test_a_page_without_a_place_for_it_is_refused(self):
        with self.assertRaises(SystemExit):
            solver.replaced("no marks", "text")


unittest.main(verbosity=2)
