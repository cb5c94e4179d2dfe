"""Where the mean of few values is, with how much doubt. Nothing here knows what was measured."""

import functools
import statistics
from typing import NamedTuple

import numpy

LEVEL = 0.95  # of all that is said about one setting and one limit
RESAMPLES = 2000
LADDER = (3, 6, 12, 24)  # seeds at each look
# Who looks several times is misled more often: each look gets its part of what may go wrong.
LOOK = 1 - (1 - LEVEL) / len(LADDER)


class Interval(NamedTuple):
    mean: float
    low: float
    high: float
    count: int

    def verdict(self, limit):
        return "beyond" if self.low > limit else "within" if self.high <= limit else "open"


def student(freedom, level):
    """The quantile of Student's t; of two degrees of freedom exact, of more by Cornish and Fisher's expansion."""
    p = (1 + level) / 2
    if freedom == 2:
        return (2 * p - 1) / (2 * p * (1 - p)) ** 0.5
    z = statistics.NormalDist().inv_cdf(p)
    return z + (z ** 3 + z) / (4 * freedom) + (5 * z ** 5 + 16 * z ** 3 + 3 * z) / (96 * freedom ** 2) + (
        3 * z ** 7 + 19 * z ** 5 + 17 * z ** 3 - 15 * z) / (384 * freedom ** 3)


@functools.lru_cache(maxsize=None)
def interval(values, level=LOOK, most=1.0, least=0.0):
    """Of a tuple of values from `least` to `most`. Of three and six by Student's t. Of more by the bootstrap's t (Efron,
    Tibshirani: An Introduction to the Bootstrap, 12.5), which holds for skewed values as often as it says."""
    values = numpy.asarray(values, dtype=float)
    count, mean = len(values), float(numpy.mean(values))
    if count < 3:
        return Interval(mean, least, most, count)
    error = float(numpy.std(values, ddof=1) / numpy.sqrt(count))
    if count < LADDER[2]:
        half = error * student(count - 1, level)
        return Interval(mean, max(least, mean - half), min(most, mean + half), count)
    if error == 0:
        return Interval(mean, mean, mean, count)
    drawn = values[numpy.random.default_rng(count).integers(0, count, (RESAMPLES, count))]
    errors = numpy.std(drawn, axis=1, ddof=1) / numpy.sqrt(count)
    off = numpy.mean(drawn, axis=1) - mean
    # A resample without any spread says nothing of the error's size: off without bound, unless it is right.
    with numpy.errstate(divide="ignore", invalid="ignore"):
        t = numpy.sort(numpy.where(errors > 0, off / errors, numpy.where(off == 0, 0.0, numpy.sign(off) * numpy.inf)))
    tail = int(numpy.floor(RESAMPLES * (1 - level) / 2))
    # Failures among successes: few resamples lack either. To leave out what is beyond a limit, five errors are enough.
    low, high = mean - float(min(t[-1 - tail], 5.0) * error), mean - float(t[tail] * error)
    return Interval(mean, max(least, low), min(most, high), count)


def rate_at_most(count, level=LEVEL):
    """What never happened in so many runs happens in at most this share of all, with this confidence."""
    return 1 - (1 - level) ** (1 / count)
