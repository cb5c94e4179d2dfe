"""Tests what the study concludes from made-up rows, and which points it wants. Exit code 77: a package is missing."""

import os
import sys
import tempfile
import unittest
import zlib

sys.dont_write_bytecode = True  # nothing is left beside the sources

try:
    import numpy

    import outcomes
    import report
    import stats
    import study
    from study import BASE, EXACT, ITERATED, REFERENCES, Setting
    from table import Table
except ImportError as error:
    print("Skipped: %s (Debian: python3-numpy)" % error)
    sys.exit(77)


def row_of(height=0.0, cost=1.0, **others):
    row = dict(status="ok", took_s=1.0, cpu_s_per_s=cost, rests=1.0, stands=0.0, controlled=0.0, undriven=1.0, ignores="", rested=1.0, lost=0.0,
               collapsed=0.0, size_m=1.0, spread_m=1.0, height_m=height, top_drift_m=0.0, jitter=0.0, energy_gain=0.0,
               energy_drift=0.0, depth_mm=1.0, impact_mm=1.0, fastest_m_s=1.0, digest="", bodies_seen=40.0)
    return dict(row, **others)


class Made(unittest.TestCase):
    """Rows by a model: a function of the setting and the seed."""

    def study(self, model):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        made = study.Study("made", "Made", 40.0, ["false"], Table(os.path.join(folder.name, "scenes.csv"), study.KEY))
        made.table.write = lambda: None
        made.table.path = os.devnull
        made.model = model
        return made

    def measure(self, made, most=100000):
        """The points that were asked for, in their order, until no more are or so many."""
        asked = []
        while len(asked) < most:
            points = [(Setting(*(p[name] for name in Setting._fields)), p) for _, p in zip(range(24), made.wanted())]
            if not points:
                break
            for setting, point in {(setting, point["seed"]): (setting, point) for setting, point in points}.values():
                made.table.add(dict(point, **made.model(setting, point["seed"])))
                asked.append((setting, point["seed"]))
        return asked


def chance(*key):
    return numpy.random.default_rng(zlib.crc32(repr(key).encode())).exponential(1)


def by_step(per_second, noise=0.1, converged=True):
    """Errors as the step is long, costs as it is short; the reference is right, or has the same error."""
    def model(setting, seed):
        cost = 1e-3 * (30 + setting.iterations) / setting.dt
        right = setting in REFERENCES and converged
        off = 0 if right else per_second * setting.dt * (1 + noise * chance(setting, seed))
        return row_of(off, cost, digest="%r %r" % (setting, seed))
    return model


class Intervals(unittest.TestCase):
    def test_hold_the_mean_as_often_as_they_say(self):
        draws = dict(exponential=(lambda r, n: 0.05 * r.exponential(1, n), 0.05), uniform=(lambda r, n: r.uniform(0, 0.1, n), 0.05))
        for name, (draw, mean) in draws.items():
            for count in stats.LADDER[:3]:
                found = [stats.interval(tuple(v)) for v in draw(numpy.random.default_rng(7), (300, count))]
                self.assertGreater(sum(i.low <= mean <= i.high for i in found) / 300, 0.93, (name, count))
                self.assertLess(sum(i.high < mean for i in found) / 300, 0.05, (name, count))  # would name a false winner

    def test_one_failure_in_a_dozen_is_not_averaged_away(self):
        self.assertGreater(stats.interval((0.0,) * 11 + (1.0,)).high, 0.5)

    def test_need_to_be_whole_on_one_side(self):
        found = stats.Interval(0.04, 0.03, 0.05, 12)
        self.assertEqual([found.verdict(limit) for limit in (0.02, 0.04, 0.05)], ["beyond", "open", "within"])


