"""Tests the statistics of the study on data whose answer is known. Exit code 77: a package is missing."""

import sys
import unittest

sys.dont_write_bytecode = True  # nothing is left beside the sources

try:
    import numpy

    import stats
except ImportError as error:
    print("Skipped: %s (Debian: python3-numpy)" % error)
    sys.exit(77)

PLAN = stats.Plan()
LIMITS = (0.01, 0.05, 0.2)
FAMILIES = {  # errors as a study has them: differences without sign, mostly small, some large; and their mean
    "normal without sign": (lambda rng, shape: 0.04 * numpy.abs(rng.standard_normal(shape)), 0.04 * (2 / numpy.pi) ** 0.5),
    "exponential": (lambda rng, shape: rng.exponential(0.03, shape), 0.03),
    "uniform": (lambda rng, shape: rng.uniform(0, 0.1, shape), 0.05),
    "shifted": (lambda rng, shape: numpy.abs(0.05 + 0.02 * rng.standard_normal(shape)), 0.0501),
}


def synthetic(means, seed):
    """A study of settings whose true mean errors these are, of costs 1, 2, ...: errors are exponential, a part of them
    common to all settings of a seed, as that of a reference is."""
    def errors(name, seeds):
        found = []
        for s in seeds:
            common = numpy.random.default_rng((seed, s)).exponential(1)
            own = numpy.random.default_rng((seed, s, name)).exponential(1)
            found.append(min(1.0, means[name] * (0.5 * common + 0.5 * own)))
        return found
    return lambda asked: [errors(name, seeds) for name, seeds in asked]


def decided(means, seed, limits=LIMITS):
    return stats.decide(list(range(len(means))), synthetic(means, seed), lambda name: name + 1, limits, PLAN)


class Intervals(unittest.TestCase):
    def test_hold_the_mean_as_often_as_they_say(self):
        trials = 400
        for name, (draw, mean) in FAMILIES.items():
            found = [stats.interval(v) for v in draw(numpy.random.default_rng(7), (trials, PLAN.first))]
            held = sum(i.low <= mean <= i.high for i in found) / trials
            too_good = sum(i.high < mean for i in found) / trials  # this is what would name a false winner
            self.assertGreater(held, 0.925, name)
            self.assertLess(too_good, 0.05, name)

    def test_get_shorter_with_more_seeds(self):
        values = numpy.random.default_rng(3).exponential(0.03, 96)
        lengths = [i.high - i.low for i in (stats.interval(values[:n]) for n in (6, 24, 96))]
        self.assertEqual(lengths, sorted(lengths, reverse=True))
        self.assertLess(lengths[2], 0.5 * lengths[0])

    def test_are_the_same_for_the_same_values(self):
        values = [0.01, 0.03, 0.02, 0.08]
        self.assertEqual(stats.interval(values), stats.interval(values))

    def test_one_seed_says_nothing_and_equal_ones_are_sure(self):
        self.assertEqual(stats.interval([0.01])[1:3], (0.0, 1.0))
        self.assertEqual(stats.interval([0.01] * 12)[:3], (0.01, 0.01, 0.01))

    def test_a_single_failure_is_not_averaged_away(self):
        self.assertGreater(stats.interval([0.0] * 11 + [1.0]).high, 0.5)

    def test_what_never_happened_may_still(self):
        self.assertAlmostEqual(stats.rate_at_most(12), 0.2209, 4)
        self.assertLess(stats.rate_at_most(24), 0.12)


class Verdicts(unittest.TestCase):
    def test_need_the_whole_interval(self):
        found = stats.Interval(0.04, 0.03, 0.05, 12)
        self.assertEqual([found.verdict(limit) for limit in (0.02, 0.03, 0.04, 0.05)], ["beyond", "open", "open", "within"])


