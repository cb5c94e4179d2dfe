"""Tests that the outcomes of the recorded rows are what README.md says outcomes are: words_test.py."""

import csv
import os
import re
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
PARTS = dict(zip(("half", "fifth", "tenth", "twentieth", "fiftieth", "five-hundredth", "thousandth"),
                 (1 / 2, 1 / 5, 1 / 10, 1 / 20, 1 / 50, 1 / 500, 1 / 1000)))
STANDS, OWED = ("stands",), ("stands", "stops", "settles", "holds", "keeps")


def text():
    with open(os.path.join(HERE, "README.md"), encoding="utf-8") as file:
        return file.read()


def readme():
    return re.sub(r"\s+", " ", text())


def rows():
    found = []
    for precision in "double", "single":
        with open(os.path.join(HERE, "results", precision + ".csv"), newline="", encoding="utf-8") as file:
            found += [dict(row, ours=row["ours"].split(" at step ")[0]) for row in csv.DictReader(file)]
    return [row for row in found if row["ours"] not in ("aborts", "not finite")]


def limit(pattern):
    """The part that stands in README.md where the pattern has a group."""
    return PARTS[re.search(pattern, readme()).group(1)]


class Outcomes(unittest.TestCase):
    def above(self, outcomes, column, part, others=OWED):
        """Those have more than this part in the column, the others have not."""
        for row in rows():
            value = abs(float(row[column]))
            if row["ours"] in outcomes:
                self.assertGreater(value, part, row["extreme"])
            elif row["ours"] in others:
                self.assertLessEqual(value, part, row["extreme"])

    def test_are_by_the_limits_of_the_readme(self):
        half = limit(r"a body is lower, or elsewhere, by more than (\S+) a unit")
        self.above(("collapses",), "sink", half, STANDS + ("sags", "shifts", "creeps"))
        self.above(("slides away",), "shift", half, STANDS + ("sags", "shifts", "creeps"))
        self.above(("penetrates",), "depth", limit(r"late contacts are deeper than a (\S+) "), ("stands", "settles", "sags"))
        sags = limit(r"lower or elsewhere by more than a (\S+);")
        self.above(("sags",), "sink", sags, STANDS + ("shifts", "creeps", "jitters"))
        self.above(("shifts",), "shift", sags, STANDS + ("creeps", "jitters"))
        self.above(("creeps",), "creep", limit(r"by more than a (\S+) in the second half"), STANDS + ("jitters",))
        self.above(("explodes",), "gain", 2, ("stands", "stops", "settles"))
        self.assertIn("came from nowhere, more than twice what", readme())

    def test_of_joints_and_free_bodies_too(self):
        self.above(("breaks",), "gap", limit(r"is above a (\S+) or a \S+ \|"), ("holds", "stretches"))
        self.above(("stretches",), "gap", limit(r"is above a \S+ or a (\S+) \|"), ("holds",))
        self.above(("gains energy", "loses energy"), "energy", limit(r"drifts \| by more than a (\S+);"), ("drifts", "keeps"))
        part = limit(r"the turn \(radians\) by more than a (\S+) ")
        for row in rows():
            worst = max(abs(float(row[column])) for column in ("energy", "momentum", "turn"))
            if row["ours"] in ("keeps", "drifts"):
                self.assertEqual(worst > part, row["ours"] == "drifts", row["extreme"])

    def test_are_the_same_bits_and_with_another_order_sometimes_another(self):
        self.assertIn("the first and the last must be the same *bit for bit*", readme())
        self.assertEqual({row["same_bits"] for row in rows()}, {"1"})
        self.assertIn("and with it sometimes another outcome", readme())
        self.assertTrue(0 < sum(row["hash"] != row["ours"] for row in rows()) < len(rows()) / 4)

    def test_of_a_kind_are_in_the_table_of_the_readme(self):
        cells = re.findall(r"^\| [^|]+ \| ([^|]+) \|", text().split("Three runs of each")[0], re.M)
        named = set(", ".join(cells).replace("gains or loses energy", "gains energy, loses energy").split(", "))
        self.assertLessEqual({row["ours"] for row in rows()} - set(OWED), named)

    def test_a_rescue_is_where_one_is_needed(self):
        for row in rows():
            self.assertEqual(row["rescue"] == "", row["ours"] in OWED, row["extreme"])
            self.assertEqual(float(row["rescue_cost"]) > 0, row["rescue"] not in ("", "none of these", "not looked for"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
