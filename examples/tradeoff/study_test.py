"""Tests what the study concludes, from made-up rows and with its programs: study_test.py <tradeoff-point> <harness-test>."""

import csv
import math
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources

import study
from study import BASE, ITERATED, LIMITS, REFERENCES, Setting

HERE = os.path.dirname(os.path.abspath(__file__))


def row_of(height=0.0, cost=1.0, **others):
    return dict(dict(status="ok", took_s=1.0, ms_per_s=cost, undriven=1.0, outcome_height=height), **others)


def cost_of(setting):
    return 1e-3 * (30 + setting.iterations) / setting.dt


def chance(*key):
    return random.Random(repr(key)).expovariate(1)


def by_step(setting, seed):  # errors as the step is long, costs as it is short; the reference is right
    return row_of(0 if setting in REFERENCES else setting.dt * (1 + 0.1 * chance(setting, seed)), cost_of(setting))


def studied(model, most=10 ** 6, exact=False):
    """The study of what a model says of a setting and a seed, and the settings and seeds that it asked for in so many batches."""
    one, asked = study.Study(), []
    for _, points in zip(range(most), one.search()):
        for setting, seed in dict.fromkeys(points):
            if (setting, seed) not in one.rows:
                dear = dict(status="exit code -24", took_s=9.0) if setting.solver == "step" and not exact else None
                one.add(setting, seed, dear or model(setting, seed))
                asked.append((setting, seed))
    return one, asked


class Errors(unittest.TestCase):
    def test_are_rarely_above_what_is_said_at_most(self):
        draw = random.Random(7)
        for name, one in dict(exponential=lambda: draw.expovariate(20), uniform=lambda: draw.uniform(0, 0.1)).items():
            found = [study.at_most([one() for _ in study.FRESH], study.SURE) for _ in range(3000)]
            self.assertLess(sum(most < 0.05 for most in found) / 3000, 0.03, name)  # would name a false winner
        self.assertGreater(study.at_most([0.0] * 19 + [1.0], study.SURE), 0.2)  # a failure is not averaged away

    def test_are_the_largest_difference_and_all_where_a_run_fails(self):
        self.assertAlmostEqual(study.error(row_of(0.1, outcome_sag=0.4), row_of(0.2, outcome_sag=0.1)), 0.3)
        self.assertEqual(study.error(row_of(0.1), row_of(0.2, outcome_sag="")), 0.1)  # another scene's column
        for row in dict(status="exit code 1"), row_of(9.0), row_of(float("nan")):
            self.assertEqual(study.error(row, row_of()), 1)


