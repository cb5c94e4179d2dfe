"""What a user sees of a run, and how far it is from the reference's: the parts of its error."""

import math

FAILURES = ("failed", "bodies lost", "collapsed", "never at rest")


def failures(row):
    """Which of the FAILURES a run has."""
    if row["status"] != "ok":
        return ("failed",)
    happened = (("bodies lost", row["lost"] > 0), ("collapsed", row["collapsed"] > 0),
                ("never at rest", row["rests"] > 0 and not row["rested"]))
    return tuple(name for name, is_so in happened if is_so)


def differences(row, reference):
    """The parts of the error with their signs, as shares. A scene says which do not matter in it."""
    def off(column, scale=1.0):
        return (row[column] - reference[column]) / scale

    parts = {"height": off("height_m", reference["spread_m"]), "spread": off("spread_m", reference["spread_m"])}
    if reference["rests"]:
        parts["jitter"] = off("jitter")
    if not reference["controlled"]:
        gain, drift = off("energy_gain"), off("energy_drift") if reference["rests"] else 0.0
        parts["energy"] = max(gain, drift, key=abs)
    if reference["stands"]:
        parts["drift"] = off("top_drift_m", reference["size_m"])
    for column in reference:
        if column.startswith("observed_") and reference[column] != "":  # else it is another scene's
            parts[column[len("observed_"):]] = off(column)
    ignored = str(reference["ignores"]).split("+")
    return {name: max(-1.0, min(1.0, value)) if math.isfinite(value) else 1.0 for name, value in parts.items()
            if name not in ignored}


def parts_of(row, reference):
    """All parts of a run's error. A failure is an error of 100 %, unless the reference fails so, too."""
    failed = {name: 1.0 for name in failures(row) if name not in failures(reference)}
    if row["status"] != "ok":
        return failed
    return dict({name: abs(value) for name, value in differences(row, reference).items()}, **failed)


def error(row, reference):
    """The largest of the parts: what a user would notice first."""
    return max(parts_of(row, reference).values(), default=0.0)


def bias(pairs):
    """How far one setting's runs are from another's on average, in the part in which they are furthest: chance, which has
    both signs, averages out. `pairs` are rows of the same seeds."""
    signed = [dict(differences(row, other), **{name: 1.0 for name in set(failures(row)) ^ set(failures(other))})
              if "ok" == row["status"] == other["status"] else {"failed": 1.0} for row, other in pairs]
    names = {name for parts in signed for name in parts}
    return max(abs(sum(parts.get(name, 0.0) for parts in signed)) / len(signed) for name in names) if names else 0.0
