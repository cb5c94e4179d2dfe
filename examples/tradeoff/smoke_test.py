"""Tests the trade-off study: smoke_test.py <tradeoff-point>. Exit code 77: a package is missing."""

import csv
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources
HERE = os.path.dirname(os.path.abspath(__file__))
README = os.path.join(HERE, "README.md")

try:
    import tqdm
    from matplotlib.image import imread

    import study
    import traced
    import words
except ImportError as error:
    print("Skipped: %s (Debian: python3-matplotlib python3-tqdm)" % error)
    sys.exit(77)

program = sys.argv.pop(1)


def output_of(*command, **environment):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env=dict(os.environ, **environment))


def call(*arguments, **environment):
    return output_of(sys.executable, os.path.join(HERE, "tradeoff.py"), "--smoke", *arguments, **environment)


def run_study(folder, *arguments, **environment):
    result = call("--out", folder, "--double", program, "--single", os.path.join(folder, "no-such-program"), *arguments,
                  **environment)
    if result.returncode != 0:
        raise AssertionError(result.stdout)
    return result.stdout


def read(folder, name):
    with open(os.path.join(folder, name + ".csv"), newline="") as file:
        return list(csv.DictReader(file))


def choices(folder):
    with open(os.path.join(folder, "choices.md")) as file:
        return file.read()


