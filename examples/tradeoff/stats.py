"""Statistics of the study: intervals of mean errors, when seeds are enough, and who has won.

An error is a share from 0 to 1, one for each seed; what is asked is whether its mean over all seeds there could be is
within a limit. Nothing here knows what was measured, so that made-up data can test it."""

import functools
from typing import NamedTuple

import numpy

LEVEL = 0.95  # of all that is said about one setting or one limit
RESAMPLES = 2000


class Interval(NamedTuple):
    mean: float
    low: float
    high: float
    count: int

    def verdict(self, limit, least=0):
        """Of fewer values than `least` nothing is said to be within."""
        if self.low > limit:
            return "beyond"
        return "within" if self.high <= limit and self.count >= least else "open"


def interval(values, level=LEVEL, most=1.0, least=0.0):
    """Where the mean is, by the bootstrap's t (Efron, Tibshirani: An Introduction to the Bootstrap, 12.5): of a dozen
    skewed values its intervals hold as often as they say, where those of plain percentiles are too short.
    The same values always get the same interval. Values are from `least` to `most`."""
    return interval_of(tuple(values), level, most, least)


@functools.lru_cache(maxsize=None)  # a study asks again after each row
def interval_of(values, level, most, least):
    values = numpy.asarray(values, dtype=float)
    count, mean = len(values), float(numpy.mean(values))
    if count < 2:
        return Interval(mean, least, most, count)
    if numpy.all(values == values[0]):
        return Interval(float(values[0]), float(values[0]), float(values[0]), count)
    error = numpy.std(values, ddof=1) / numpy.sqrt(count)
    drawn = values[numpy.random.default_rng(count).integers(0, count, (RESAMPLES, count))]
    errors = numpy.std(drawn, axis=1, ddof=1) / numpy.sqrt(count)
    off = numpy.mean(drawn, axis=1) - mean
    # A resample without any spread says nothing of the error's size: counted as off without bound, unless it is right.
    with numpy.errstate(divide="ignore", invalid="ignore"):
        t = numpy.where(errors > 0, off / errors, numpy.where(off == 0, 0.0, numpy.sign(off) * numpy.inf))
    t = numpy.sort(t)
    tail = int(numpy.floor(RESAMPLES * (1 - level) / 2))
    low, high = mean - float(t[-1 - tail] * error), mean - float(t[tail] * error)
    return Interval(mean, max(least, low), min(most, high), count)


def rate_at_most(count, level=LEVEL):
    """What never happened in so many runs happens in at most this share of all, with this confidence."""
    return 1 - (1 - level) ** (1 / count)


class Plan(NamedTuple):
    """How many seeds a setting gets: first so many, then some more at each look while a limit is open. What is beyond
    every limit at the first look, or dearer than something that is within, gets no more."""
    first: int = 12
    least: int = 12  # of whatever is said to be within a limit
    more: int = 6
    most: int = 24
    fresh: int = 24  # of a winner's confirmation, other seeds than these
    tries: int = 3   # so many candidates at most are put to it, for each limit

    def level(self):
        """Who looks several times is misled more often: each look gets its part of what may go wrong."""
        looks = 1 + -(-(self.most - self.first) // self.more)
        return 1 - (1 - LEVEL) / looks

    def confirmation_level(self):
        return 1 - (1 - LEVEL) / self.tries


FRESH_SEED = 1001  # the first of the fresh ones


class Winner(NamedTuple):
    """Of one limit. `setting` is None where none can be named; `refused` were candidates, with their fresh intervals."""
    limit: float
    setting: object
    confirmed: object
    refused: tuple


def open_limits(name, intervals, costs, limits, least=0):
    """The limits at which this setting is open, and nothing cheaper is within."""
    def cheaper_is_within(limit):
        return any(other.verdict(limit, least) == "within" and costs[n] < costs[name] for n, other in intervals.items())
    return [limit for limit in limits if intervals[name].verdict(limit, least) == "open" and not cheaper_is_within(limit)]


def explore(names, measure, cost, limits, plan, kept=()):
    """Intervals of all settings, with as many seeds each as it takes; of those `kept` with no fewer than the least.
    `measure` gets [(name, seeds)] and returns the errors of each; `cost` is that of a name, once it was measured."""
    errors = dict(zip(names, map(list, measure([(name, range(1, plan.first + 1)) for name in names]))))
    intervals = {name: interval(errors[name], plan.level()) for name in names}
    while True:
        costs = {name: cost(name) for name in names}
        wanted = [name for name in names if len(errors[name]) < plan.most and
                  ((name in kept and len(errors[name]) < plan.least) or
                   open_limits(name, intervals, costs, limits, plan.least))]
        if not wanted:
            return intervals
        asked = [(name, range(len(errors[name]) + 1, min(len(errors[name]) + plan.more, plan.most) + 1))
                 for name in wanted]
        for (name, _), found in zip(asked, measure(asked)):
            errors[name] += found
            intervals[name] = interval(errors[name], plan.level())


def candidates(intervals, cost, limit, plan):
    within = [name for name, found in intervals.items() if found.verdict(limit, plan.least) == "within"]
    return sorted(within, key=cost)[:plan.tries]


def fresh_seeds(plan):
    return range(FRESH_SEED, FRESH_SEED + plan.fresh)


def confirm(intervals, measure, cost, limit, plan, known):
    """The cheapest setting whose interval clears the limit, and does so again with seeds that did not choose it.
    `known` are errors of such seeds, by name."""
    refused = []
    for name in candidates(intervals, cost, limit, plan):
        errors = known[name] if name in known else measure([(name, fresh_seeds(plan))])[0]
        fresh = interval(errors, plan.confirmation_level())
        if fresh.high <= limit:
            return Winner(limit, name, fresh, tuple(refused))
        refused.append((name, fresh))
    return Winner(limit, None, None, tuple(refused))


def decide(names, measure, cost, limits, plan, kept=()):
    """Returns the intervals by name, and a Winner for each limit."""
    intervals = explore(names, measure, cost, limits, plan, kept)
    # Asked for in one go, so that the first candidates of all limits can be measured side by side.
    first = list(dict.fromkeys(name for limit in limits for name in candidates(intervals, cost, limit, plan)[:1]))
    known = dict(zip(first, measure([(name, fresh_seeds(plan)) for name in first]))) if first else {}
    return intervals, [confirm(intervals, measure, cost, limit, plan, known) for limit in limits]


def front(intervals, costs):
    """The names that no other one beats in both cost and mean error, from the cheapest."""
    best, least = [], float("inf")
    for name in sorted(intervals, key=lambda n: (costs[n], intervals[n].mean)):
        if intervals[name].mean < least:
            best.append(name)
            least = intervals[name].mean
    return best
