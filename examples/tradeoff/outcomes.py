"""What users see of a run, and how far it is from the reference's: the parts of its error."""

import math
from typing import NamedTuple


class Kind(NamedTuple):
    """What a scene says of itself: whether it should come to rest, whether it should stay up, whether it is driven."""
    rests: bool
    stands: bool
    controlled: bool


def kind_of(row):
    return Kind(*(row[name] > 0 for name in Kind._fields))


FAILURES = ("failed", "lost", "collapsed", "never at rest")


def mean(rows, column):
    return sum(row[column] for row in rows) / len(rows)


def failures(row, kind):
    """Which of the FAILURES a run has."""
    if row["status"] != "ok":
        return ("failed",)
    happened = (("lost", row["lost"] > 0), ("collapsed", row["collapsed"] > 0),
                ("never at rest", kind.rests and not row["rested"]))
    return tuple(name for name, is_so in happened if is_so)


def differences(row, reference, kind):
    """The parts of the error that are measured, as shares, by name, against the mean of the reference's runs."""
    size = mean(reference, "size_m")

    def off(column):
        return abs(row[column] - mean(reference, column))

    parts = {"height": off("height_m") / mean(reference, "spread_m"), "worst penetration": off("largest_mm") / (1000 * size),
             "worst impact": off("largest_falling_mm") / (1000 * size),
             "momentum": max(off("momentum_drift"), off("angular_drift"))}
    if kind.rests:
        parts["jitter"] = off("jitter")
        parts["energy drift"] = off("energy_drift")
    if not kind.controlled:
        parts["energy gain"] = off("energy_gain")
    if kind.stands:
        parts["drift of the top"] = off("top_drift_m") / size
    for column in row:
        if column.startswith("observed_") and row[column] != "":  # else it is another scene's
            parts[column[len("observed_"):]] = off(column)
    return {name: min(1.0, value) if math.isfinite(value) else 1.0 for name, value in parts.items()}


def parts_of(row, reference, kind):
    """All parts of a run's error. A failure is an error of 100 %, unless the reference fails so, too."""
    excused = {name for other in reference for name in failures(other, kind)}
    parts = {name: 1.0 for name in failures(row, kind) if name not in excused}
    return parts if row["status"] != "ok" else dict(differences(row, reference, kind), **parts)


def error(row, reference, kind):
    """The largest of the parts: what a user would notice first."""
    return max(parts_of(row, reference, kind).values())
