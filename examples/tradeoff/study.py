"""The points of the broad phase's study, and what their measurements say."""

import itertools
import math

OFFSETS = (0, 1e3, 1e6, 1e9)
LIMITS = (0.01, 0.05, 0.2)

# What names a point: the columns of its input.
BROAD_KEY = ("space", "backend", "threads", "precision", "tolerance", "offset", "step", "boxes", "frames")

# Boxes to a test of everything, in seconds; to three minutes; and to the study itself.
BROAD_SIZES = {"smoke": dict(boxes=300, frames=3, step=0.01), "quick": dict(boxes=3000, frames=20, step=0.01),
               "full": dict(boxes=20000, frames=20, step=0.01)}
TOLERANCES = {"smoke": (0, 0.1), "quick": (0, 0.03, 0.1, 0.3), "full": (0, 0.01, 0.03, 0.1, 0.3, 1)}


def broad_points(mode, precisions, has_cuda):
    points = []
    for offset, precision in itertools.product(OFFSETS, precisions):
        if (mode, offset, precision) == ("full", 1e9, "single"):
            continue  # floats are 64 m apart there: each of so many boxes would meet each other one
        common = dict(BROAD_SIZES[mode], offset=offset, precision=precision)
        backends = [("cpu", 1), ("cpu", 0)] + ([("cuda", 0)] if has_cuda else [])
        for (backend, threads), tolerance in itertools.product(backends, TOLERANCES[mode]):
            points.append(dict(common, space="parallel", backend=backend, threads=threads, tolerance=tolerance))
        for space in ("hash", "sap"):
            points.append(dict(common, space=space, backend="cpu", threads=1, tolerance=0))
    return points


def broad_seconds(point):
    """How long a point takes, about; dHashSpace 50 times as long as ours, and as dSweepAndPruneSpace far out."""
    frame = {"hash": 5e-5, "sap": 1e-5 if point["offset"] < 1e9 else 2e-4}.get(point["space"], 1e-6)
    return point["boxes"] * (2e-5 + point["frames"] * frame)


def key(row, columns):
    """A row's input, the same whether it was just made or read from a file."""
    return tuple("%.9g" % float(row[c]) if is_number(row[c]) else str(row[c]) for c in columns)


def is_number(value):
    try:
        float(value)
        return True
    except ValueError:
        return False


def finished(rows):
    return [row for row in rows if row["status"] == "ok"]


def broad_entries(rows):
    """The finished points with their error: extra pairs per exact pair; infinite where pairs are missed."""
    entries = []
    for row in finished(rows):
        entries.append(dict(row, error=row["extra_per_exact"] if row["missed"] == 0 else math.inf))
    return entries


def front(entries, cost):
    """Those that no other one beats in both cost and error, from the cheapest."""
    best, least = [], math.inf
    for entry in sorted(entries, key=lambda e: (e[cost], e["error"])):
        if entry["error"] < least:
            best.append(entry)
            least = entry["error"]
    return best


def cheapest(entries, cost, limit):
    """The cheapest entry whose error is at most the limit, or None."""
    return min((e for e in entries if e["error"] <= limit), key=lambda e: e[cost], default=None)


def space_name(entry):
    names = {"hash": "dHashSpace", "sap": "dSweepAndPruneSpace"}
    name = names.get(entry["space"])
    if not name:
        threads = "all threads" if entry["threads"] == 0 else "%d thread" % entry["threads"]
        name = "parallel-sap, " + ("GPU" if entry["backend"] == "cuda" else threads)
    return name + ", " + entry["precision"]