class Study(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.output = run_study(cls.folder.name)
        cls.broad, cls.pile = read(cls.folder.name, "broad"), read(cls.folder.name, "pile")
        cls.choices = choices(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_says_that_single_precision_is_left_out(self):
        self.assertIn("Single precision is left out: there is no", self.output)
        self.assertEqual({row["precision"] for row in self.broad + self.pile}, {"double"})

    def test_measures_every_point_once(self):
        has_cuda = any(row["backend"] == "cuda" for row in self.broad)
        points = study.broad_points("smoke", ["double"], has_cuda)
        self.assertEqual(sorted(study.key(row, study.BROAD_KEY) for row in self.broad),
                         sorted(study.key(point, study.BROAD_KEY) for point in points))
        points = study.pile_points("smoke", ["double"])
        self.assertEqual(sorted(study.key(row, study.PILE_KEY) for row in self.pile),
                         sorted(study.key(point, study.PILE_KEY) for point in points))

    def test_our_space_is_exact_without_a_tolerance_and_misses_nothing_with_one(self):
        ours = [row for row in self.broad if row["space"] == "parallel"]
        self.assertEqual({row["status"] for row in ours}, {"ok"})
        for row in ours:
            self.assertEqual(int(row["missed_of_stored"]), 0, row)
            if float(row["tolerance"]) == 0:
                self.assertEqual(int(row["extra_of_stored"]), 0, row)
                self.assertEqual(row["pairs"], row["exact_pairs"], row)

    def test_a_tolerance_lets_extra_pairs_through(self):
        extra = sum(int(row["extra_of_stored"]) for row in self.broad
                    if row["space"] == "parallel" and float(row["tolerance"]) > 0)
        self.assertGreater(extra, 0)

    def test_sees_the_pairs_that_float_keys_add_far_from_the_origin(self):
        extra = {float(row["offset"]): float(row["extra_per_exact"]) for row in self.broad if row["space"] == "sap"}
        self.assertEqual(extra[0], 0)
        self.assertGreater(extra[1e9], 0.5)

    def test_no_momentum_comes_from_nowhere(self):
        for row in self.pile:
            self.assertEqual(row["status"], "ok")
            # Several of ODE's threads may lose some of each other's changes to a body.
            self.assertLess(float(row["momentum_drift"]), 1e-12 if row["stepping"] == "serial" else 1e-3)
            self.assertLess(float(row["angular_drift"]), 1e-3)

    def test_parallel_runs_make_the_same_heap_in_another_way(self):
        # ODE's threads solve the rows in another order, so the runs differ in detail only.
        heaps = {(row["iterations"], row["stepping"]): float(row["height_m"]) for row in self.pile
                 if float(row["dt"]) == 0.02}
        for iterations in ("5", "20"):
            serial, parallel = heaps[iterations, "serial"], heaps[iterations, "parallel"]
            self.assertLess(abs(parallel - serial), 0.1 * serial)

    def test_an_interrupted_run_goes_on_where_it_was(self):
        path = os.path.join(self.folder.name, "broad.csv")
        with open(path) as file:
            whole = file.read()
        with open(path, "w") as file:
            file.write(whole[:-60])  # the last row is cut short
        output = run_study(self.folder.name)
        self.assertIn("broad: 1 of %d points to measure" % len(self.broad), output)
        self.assertIn("pile: 0 of %d points to measure" % len(self.pile), output)
        self.assertEqual(len(read(self.folder.name, "broad")), len(self.broad))
        self.assertEqual(read(self.folder.name, "pile"), self.pile)

    def test_without_git_the_commit_is_unknown(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(os.path.join(self.folder.name, "broad.csv"), folder)
            path = os.path.join(folder, "broad.csv")
            with open(path) as file:
                *others, _ = file.readlines()
            with open(path, "w") as file:
                file.writelines(others)
            run_study(folder, "--only", "broad", PATH=folder)
            self.assertEqual(read(folder, "broad")[-1]["commit"], "unknown")
            self.assertEqual(os.listdir(folder).count("pile.csv"), 0)

    def test_several_points_at_once_have_each_its_share_of_the_cores(self):
        count = len(os.sched_getaffinity(0))
        with tempfile.TemporaryDirectory() as folder:
            told, log = os.path.join(folder, "told"), os.path.join(folder, "log")
            with open(told, "w") as file:  # the program, once it has told which cores it may use
                file.write("#!/bin/sh\necho \"$* $(grep Cpus_allowed_list /proc/self/status)\" >>%s\nexec %s \"$@\"\n" %
                           (log, program))
            os.chmod(told, 0o755)
            run_study(folder, "--at-once", str(count), "--double", told)
            broad, pile = read(folder, "broad"), read(folder, "pile")
            with open(log) as file:
                cores = [re.match(r"pile .*:\s*(\S+)$", line).group(1) for line in file if line.startswith("pile")]
        self.assertEqual(len(cores), len(pile))
        self.assertLessEqual(set(cores), {str(core) for core in os.sched_getaffinity(0)})
        self.assertEqual({row["cores"] for row in broad}, {str(count)})
        self.assertEqual({row["cores"] for row in pile}, {"1"})
        self.assertEqual(len(broad), len(self.broad))

        def serial(rows):
            return {study.key(row, study.PILE_KEY): row["height_m"] for row in rows if row["stepping"] == "serial"}

        self.assertEqual(serial(pile), serial(self.pile))

    def test_reports_on_rows_of_another_machine_but_measures_none(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, rows in ("broad", self.broad), ("pile", self.pile):
                with open(os.path.join(folder, name + ".csv"), "w", newline="") as file:
                    writer = csv.DictWriter(file, rows[0], lineterminator="\n")
                    writer.writeheader()
                    writer.writerows(dict(row, cpu="another", cores="77") for row in reversed(rows))
            result = call("--out", folder, "--report")
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertEqual(choices(folder).count("another, 77 cores"), 2)
            machine = re.compile(r" [^,]*, \d+ cores, .*")
            self.assertEqual(machine.sub("", choices(folder)), machine.sub("", self.choices))
            self.assertIn("rows of another machine", call("--out", folder, "--double", program).stdout)

            path = os.path.join(folder, "pile.csv")
            with open(path) as file:
                header, _, *others = file.readlines()
            with open(path, "w") as file:
                file.writelines([header, *others])
            said = call("--out", folder, "--report").stdout
            self.assertIn(", 1 of %d points not measured:" % len(self.pile), said)
            os.remove(path)
            self.assertIn("pile.csv has no setting with all its seeds", call("--out", folder, "--report").stdout)

    def test_puts_the_advice_between_the_marks_of_a_document(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in "broad.csv", "pile.csv":
                shutil.copy(os.path.join(self.folder.name, name), folder)
            document = os.path.join(folder, "document.md")
            with open(document, "w") as file:
                file.write("before\n<!-- tradeoff -->\nold\n<!-- end -->\nafter\n")
            self.assertEqual(call("--out", folder, "--report", "--write", document).returncode, 0)
            with open(document) as file:
                text = file.read()
            self.assertRegex(text, r"(?s)^before\n<!-- tradeoff -->\n\nBroad phase, .*\nA heap of .*\n<!-- end -->\nafter\n$")
            self.assertNotIn("old", text)
            self.assertNotIn("|", text)  # the tables are in choices.md
            self.assertIn("| Pareto front", choices(folder))

    def test_the_columns_are_those_that_the_readme_explains(self):
        with open(README) as file:
            text = file.read()
        for rows, key, part in ((self.broad, study.BROAD_KEY, r"## The broad phase.*## The heap"),
                                (self.pile, study.PILE_KEY, r"## The heap.*")):
            lines = re.findall(r"^\| (`.*?) \|", re.search("(?s)" + part, text).group(), re.M)
            explained = [name for line in lines for name in re.findall(r"`(\w+)`", line)]
            around = {*key, "status", "cpu", "cores", "commit", "date"}
            self.assertEqual(explained, [name for name in rows[0] if name not in around])

    def test_there_are_about_four_pairs_a_box(self):
        result = subprocess.run([program, "broad", "--boxes", "5000", "--frames", "2"], stdout=subprocess.PIPE, text=True)
        names, values = result.stdout.splitlines()
        pairs = int(dict(zip(names.split(","), values.split(",")))["exact_pairs"])
        self.assertTrue(3.5 < pairs / 5000 < 4.6, pairs)

    def test_draws_the_points(self):
        for name in ("broad", "pile", "pile-parts"):
            picture = imread(os.path.join(self.folder.name, name + ".png"))
            coloured = (picture[:, :, :3].max(axis=2) - picture[:, :, :3].min(axis=2)) > 0.3
            self.assertGreater(coloured.sum(), 100, name)

    def test_says_what_to_choose(self):
        for words_wanted in ("1e+09 m from the origin", "no extra pair: parallel-sap", "within 1 %", "within 20 %",
                             "dSweepAndPruneSpace", "differences below that say nothing"):
            self.assertIn(words_wanted, self.choices)


class Sources(unittest.TestCase):
    def test_results_have_a_folder_named_by_processor_and_mode(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in os.listdir(HERE):
                if name.endswith(".py"):
                    shutil.copy(os.path.join(HERE, name), folder)
            for options in ("--quick",), ():
                output_of(sys.executable, os.path.join(folder, "tradeoff.py"), "--report", *options)
            names = sorted(os.listdir(os.path.join(folder, "results")))
            self.assertEqual(names, [names[0], names[0] + "-quick"])
            self.assertRegex(names[0], "^[a-z0-9-]+-%d-cores$" % len(os.sched_getaffinity(0)))

    def test_what_the_readme_concludes_is_made_from_the_recorded_rows(self):
        recorded = os.path.join(HERE, "results", "xeon-16-cores")
        with tempfile.TemporaryDirectory() as folder:
            document = shutil.copy(os.path.join(os.path.dirname(HERE), "README.md"), folder)
            for name in "broad.csv", "pile.csv":
                shutil.copy(os.path.join(recorded, name), folder)
            result = output_of(sys.executable, os.path.join(HERE, "tradeoff.py"), "--report", "--out", folder, "--write", document)
            self.assertEqual(result.returncode, 0, result.stdout)
            for made, kept in ((document, os.path.join(os.path.dirname(HERE), "README.md")),
                               (os.path.join(folder, "choices.md"), os.path.join(recorded, "choices.md"))):
                with open(made) as first, open(kept) as second:
                    self.assertEqual(first.read(), second.read())

    def test_nothing_is_left_beside_them(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in os.listdir(HERE):
                if name.endswith(".py"):
                    shutil.copy(os.path.join(HERE, name), folder)
            before = sorted(os.listdir(folder))
            for command in ("tradeoff.py", "--help"), ("smoke_test.py", program, "Analysis"):
                result = output_of(sys.executable, os.path.join(folder, command[0]), *command[1:],
                                   PYTHONDONTWRITEBYTECODE="", PYTHONPYCACHEPREFIX="")
                self.assertEqual(result.returncode, 0, result.stdout)
            self.assertEqual(sorted(os.listdir(folder)), before)

    def test_help_neither_installs_nor_builds_and_needs_no_package(self):
        with tempfile.TemporaryDirectory() as folder:
            called = os.path.join(folder, "called")
            for name in ("apt-get", "cmake", "sudo"):
                with open(os.path.join(folder, name), "w") as file:
                    file.write("#!/bin/sh\necho %s >>%s\nexit 1\n" % (name, called))
                os.chmod(file.name, 0o755)
            for name in ("matplotlib", "tqdm"):  # in place of the real ones
                with open(os.path.join(folder, name + ".py"), "w") as file:
                    file.write("raise ImportError('not installed')\n")
            path = folder + os.pathsep + os.environ["PATH"]
            for asked in ("--help",), ("--quick", "-h"):
                result = output_of(os.path.join(HERE, "run"), *asked, PATH=path, PYTHONPATH=folder)
                self.assertEqual(result.returncode, 0, result.stdout)
                self.assertIn("usage: tradeoff.py", result.stdout)
                self.assertFalse(os.path.exists(called), result.stdout)
            result = call("--report", PYTHONPATH=folder)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn("apt-get install python3-matplotlib python3-tqdm", result.stdout)


class Traced(unittest.TestCase):
    """A trace of the study's own boxes, which have no bodies."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.trace = os.path.join(cls.folder.name, "boxes.trace")
        written = output_of(program, "broad", "--boxes", "300", "--frames", "4", ODE_PARALLEL_SAP_TRACE=cls.trace)
        if written.returncode != 0:
            raise AssertionError(written.stdout)
        cls.output = run_study(cls.folder.name, "--trace", cls.trace)
        cls.rows = read(cls.folder.name, "trace")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def pairs(self, work, **setting):
        base = dict(space="parallel", skip="nothing", tolerance=0, threads=1, devices=0, work=work)
        found = [row for row in self.rows if all(row[name] == value if isinstance(value, str) else
                                                 float(row[name]) == value for name, value in dict(base, **setting).items())]
        self.assertEqual(len(found), 1, setting)
        return float(found[0]["pairs"])

    def test_measures_every_point_once_and_not_again(self):
        self.assertEqual({row["status"] for row in self.rows}, {"ok"})
        has_cuda = any(row["devices"] == "1" for row in self.rows)
        points = traced.points(self.trace, len(os.sched_getaffinity(0)), has_cuda)
        self.assertEqual(sorted(study.key(row, traced.KEY) for row in self.rows),
                         sorted(study.key(point, traced.KEY) for point in points))
        run_study(self.folder.name, "--trace", self.trace)
        self.assertEqual(read(self.folder.name, "trace"), self.rows)

    def test_settings_have_the_pairs_that_they_say(self):
        for work, _ in traced.WORKS:
            pairs = self.pairs(work)
            self.assertGreater(pairs, 0)
            self.assertEqual(self.pairs(work, skip="asleep"), pairs)
            self.assertEqual(self.pairs(work, skip="static"), 0)
            self.assertEqual(self.pairs(work, skip="all"), 0)
            self.assertGreater(self.pairs(work, tolerance=0.3), pairs)
            if work != "contacts":
                self.assertEqual(self.pairs(work, space="hash"), pairs)
        self.assertEqual(len({row["contacts"] for row in self.rows if row["skip"] == "nothing" and
                              row["work"] != "pairs"}), 1)

    def test_the_table_has_every_setting(self):
        with open(os.path.join(self.folder.name, "trace.md")) as file:
            text = file.read()
        self.assertEqual(text.count("| as traced |"), 3)
        self.assertEqual(len(re.findall("^\\| [a-zA-Z0-9]", text, re.M)), len(self.rows) + 3)
        self.assertEqual(text.count("Quickest for certain: "), 3)
        self.assertIn(text, self.output)

    def test_refuses_what_is_no_trace(self):
        result = call("--trace", os.path.join(self.folder.name, "trace.csv"), "--double", program)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("it is no trace", result.stdout)
        result = call("--trace", os.path.join(self.folder.name, "none"))
        self.assertIn("there is no file", result.stdout)


class Analysis(unittest.TestCase):
    def test_the_front_is_what_nothing_beats_in_both(self):
        entries = [dict(ms=ms, error=error) for ms, error in ((3, 0.1), (1, 0.5), (2, 0.5), (4, 0.2), (9, 0), (1, 0.6))]
        self.assertEqual([(e["ms"], e["error"]) for e in study.front(entries, "ms")], [(1, 0.5), (3, 0.1), (9, 0)])

    def test_the_cheapest_is_within_the_limit(self):
        entries = [dict(ms=1, error=math.inf), dict(ms=2, error=0.05), dict(ms=3, error=0.01)]
        self.assertEqual(study.cheapest(entries, "ms", 0.05)["ms"], 2)
        self.assertEqual(study.cheapest(entries, "ms", 0.049)["ms"], 3)
        self.assertIsNone(study.cheapest(entries, "ms", 0.001))

    def test_a_broad_phase_that_misses_a_pair_is_useless(self):
        rows = [dict(status="ok", extra_per_exact=0.0, missed=missed) for missed in (0.0, 1.0)]
        self.assertEqual([e["error"] for e in study.broad_entries(rows)], [0, math.inf])

    def test_the_error_of_a_heap_is_its_worst_part(self):
        reference = dict(study.PILE_SIZES["smoke"], **study.REFERENCE["smoke"], precision="double", stepping="serial",
                         seed=1.0, status="ok", wall_s_per_s=1.0, height_m=2.0, penetration_mm=1.0, energy_gain_falling=0.0,
                         energy_gain_rest=0.0, energy_drift_rest=-0.01, lost=0.0)
        other = dict(reference, dt=0.02, height_m=1.9, penetration_mm=81.0, energy_gain_falling=0.03,
                     energy_drift_rest=0.01)
        lossy = dict(reference, dt=0.03, lost=1.0)
        by_step = {e["dt"]: e for e in study.pile_errors([reference, other, lossy], "smoke")}
        self.assertEqual(by_step[study.REFERENCE["smoke"]["dt"]]["error"], 0)
        self.assertAlmostEqual(by_step[0.02]["height"], 0.05)
        self.assertAlmostEqual(by_step[0.02]["penetration"], 0.1)
        self.assertAlmostEqual(by_step[0.02]["energy gain"], 0.03)
        self.assertAlmostEqual(by_step[0.02]["energy drift"], 0.02)
        self.assertAlmostEqual(by_step[0.02]["error"], 0.1)
        self.assertEqual(by_step[0.03]["error"], math.inf)
        self.assertIn("useless", words.percent(by_step[0.03]["error"]))


if __name__ == "__main__":
    unittest.main(verbosity=2)