class Answers(unittest.TestCase):
    def named(self, one):
        return [one.answers[limit].setting for limit in LIMITS]

    def test_that_are_planted_are_found_and_confirmed_with_fresh_seeds(self):
        one, asked = studied(by_step)  # 6.25 ms are off by 0.7 %
        self.assertEqual([(s.dt, study.knobs_of(s)) for s in self.named(one)], [(0.04, []), (0.04, []), (0.00625, [])])
        self.assertEqual([answer.why for answer in one.answers.values()], [""] * 3)
        self.assertLessEqual({(s, seed) for s in self.named(one) for seed in study.FRESH}, set(asked))

    def test_are_those_of_a_search_of_all(self):
        """Errors by any part of a setting, in no order: nothing that is cheaper and within a limit is passed over."""
        for trial in range(6):
            def off(setting):
                return 0 if setting in REFERENCES else 0.3 * chance(trial, setting) * setting.dt ** 0.5
            def cost(setting):
                return cost_of(setting) * (0.8 if setting.contacts == 1 else 1)
            one, _ = studied(lambda setting, seed: row_of(off(setting), cost(setting)))
            knobs = [{}] + [{name: value} for name, values in study.KNOBS.items() for value in values]
            every = [Setting(dt, count)._replace(**knob) for dt in study.STEPS for count in study.ITERATIONS for knob in knobs]
            for limit in LIMITS:
                within, setting = [s for s in every if off(s) <= limit], one.answers[limit].setting
                self.assertIn(setting, within)
                best = [s for s in within if cost(s) <= study.NOISE * min(map(cost, within))]
                self.assertIn(setting, best)
                self.assertEqual(len(study.knobs_of(setting)), min(len(study.knobs_of(s)) for s in best))

    def test_are_the_simplest_of_those_that_cost_as_much(self):
        def model(setting, seed):  # contacts and sleep save a little time, which is noise; more while the machine had less to do
            off = 0 if setting in REFERENCES else setting.dt * (1.01 if study.knobs_of(setting) else 1)
            saves = (0.3 if seed < 1000 else 0.05) * len(study.knobs_of(study.work_of(setting)))
            return row_of(off, cost_of(setting) * (1 - saves))
        one, asked = studied(model)
        self.assertEqual({s for s in self.named(one) if study.knobs_of(s)}, set())
        self.assertEqual({s.sleep for s, _ in asked}, {"off", "on"})
        self.assertEqual({len(study.knobs_of(s)) for s, _ in asked if s not in REFERENCES}, {0, 1})

    def test_are_no_knobs_that_change_nothing(self):
        def model(setting, seed):  # no contacts: their number is noise in the costs
            return row_of(0 if setting in REFERENCES else setting.dt, cost_of(setting) * (1 if setting.contacts == 4 else 0.6))
        self.assertEqual({s.contacts for s in self.named(studied(model)[0])}, {4})

    def test_are_not_made_by_noise(self):
        """All settings are just beyond the limit; the least of their means is far within."""
        def noise(setting, seed):
            return row_of(0 if setting in REFERENCES else 0.055 * chance(setting, seed, trial), cost_of(setting))
        answers = []
        for trial in range(6):
            answers.append(studied(noise)[0].answers[0.05].why)
        self.assertGreater(answers.count("fresh seeds refuse 5 that seemed to be within"), 4)

    def test_of_a_limit_are_some_of_every_wider_one(self):
        def model(setting, seed):  # long steps seem to be within the wide limit, until fresh seeds come
            return row_of(0 if setting in REFERENCES else 0.002 if setting.dt < 0.02 else 0.1 if seed < 1000 else 0.3, cost_of(setting))
        one, _ = studied(model)
        self.assertEqual(self.named(one), [BASE._replace(dt=0.0125, iterations=5)] * 3)

    def test_are_there_after_any_number_of_runs(self):
        for most in (0, 1, 3, 5, 9, 20):
            one, _ = studied(by_step, most)
            said = ", ".join(line.split(" | ")[1].rstrip(" %") for line in one.lines("Made"))
            self.assertEqual(sorted(said.split(", ")), ["1", "20", "5"])
            self.assertEqual(bool(one.trade()), bool(one.references) and most > 2)


class References(unittest.TestCase):
    def test_that_have_not_converged_answer_nothing(self):
        one, _ = studied(lambda setting, seed: row_of(10 * setting.dt, cost_of(setting)))  # the finest halving still changes 0.62 %
        self.assertIn("no converged reference: with 0.625 ms, 100 iterations it may be off by 0.6", one.answers[0.01].why)
        self.assertEqual([one.answers[limit].why for limit in (0.2, 0.05)], ["", ""])
        self.assertGreater(one.references[0.2].dt, one.references[0.05].dt)  # wide limits need no fine one

    def test_of_which_two_agree_by_chance_do_not_count(self):
        off = dict(zip([reference.dt for reference in ITERATED], (0.3, 0.07, 0.07, 0.0, 0.0)))  # 5 and 2.5 ms fall the same way
        one, _ = studied(lambda setting, seed: row_of(off.get(setting.dt, 0.0)))
        self.assertNotIn(0.05, one.references)
        self.assertIn("no converged reference: with 1.25 ms, 100 iterations single runs ", one.answers[0.05].why)

    def test_with_too_few_iterations_for_any_step_do_not_count(self):
        # A chain that sinks less with more iterations, and as much with all steps.
        one, _ = studied(lambda setting, seed: row_of(30.0 / setting.iterations, cost_of(setting)))
        self.assertIn("no converged reference: with 0.625 ms, 100 iterations it may be off by 15 %", one.answers[0.05].why)

    def test_use_dWorldStep_where_it_is_affordable(self):
        def model(setting, seed):  # an arm that all iterations let drop, however small the step
            off = 0.2 * setting.dt if setting.solver == "step" else 0.6 + 10 / setting.iterations
            return row_of(off, cost_of(setting), undriven=0.0)
        one, asked = studied(model, exact=True)
        self.assertEqual({setting.sleep for setting, _ in asked}, {"off"})  # something drives the arm
        self.assertFalse({s for s, _ in asked} & {*ITERATED[1:], *study.TWICE})
        self.assertEqual(list(one.answers.values())[1:], [one.answers[0.2]] * 2)
        self.assertEqual(one.answers[0.01][::2], (BASE._replace(dt=0.04, solver="step"), ""))

    def test_that_differ_by_chance_are_no_measure(self):
        one, asked = studied(lambda setting, seed: row_of(0.1 * (-1) ** (seed + round(math.log2(0.01 / setting.dt)))))
        why = "no converged reference: with 2.5 ms, 100 iterations single runs differ by 20 %"
        self.assertEqual([one.answers[limit].why for limit in (0.05, 0.01)], [why] * 2)
        self.assertNotIn(ITERATED[3], {setting for setting, _ in asked})