class Errors(unittest.TestCase):
    def test_are_outcomes_without_the_impact(self):
        one = row_of(impact_mm=1.0, depth_mm=1.0)
        self.assertEqual(outcomes.error(row_of(impact_mm=170.0, depth_mm=9.0), one), 0)
        for name, value in dict(height_m=0.3, spread_m=1.3, jitter=0.3, energy_gain=0.3, observed_sag=0.3).items():
            self.assertAlmostEqual(outcomes.error(row_of(**{name: value}), dict(one, observed_sag=0.0) if name.startswith("ob")
                                                  else one), 0.3)

    def test_are_all_where_a_body_is_lost_unless_the_reference_loses_it(self):
        self.assertEqual(outcomes.error(row_of(lost=1.0), row_of()), 1)
        self.assertEqual(outcomes.error(row_of(lost=1.0), row_of(lost=1.0)), 0)

    def test_leave_out_what_the_scene_ignores(self):
        self.assertEqual(outcomes.error(row_of(0.3), row_of(ignores="height+jitter")), 0)

    def test_of_chance_alone_are_no_bias(self):
        pairs = [(row_of(0.1 * sign), row_of()) for sign in (1, -1)]
        self.assertAlmostEqual(outcomes.bias(pairs), 0)
        self.assertAlmostEqual(outcomes.bias([(row_of(0.1), row_of())] * 2), 0.1)


class Winners(Made):
    def test_that_are_planted_are_found_and_confirmed_with_fresh_seeds(self):
        made = self.study(by_step(1.0))  # 5 ms are off by 0.5 %
        self.measure(made)
        steps = [winner.setting.dt for winner in made.winners()]
        self.assertEqual([winner.why for winner in made.winners()], ["", "", ""])
        self.assertEqual(steps, [0.007, 0.04, 0.04])
        self.assertEqual({study.knobs_of(winner.setting) for winner in made.winners()}, {0})
        for winner in made.winners():
            self.assertEqual(winner.fresh.count, len(study.FRESH_SEEDS))

    def test_of_a_limit_are_within_every_wider_one(self):
        for slope in 0.5, 2.0, 8.0:
            made = self.study(by_step(slope, noise=1.0))
            named = []
            for _ in range(40):
                if not self.measure(made, 16):
                    break
                found, before = [w for w in made.winners() if not w.why], named
                named = [w.limit for w in found]
                self.assertEqual(named, list(study.LIMITS)[len(study.LIMITS) - len(named):], made.winners())
                self.assertLessEqual(set(before), set(named))  # who was certain stays so with a finer reference
                costs = [made.cost(w.setting) for w in found]
                self.assertEqual(costs, sorted(costs, reverse=True))

    def test_are_not_named_while_the_reference_is_biased(self):
        made = self.study(by_step(10.0, noise=0.0, converged=False))  # the finest halving still changes 0.62 %
        self.measure(made)
        self.assertEqual(made.level(), len(ITERATED) - 1)
        self.assertAlmostEqual(made.bias(made.level()), 10 * ITERATED[-1].dt, 4)
        self.assertIn("no converged reference: 0.625 ms, 100 iterations, at most 8 contacts may be off by 0.62 %. It takes",
                      made.winners()[0].why)
        self.assertEqual([w.why for w in made.winners()[1:]], ["", ""])
        self.assertLess(made.level_for(study.LIMITS[-1]), made.level())  # wide limits need no fine one

    def test_are_not_named_by_references_of_which_two_agree_by_chance(self):
        off = dict(zip(ITERATED, (0.3, 0.07, 0.07, 0.0, 0.0)))  # a robot whose 5 and 2.5 ms fall the same way
        made = self.study(lambda setting, seed: row_of(off.get(setting, 0.0)))
        self.measure(made)
        self.assertGreaterEqual(made.bias(2), 0.07)
        self.assertGreater(made.level_for(0.05), 2)

    def test_are_not_named_by_iterations_that_are_too_few_with_any_step(self):
        def model(setting, seed):  # a chain that sinks less with more iterations, and as much with all steps
            return row_of(30.0 / setting.iterations, 1e-3 * setting.iterations / setting.dt)
        made = self.study(model)
        self.measure(made)
        for winner in made.winners()[:2]:
            self.assertRegex(winner.why, "no converged reference: .* 100 iterations, .* may be off by 30 %")

    def test_of_few_bodies_are_measured_by_dWorldStep(self):
        def model(setting, seed):  # an arm that all iterations let drop, however small the step
            exact = setting.solver == "step"
            return row_of(0.2 * setting.dt if exact else 0.6 + 10 / setting.iterations, 1e-3 * (30 + 20 * exact) / setting.dt,
                          bodies_seen=7.0, undriven=0.0, digest="%r %r" % (setting, seed))
        made = self.study(model)
        asked = {setting for setting, _ in self.measure(made)}
        self.assertFalse(asked & {*ITERATED, *map(study.twice, ITERATED)})
        self.assertEqual([(w.setting, w.why) for w in made.winners()], [(BASE._replace(dt=0.04, solver="step"), "")] * 3)
        self.assertEqual({setting.sleep for setting in asked}, {"off"})  # something drives the arm

    def test_are_the_simplest_of_those_that_cost_as_much(self):
        def model(setting, seed):  # contacts and sleep save a little time, which is noise; ERP and CFM none
            cost = 1e-3 * (30 + setting.iterations) / setting.dt * (1 - 0.01 * study.knobs_of(study.work_alike(setting)))
            return row_of(0 if setting in REFERENCES else setting.dt, cost, digest="%r %r" % (setting, seed))
        made = self.study(model)
        asked = {setting for setting, _ in self.measure(made)}
        self.assertEqual({study.knobs_of(w.setting) for w in made.winners()}, {0})
        self.assertEqual({setting.sleep for setting in asked}, {"off", "on"})
        self.assertEqual({study.knobs_of(setting) for setting in asked - REFERENCES}, {0, 1})

    def test_are_not_made_by_noise(self):
        """All settings are just beyond the limit; the least of their means is far within."""
        def noise(setting, seed):
            return row_of(0 if setting in REFERENCES else 0.055 * chance(setting, seed, self.trial), digest="%r %r" % (setting, seed))
        named = lucky = 0
        for self.trial in range(100, 106):
            made = self.study(noise)
            self.measure(made, 1000)
            winner = made.winners()[1]
            named += not winner.why
            lucky += min(made.interval(s).mean for s in made.settings()) <= 0.05
        self.assertGreater(lucky, 3)
        self.assertLessEqual(named, 1)

    def test_that_differ_in_no_bit_are_one(self):
        def model(setting, seed):
            same = setting._replace(contacts=4)  # contacts a pair change nothing
            cost = 3.0 if setting.contacts == 4 and seed == 1 else 1.0
            return row_of(0 if setting in REFERENCES else 0.03, cost, digest="%r %r" % (same, seed))
        made = self.study(model)
        self.measure(made)
        self.assertEqual({s.contacts for s in made.settings()}, {4})
        self.assertEqual(made.one_of(BASE._replace(contacts=1)), BASE)
        self.assertEqual(made.cost(BASE), 1.0)  # the median over all rows of them all


