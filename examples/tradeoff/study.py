"""The points of the trade-off study, and what their measurements say."""

import itertools
import math
from statistics import mean

OFFSETS = (0, 1e3, 1e6, 1e9)
LIMITS = (0.01, 0.05, 0.2)

# What names a point: the columns of its input.
BROAD_KEY = ("space", "backend", "threads", "precision", "tolerance", "offset", "step", "boxes", "frames")
PILE_KEY = ("dt", "iterations", "contacts", "precision", "stepping", "bodies", "seconds", "rest_seconds", "seed")

# Boxes to a test of everything, in seconds; to two minutes; and to the study itself.
BROAD_SIZES = {"smoke": dict(boxes=300, frames=3, step=0.01), "quick": dict(boxes=5000, frames=20, step=0.01),
               "full": dict(boxes=50000, frames=40, step=0.01)}
TOLERANCES = {"smoke": (0, 0.1), "quick": (0, 0.03, 0.1, 0.3), "full": (0, 0.01, 0.03, 0.1, 0.3, 1)}

PILE_SIZES = {"smoke": dict(bodies=8, seconds=1.0, rest_seconds=0.3),
              "quick": dict(bodies=60, seconds=5.0, rest_seconds=1.5),
              "full": dict(bodies=200, seconds=8.0, rest_seconds=2.0)}
PILE_GRID = {"smoke": dict(dt=(0.02,), iterations=(5, 20), contacts=(4,)),
             "quick": dict(dt=(0.02, 0.01, 0.005), iterations=(5, 20, 50), contacts=(1, 4)),
             "full": dict(dt=(0.02, 0.01, 0.005, 0.0025), iterations=(5, 10, 20, 50), contacts=(1, 2, 4, 8))}
SEEDS = {"smoke": (1,), "quick": (1, 2), "full": (1, 2, 3)}
# In double precision, on one core. The control differs from the reference in its step alone: by
# as much as it is off, the study cannot tell settings apart.
REFERENCE = {"smoke": dict(dt=0.01, iterations=30, contacts=4), "quick": dict(dt=0.001, iterations=50, contacts=8),
             "full": dict(dt=0.001, iterations=100, contacts=8)}
CONTROL_STEP = 0.8


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


def reference_points(mode):
    """The reference and its control, a point a seed."""
    settings = REFERENCE[mode]
    common = dict(PILE_SIZES[mode], precision="double", stepping="serial", iterations=settings["iterations"],
                  contacts=settings["contacts"])
    return [dict(common, dt=dt, seed=seed) for dt in (settings["dt"], control_dt(mode)) for seed in SEEDS[mode]]


def control_dt(mode):
    return float("%.6g" % (CONTROL_STEP * REFERENCE[mode]["dt"]))


def pile_points(mode, precisions):
    grid = PILE_GRID[mode]
    points = reference_points(mode)
    for dt, iterations, contacts, precision, stepping, seed in itertools.product(
            grid["dt"], grid["iterations"], grid["contacts"], precisions, ("serial", "parallel"), SEEDS[mode]):
        points.append(dict(PILE_SIZES[mode], dt=dt, iterations=iterations, contacts=contacts, precision=precision,
                           stepping=stepping, seed=seed))
    return points


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


PARTS = ("height", "penetration", "energy gain", "energy drift")


def pile_errors(rows, mode):
    """One entry for each setting that was run with all seeds: the means of its rows, the four parts of
    its error against the reference, and the largest of them as its error."""
    body_size_mm = 800
    names = ("dt", "iterations", "contacts", "precision", "stepping")
    runs = {}
    for row in finished(rows):
        runs.setdefault(tuple(row[n] for n in names), {})[int(row["seed"])] = row
    settings = REFERENCE[mode]
    reference = runs.get((settings["dt"], settings["iterations"], settings["contacts"], "double", "serial"), {})
    entries = []
    for setting, by_seed in runs.items():
        if set(by_seed) != set(SEEDS[mode]) or set(reference) != set(SEEDS[mode]):
            continue
        pairs = [(by_seed[seed], reference[seed]) for seed in SEEDS[mode]]

        def off(column):
            return mean(a[column] - b[column] for a, b in pairs)

        entry = dict(zip(names, setting))
        for column in pairs[0][0]:
            if column not in names and isinstance(pairs[0][0][column], float):
                entry[column] = mean(a[column] for a, _ in pairs)
        # The seeds are equally much work, and what else the machine does only adds time.
        entry["wall_s_per_s"] = min(a["wall_s_per_s"] for a, _ in pairs)
        entry["height"] = abs(off("height_m")) / mean(b["height_m"] for _, b in pairs)
        entry["penetration"] = abs(off("penetration_mm")) / body_size_mm
        entry["energy gain"] = entry["energy_gain_falling"] + entry["energy_gain_rest"]
        entry["energy drift"] = abs(off("energy_drift_rest"))
        entry["error"] = max(entry[part] for part in PARTS) if entry["lost"] == 0 else math.inf
        entries.append(entry)
    return entries


def is_reference(entry, mode):
    settings = REFERENCE[mode]
    return entry["iterations"] == settings["iterations"] and entry["contacts"] == settings["contacts"] and entry[
        "dt"] in (settings["dt"], control_dt(mode)) and entry["precision"] == "double" and entry["stepping"] == "serial"


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