class Programs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def ends(self, code, *words, interrupt=False):  # what the study says, once it ends with this code
        child = subprocess.Popen([sys.executable, os.path.join(HERE, "tradeoff.py"), "--out", self.folder, *words],
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while interrupt and not os.path.exists(os.path.join(self.folder, "scenes.csv")):
            time.sleep(0.1)
        if interrupt:
            child.send_signal(signal.SIGINT)
        said = child.communicate()[0]
        self.assertEqual(child.returncode, code, said)
        return said

    def rows(self):
        with open(os.path.join(self.folder, "scenes.csv"), newline="") as file:
            return list(csv.DictReader(file))

    def test_have_an_answer_when_the_budget_is_spent_and_go_on_from_there(self):
        words = ("--program", point, "--scene", "tower", "--budget", "8")
        said = self.ends(75, *words)
        self.assertIn("| tower |", said[said.rindex("| scene |"):])
        first = self.rows()
        self.ends(75, *words)
        keys = {tuple(row[name] for name in ("scene", "seed", *Setting._fields)) for row in self.rows()}
        self.assertEqual(self.rows()[:len(first)], first)
        self.assertEqual(len(keys), len(self.rows()))
        self.assertGreater(len(keys), len(first))

    def test_answer_when_they_are_interrupted(self):
        said = self.ends(75, "--program", point, "--scene", "heap", interrupt=True)
        self.assertIn("| heap | 1, 5, 20 % | not known yet |", said)

    def test_are_studied_to_the_end(self):
        said = self.ends(0, "--program", own_program, "--budget", "200")
        self.assertRegex(said, r"\| harness-test \| [0-9, ]*20 % \| (40|25) ms, [^|()]*\|")
        self.assertTrue(all(row["scene"].startswith("harness-test-") for row in self.rows()))
        self.assertIn("outcome_time", self.rows()[0])
        with open(os.path.join(self.folder, "harness-test.svg")) as picture:
            self.assertIn("40 ms, ", picture.read())

    def test_complain_to_the_user(self):
        wrong = os.path.join(self.folder, "wrong")
        with open(wrong, "w") as file:
            file.write("#!/bin/sh\necho 'no such setting' >&2\nexit 2\n")
        os.chmod(wrong, 0o755)
        self.assertIn("no such setting", self.ends(1, "--program", wrong))

    def test_are_repeatable(self):
        words = [point, "heap", "--seed", "3", "--dt", "0.02"]
        one, other = (subprocess.run(words, stdout=subprocess.PIPE, text=True).stdout.splitlines() for _ in range(2))
        self.assertEqual(one[1:], other[1:])  # but for the time


if __name__ == "__main__":
    point, own_program = map(os.path.abspath, sys.argv[1:3])
    del sys.argv[1:3]
    unittest.main(verbosity=1)