class Seeds(unittest.TestCase):
    def counted(self, means, limits=LIMITS):
        asked = []
        measure = synthetic(means, 1)

        def watch(requests):
            asked.extend((name, s) for name, seeds in requests for s in seeds)
            return measure(requests)

        intervals = stats.explore(list(range(len(means))), watch, lambda name: name + 1, limits, PLAN)
        self.assertEqual(len(asked), len(set(asked)))  # no run twice
        return {name: found.count for name, found in intervals.items()}

    def test_stop_where_the_limit_is_clear(self):
        self.assertEqual(self.counted([0.4, 0.001], limits=(0.05,)), {0: PLAN.first, 1: PLAN.first})

    def test_stop_at_the_first_look_where_a_setting_cannot_win(self):
        plan = stats.Plan(first=6, least=12, more=6, most=24)
        fails, within, kept, open_at = 0, 1, 2, 3
        means = {fails: [1.0], within: [0.001, 0.002], kept: [0.7, 0.75, 0.8, 0.85, 0.9, 0.95], open_at: [0.01, 0.09]}

        def measure(requests):
            return [[means[name][s % len(means[name])] for s in seeds] for name, seeds in requests]
        intervals = stats.explore(list(means), measure, lambda name: 9 - name, (0.05,), plan, (kept,))
        self.assertEqual({name: found.count for name, found in intervals.items()},
                         {fails: plan.first, within: plan.least, kept: plan.least, open_at: plan.most})

    def test_that_are_few_say_beyond_but_not_within(self):
        found = stats.Interval(0.04, 0.03, 0.05, 6)
        self.assertEqual([found.verdict(limit, 12) for limit in (0.02, 0.04, 0.05)], ["beyond", "open", "open"])
        self.assertEqual(stats.candidates({0: found}, lambda name: 1, 0.05, stats.Plan()), [])

    def test_go_on_to_the_most_where_it_is_not(self):
        asked = []
        stats.explore([0], lambda requests: asked.extend(requests) or [[0.02 + 0.06 * (s % 2) for s in requests[0][1]]],
                      lambda name: 1, (0.05,), PLAN)
        self.assertEqual([s for _, seeds in asked for s in seeds], list(range(1, PLAN.most + 1)))

    def test_are_not_spent_on_what_is_beaten(self):
        self.assertEqual(self.counted([0.001, 0.05], limits=(0.05,)), {0: PLAN.first, 1: PLAN.first})

    def test_a_winner_is_confirmed_with_fresh_ones(self):
        asked = []
        measure = synthetic([0.001], 1)
        _, winners = stats.decide([0], lambda r: asked.extend(r) or measure(r), lambda name: 1, (0.05,), PLAN)
        self.assertEqual(winners[0].confirmed.count, PLAN.fresh)
        explored = set(s for _, seeds in asked[:-1] for s in seeds)
        self.assertFalse(explored & set(asked[-1][1]))


class Winners(unittest.TestCase):
    def test_noise_alone_names_none(self):
        # 100 settings, all just beyond the limit: the least of their means is far within.
        named = least_is_within = 0
        for seed in range(40):
            intervals, winners = decided([0.055] * 100, seed, (0.05,))
            least_is_within += min(found.mean for found in intervals.values()) <= 0.05
            named += winners[0].setting is not None
        self.assertGreater(least_is_within, 20)
        self.assertLessEqual(named, 2)

    def test_that_are_planted_are_found(self):
        found = 0
        for seed in range(20):
            means = [0.3] * 60
            means[20], means[40] = 0.02, 0.002
            _, winners = decided(means, seed)
            found += [w.setting for w in winners] == [40, 20, 20]
        self.assertGreaterEqual(found, 19)

    def test_fresh_seeds_refuse_luck(self):
        def lucky(requests):  # good with the seeds that choose, bad with others
            return [[0.001 * (1 + s % 3) if s < stats.FRESH_SEED else 0.3 for s in seeds] for _, seeds in requests]
        _, (winner,) = stats.decide([0, 1, 2, 3], lucky, lambda name: name, (0.05,), PLAN)
        self.assertIsNone(winner.setting)
        self.assertEqual([name for name, _ in winner.refused], [0, 1, 2])

    def test_the_cheapest_is_named(self):
        _, winners = decided([0.3, 0.001, 0.001, 0.3], 5)
        self.assertEqual([w.setting for w in winners], [1, 1, 1])

    def test_the_front_is_what_nothing_beats_in_both(self):
        intervals = {name: stats.Interval(mean, 0, 1, 12) for name, mean in zip("abcdef", (0.1, 0.5, 0.5, 0.2, 0, 0.6))}
        self.assertEqual(stats.front(intervals, dict(zip("abcdef", (3, 1, 2, 4, 9, 1)))), ["b", "a", "e"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