class Points(Made):
    def test_are_coarse_first_and_never_asked_twice(self):
        made = self.study(by_step(1.0, noise=1.0))
        asked = self.measure(made)
        self.assertEqual(len(asked), len(set(asked)))
        grid = {Setting(dt, count) for dt in (0.02, 0.01, 0.005) for count in (10, 20)}
        coarse = 3 * len({*ITERATED[:3], *grid})
        self.assertEqual({setting for setting, _ in asked[:coarse]}, {*ITERATED[:3], *grid})
        self.assertEqual({seed for _, seed in asked[:coarse]}, {1, 2, 3})

    def test_of_any_number_give_an_answer(self):
        made = self.study(by_step(1.0, noise=1.0))
        for most in (0, 1, 5, 31, 40, 100):
            self.measure(made, most)
            text = report.answer([made])
            for limit in study.LIMITS:
                self.assertRegex(text, r"\| Made \|[^|]*\b%g\b" % (100 * limit))
            if made.settings():
                self.assertIn("| the reference |", report.table_of(made))
        self.assertIn("uncertain", text)

    def test_go_to_more_seeds_where_settings_compete(self):
        made = self.study(by_step(5.0, noise=1.0))
        self.measure(made)
        counts = {made.interval(setting).count for setting in made.settings()}
        self.assertLessEqual({3, 6}, counts)
        beyond = [s for s in made.settings() if made.interval(s).low > study.LIMITS[-1]]
        self.assertTrue(all(made.interval(s).count < 24 for s in beyond))


if __name__ == "__main__":
    unittest.main(verbosity=1)
