"""Tests the trade-off study: smoke_test.py <tradeoff-point> <own-scene>. Exit code 77: a package is missing."""

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

    import outcomes
    import settings
    import study
    import table
    import traced
    import words
except ImportError as error:
    print("Skipped: %s (Debian: python3-matplotlib python3-tqdm)" % error)
    sys.exit(77)

program, own_scene = sys.argv.pop(1), sys.argv.pop(1)


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


def script(folder, name, *lines):
    """An executable of the shell in the folder."""
    path = os.path.join(folder, name)
    with open(path, "w") as file:
        file.write("\n".join(("#!/bin/sh",) + lines) + "\n")
    os.chmod(path, 0o755)
    return path


def before_the_program(folder, line):
    """A script that runs this line and then is the program."""
    return script(folder, "instead", line, "exec %s \"$@\"" % program)


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
        cls.broad, cls.scenes = read(cls.folder.name, "broad"), read(cls.folder.name, "scenes")
        cls.choices = choices(cls.folder.name)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_says_that_single_precision_is_left_out(self):
        self.assertIn("Single precision is left out: there is no", self.output)
        self.assertEqual({row["precision"] for row in self.broad + self.scenes}, {"double"})

    def test_measures_every_point_once(self):
        has_cuda = any(row["backend"] == "cuda" for row in self.broad)
        points = study.broad_points("smoke", ["double"], has_cuda)
        self.assertEqual(sorted(study.key(row, study.BROAD_KEY) for row in self.broad),
                         sorted(study.key(point, study.BROAD_KEY) for point in points))
        keys = [study.key(row, settings.KEY) for row in self.scenes]
        self.assertEqual(len(keys), len(set(keys)))
        wanted = {settings.Setting(*(type(default)(float(row[name])) if isinstance(default, (int, float)) else row[name]
                                     for name, default in settings.BASE._asdict().items())) for row in self.scenes}
        bodies = settings.SCENES["smoke"]["tower"]
        self.assertEqual(wanted, {*settings.settings_of("smoke", ["double"], bodies), *settings.REFERENCE["smoke"]})

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

    def test_every_setting_has_seeds_enough_and_its_reference_the_same(self):
        plan, seeds = settings.PLANS["smoke"], {}
        for row in self.scenes:
            self.assertEqual(row["status"], "ok")
            setting = tuple(row[name] for name in settings.Setting._fields)
            seeds.setdefault(setting, set()).add(int(float(row["seed"])))
        for found in seeds.values():
            self.assertLessEqual(set(range(1, plan.first + 1)), found)
        references = [found for setting, found in seeds.items() if setting[1] == "30"]
        self.assertEqual(len(references), 2)
        for found in references:
            self.assertEqual(found, set.union(*seeds.values()))

    def test_no_momentum_comes_from_nowhere(self):
        for row in self.scenes:
            self.assertLess(float(row["momentum_drift"]), 1e-12)
            self.assertLess(float(row["angular_drift"]), 1e-3)

    def test_scenes_have_the_density_they_say(self):
        for row in self.scenes:
            self.assertEqual(float(row["density"]), 1000)
        # Contacts that give, give more under more weight.
        deep = [point("scene", "--scene", "tower", "--bodies", "5", "--cfm", "1e-5", "--density", density)["penetration_mm"]
                for density in ("1", "1000")]
        self.assertGreater(float(deep[1]), 5 * float(deep[0]))

    def test_an_interrupted_run_goes_on_where_it_was(self):
        path = os.path.join(self.folder.name, "broad.csv")
        with open(path) as file:
            whole = file.read()
        with open(path, "w") as file:
            file.write(whole[:-60])  # the last row is cut short
        output = run_study(self.folder.name)
        self.assertIn("broad: 1 point to measure, one at a time", output)
        self.assertNotIn("points to measure", output)
        self.assertEqual(len(read(self.folder.name, "broad")), len(self.broad))
        self.assertEqual(read(self.folder.name, "scenes"), self.scenes)

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
            self.assertEqual(os.listdir(folder).count("scenes.csv"), 0)

    def test_several_points_at_once_have_each_its_share_of_the_cores(self):
        count = len(os.sched_getaffinity(0))
        with tempfile.TemporaryDirectory() as folder:
            log = os.path.join(folder, "log")  # of the cores that the program may use
            told = before_the_program(folder, "echo \"$* $(grep Cpus_allowed_list /proc/self/status)\" >>" + log)
            run_study(folder, "--only", "scenes", "--double", told)
            scenes = read(folder, "scenes")
            with open(log) as file:
                cores = [re.match(r"scene .*:\s*(\S+)$", line).group(1) for line in file if line.startswith("scene")]
        self.assertEqual(len(cores), len(scenes))
        self.assertEqual(set(cores), {str(core) for core in os.sched_getaffinity(0)})
        self.assertEqual({row["cores"] for row in scenes}, {"1"})

        def places(rows):  # seeds beyond the first depend on times, by which settings are beaten
            return {study.key(row, settings.KEY): row["height_m"] for row in rows if float(row["seed"]) <= 4}

        self.assertEqual(places(scenes), places(self.scenes))

    def test_reports_on_rows_of_another_machine_but_measures_none(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, rows in ("broad", self.broad), ("scenes", self.scenes):
                with open(os.path.join(folder, name + ".csv"), "w", newline="") as file:
                    writer = csv.DictWriter(file, rows[0], lineterminator="\n")
                    writer.writeheader()
                    writer.writerows(dict(row, cpu="another", cores="77") for row in reversed(rows))
            result = call("--out", folder, "--report")
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertEqual(choices(folder).count("another, 77 cores"), 2)
            machine = re.compile(r" [^,]*, (one core a point|\d+ cores), .*")
            self.assertEqual(machine.sub("", choices(folder)), machine.sub("", self.choices))
            self.assertIn("rows of another machine", call("--out", folder, "--double", program).stdout)

            path = os.path.join(folder, "scenes.csv")
            with open(path) as file:
                header, _, *others = file.readlines()
            with open(path, "w") as file:
                file.writelines([header, *others])
            said = call("--out", folder, "--report").stdout
            self.assertRegex(said, r"scenes\.csv lacks tower: 1 of \d+ points\. Without --report it is measured")
            os.remove(path)
            self.assertIn("scenes.csv lacks", call("--out", folder, "--report").stdout)

    def test_puts_the_advice_between_the_marks_of_a_document(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in "broad.csv", "scenes.csv":
                shutil.copy(os.path.join(self.folder.name, name), folder)
            document = os.path.join(folder, "document.md")
            with open(document, "w") as file:
                file.write("before\n<!-- tradeoff -->\nold\n<!-- end -->\nafter\n")
            self.assertEqual(call("--out", folder, "--report", "--write", document).returncode, 0)
            with open(document) as file:
                text = file.read()
            self.assertRegex(text, r"(?s)^before\n<!-- tradeoff -->\n\nBroad phase, .*\nTower of 3 bodies.*\n<!-- end -->\nafter\n$")
            self.assertNotIn("\nold\n", text)
            self.assertNotIn("|", text)  # the tables are in choices.md
            self.assertIn("| the reference |", choices(folder))

    def test_the_columns_are_those_that_the_readme_explains(self):
        with open(README) as file:
            text = file.read()
        for rows, key, part in ((self.broad, study.BROAD_KEY, r"## The broad phase.*## The scenes"),
                                (self.scenes, settings.KEY, r"## The scenes.*## What a setting")):
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
        for name in ("broad", "tower"):
            picture = imread(os.path.join(self.folder.name, name + ".png"))
            coloured = (picture[:, :, :3].max(axis=2) - picture[:, :, :3].min(axis=2)) > 0.3
            self.assertGreater(coloured.sum(), 100, name)

    def test_says_what_to_choose(self):
        for words_wanted in ("1e+09 m from the origin", "no extra pair: parallel-sap", "within 1 %", "within 20 %",
                             "dSweepAndPruneSpace", "reference is off", "One thing changed", "never at rest", "at most"):
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

    def test_nothing_is_left_beside_them(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in os.listdir(HERE):
                if name.endswith(".py"):
                    shutil.copy(os.path.join(HERE, name), folder)
            before = sorted(os.listdir(folder))
            for command in ("tradeoff.py", "--help"), ("smoke_test.py", program, own_scene, "Analysis"):
                result = output_of(sys.executable, os.path.join(folder, command[0]), *command[1:],
                                   PYTHONDONTWRITEBYTECODE="", PYTHONPYCACHEPREFIX="")
                self.assertEqual(result.returncode, 0, result.stdout)
            self.assertEqual(sorted(os.listdir(folder)), before)

    def test_help_neither_installs_nor_builds_and_needs_no_package(self):
        with tempfile.TemporaryDirectory() as folder:
            called = os.path.join(folder, "called")
            for name in ("apt-get", "cmake", "sudo"):
                script(folder, name, "echo %s >>%s" % (name, called), "exit 1")
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

    ROW = dict(status="ok", size_m=0.8, spread_m=4.0, height_m=2.0, largest_mm=1.0, largest_falling_mm=2.0, jitter=0.01,
               energy_gain=0.0, energy_drift=-0.01, momentum_drift=0.0, angular_drift=0.0, top_drift_m=0.0, lost=0.0,
               collapsed=0.0, rested=1.0)
    KIND = outcomes.Kind(rests=True, stands=True, controlled=False)

    def error(self, reference=ROW, kind=KIND, **changed):
        return outcomes.error(dict(self.ROW, **changed), [self.ROW, reference], kind)

    def test_the_error_of_a_run_is_its_worst_part(self):
        self.assertEqual(self.error(), 0)
        for changed, share in (dict(height_m=1.8), 0.05), (dict(largest_mm=41.0), 0.05), (dict(largest_falling_mm=82), 0.1), \
                (dict(jitter=0.06), 0.05), (dict(energy_gain=0.02), 0.02), (dict(energy_drift=0.03), 0.04), \
                (dict(momentum_drift=0.01), 0.01), (dict(angular_drift=0.02), 0.02), (dict(top_drift_m=0.08), 0.1), \
                (dict(height_m=1.8, jitter=0.02), 0.05), (dict(height_m=math.nan), 1):
            self.assertAlmostEqual(self.error(**changed), share, msg=changed)

    def test_a_failure_is_an_error_of_all_unless_the_reference_fails_so(self):
        for failed in dict(lost=1.0), dict(collapsed=1.0), dict(rested=0.0):
            self.assertEqual(self.error(**failed), 1)
            self.assertEqual(self.error(reference=dict(self.ROW, **failed), **failed), 0)
        self.assertEqual(self.error(status="exit code 1"), 1)

    def test_differences_of_either_sign_do_not_cancel(self):
        # A mean that is right says nothing where each run is wrong.
        self.assertGreater(sum(self.error(height_m=h) for h in (1.8, 2.2)), 0.09)

    def test_a_driven_scene_may_gain_energy_and_need_not_rest(self):
        kind = outcomes.Kind(rests=False, stands=False, controlled=True)
        self.assertEqual(self.error(kind=kind, energy_gain=1.0, rested=0.0, jitter=0.5), 0)
        self.assertEqual(self.error(energy_gain=1.0), 1)

    def test_what_a_program_observes_is_a_part(self):
        row = dict(self.ROW, observed_sag=0.3)
        self.assertAlmostEqual(outcomes.error(dict(row, observed_sag=0.4), [row], self.KIND), 0.1)


class OwnScene(unittest.TestCase):
    """The study of a program that is not ours."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.output = run_study(cls.folder.name, "--program", own_scene)
        cls.rows = read(cls.folder.name, "scenes")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_is_measured_and_named_for_each_accuracy(self):
        self.assertEqual({row["status"] for row in self.rows}, {"ok"})
        self.assertRegex(self.rows[0]["scene"], "^own-scene-[0-9a-f]{10}$")
        text = choices(self.folder.name)
        for limit in settings.LIMITS:
            self.assertEqual(text.count("- within %g %%: " % (100 * limit)), 1)
        self.assertTrue(os.path.exists(os.path.join(self.folder.name, self.rows[0]["scene"] + ".png")))

    def test_sees_what_it_observes_and_drives(self):
        ways = [float(row["observed_way"]) for row in self.rows]
        self.assertGreater(min(ways), 0.25)  # it starts at 0.19 of the bridge
        self.assertLess(max(ways), 1)
        self.assertEqual({row["controlled"] for row in self.rows}, {"1"})
        self.assertEqual({row["rests"] for row in self.rows}, {"0"})

    def test_goes_on_where_it_was(self):
        output = run_study(self.folder.name, "--program", own_scene)
        self.assertNotIn("points to measure", output)
        self.assertEqual(read(self.folder.name, "scenes"), self.rows)

    def test_refuses_what_was_not_made_with_the_harness(self):
        said = call("--program", "/bin/true", "--out", self.folder.name).stdout
        self.assertIn("Its main is to end with tradeoff::run", said)
        self.assertEqual(output_of(own_scene, "--dt", "fast").stdout.count("--dt: no number: fast"), 1)
        self.assertEqual(output_of(own_scene, "--speed", "1").returncode, 2)

    def test_is_the_program_that_the_readme_shows_and_short(self):
        with open(os.path.join(HERE, "own_scene.cpp")) as file:
            code = [line for line in file if line.strip() and not line.strip().startswith("//")]
        self.assertLessEqual(len(code), 60)


class Elsewhere(unittest.TestCase):
    def test_the_commit_of_programs_from_elsewhere_is_said(self):
        with tempfile.TemporaryDirectory() as folder:
            call("--only", "scenes", "--out", folder, "--double", program, "--single", "/nowhere", "--seconds", "1",
                 TRADEOFF_COMMIT="0123456789")
            self.assertEqual({row["commit"] for row in read(folder, "scenes")}, {"0123456789"})


class Rows(unittest.TestCase):
    """One table for scenes that observe different things."""

    def test_a_column_of_one_scene_is_empty_in_the_others(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "scenes.csv")
            table.Table(path, ("scene",), 1).add(dict(scene="heap", status="ok", height_m="1"), ["height_m"])
            grown = table.Table(path, ("scene",), 1)
            grown.add(dict(scene="vehicle", status="ok", height_m="2", observed_way="3"), ["height_m", "observed_way"])
            grown.add(dict(scene="heap2", status="ok", height_m="1"), ["height_m"])
            rows = table.Table(path, ("scene",), 1).rows
            self.assertEqual([row["observed_way"] for row in rows], ["", 3, ""])
            self.assertEqual([row["height_m"] for row in rows], [1, 2, 1])
            self.assertEqual(len({row["commit"] for row in rows}), 1)
            with self.assertRaises(SystemExit):
                grown.add(dict(scene="heap3", status="ok", width_m="1"), ["width_m"])

    def test_what_another_scene_observes_is_no_part_of_an_error(self):
        row = dict(Analysis.ROW, observed_way="")
        self.assertEqual(outcomes.error(row, [row], Analysis.KIND), 0)

    def test_a_setting_that_always_fails_is_in_the_tables(self):
        with tempfile.TemporaryDirectory() as folder:
            fails = before_the_program(folder, "case \"$*\" in *'--contacts 1 '*) exit 3;; esac")
            run_study(folder, "--only", "scenes", "--double", fails)
            self.assertIn("1 contact a pair", choices(folder))
            self.assertRegex(choices(folder), r"\| failed \|")


class Harness(unittest.TestCase):
    def test_settings_change_what_they_say(self):
        base = point("scene", "--scene", "tower", "--bodies", "4")
        for option, value in ("dt", "0.02"), ("iterations", "5"), ("contacts", "2"), ("erp", "0.5"), ("cfm", "1e-6"), \
                ("sor", "1"), ("solver", "step"), ("seed", "2"):
            other = point("scene", "--scene", "tower", "--bodies", "4", "--" + option, value)
            self.assertNotEqual(other["penetration_mm"], base["penetration_mm"], option)
        for value in "deepest", "spread":
            reduced = point("scene", "--scene", "heap", "--bodies", "6", "--reducer", value, "--contacts", "2")
            self.assertNotEqual(reduced["height_m"],
                                point("scene", "--scene", "heap", "--bodies", "6", "--contacts", "2")["height_m"], value)
        self.assertEqual(float(point("scene", "--scene", "tower", "--bodies", "4", "--iterations", "100", "--sleep", "on")["asleep"]), 1)
        self.assertEqual(base["asleep"], "0")

    def test_what_the_space_leaves_out_or_adds_is_the_pairs_not_the_motion(self):
        heap = ("scene", "--scene", "heap", "--bodies", "150", "--seconds", "1.5")  # fewer take no notice of a tolerance
        base = point(*heap)
        for options, sign in (("--skip", "static"), -1), (("--skip", "all"), -1), (("--tolerance", "1"), 1):
            other = point(*heap, *options)
            self.assertEqual(other["height_m"], base["height_m"], options)
            self.assertGreater(sign * (float(other["pairs_a_step"]) - float(base["pairs_a_step"])), 0, options)

    def test_scenes_are_sound_with_fine_steps_and_not_with_coarse_ones(self):
        for scene, bodies in ("heap", "8"), ("wall", "9"), ("tower", "8"), ("hopper", "8"), ("vehicle", "10"), ("meshes", "8"):
            fine = point("scene", "--scene", scene, "--bodies", bodies, "--dt", "0.004", "--iterations", "60", "--contacts", "8")
            self.assertEqual([fine[c] for c in ("rested", "lost", "collapsed")], ["1", "0", "0"], scene)
        coarse = point("scene", "--scene", "tower", "--bodies", "20", "--dt", "0.04", "--iterations", "2")
        self.assertEqual(coarse["collapsed"], "1")
        lost = point("scene", "--scene", "hopper", "--bodies", "8", "--dt", "0.3", "--seconds", "6")
        self.assertNotEqual(lost["lost"], "0")
        lost = point("scene", "--scene", "meshes", "--bodies", "8", "--dt", "0.2", "--seconds", "6")
        self.assertNotEqual(lost["lost"], "0")

    def test_vehicles_drive_their_way_over_bumps_and_stand(self):
        rows = [point("scene", "--scene", "vehicle", "--bodies", "10", "--dt", dt, "--seed", "3", "--iterations", "50")
                for dt in ("0.004", "0.002")]
        for row in rows:
            self.assertEqual(row["bodies_seen"], "10")
            self.assertGreater(float(row["largest_falling_mm"]), 0.5)  # the bumps
            for number in "12":
                self.assertGreater(1.6 * float(row["observed_way_" + number]), 10)  # metres: 3 m/s for 4 s, but for the start
                self.assertLess(1.6 * float(row["observed_way_" + number]), 12)
        self.assertNotEqual(rows[0]["observed_way_1"], rows[0]["observed_way_2"])
        # Springs are the same whatever the step, or chassis would stand at other heights.
        self.assertAlmostEqual(float(rows[0]["height_m"]), float(rows[1]["height_m"]), delta=0.001)


def point(*arguments):
    result = subprocess.run([program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    names, values = result.stdout.splitlines()
    return dict(zip(names.split(","), values.split(",")))


if __name__ == "__main__":
    unittest.main(verbosity=2)
