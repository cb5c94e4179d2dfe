"""Tables and advice, from the data."""

import math

import study
from figures import broad_name


def percent(share):
    return "%.3g %%" % (100 * share) if math.isfinite(share) else "useless"


def pile_name(entry):
    return "steps of %g ms, %d iterations, %d contact%s a pair, %s precision, %s" % (
        1000 * entry["dt"], entry["iterations"], entry["contacts"], "" if entry["contacts"] == 1 else "s", entry["precision"],
        "one core" if entry["stepping"] == "serial" else "all cores")


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| --- " + "| ---: " * (len(header) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def broad_advice(entries):
    """For each offset, the fastest that reports nothing too much, or at most so much."""
    lines = []
    for offset in study.OFFSETS:
        here = [e for e in entries if e["offset"] == offset]
        lines.append("\n%g m from the origin:\n" % offset)
        for limit in (0,) + study.LIMITS:
            best = study.cheapest(here, "ms", limit)
            what = "no extra pair" if limit == 0 else "at most %g %% extra pairs" % (100 * limit)
            if best:
                lines.append("- %s: %s, tolerance %g m: %.3g ms a frame, %s extra" %
                             (what, broad_name(best), best["tolerance"], best["ms"], percent(best["extra_per_exact"])))
            else:
                lines.append("- %s: nothing that was measured" % what)
        lost = sorted({broad_name(e) for e in here if e["missed"] > 0})
        if lost:
            lines.append("- not to be used, because coordinates are rounded so far that pairs get lost: " +
                         "; ".join(lost))
    return "\n".join(lines) + "\n"


def broad_failures(rows):
    failures = ["- %s at %g m: %s" % (broad_name(r), r["offset"], r["status"]) for r in rows if r["status"] != "ok"]
    return "Did not finish:\n\n" + "\n".join(failures) + "\n" if failures else ""


def broad_table(entries):
    rows = [(broad_name(e), "%g" % e["offset"], "%g" % e["tolerance"], "%.3g" % e["ms"], percent(e["extra_per_exact"]),
             "%d" % e["missed"]) for e in entries]
    return table(("space", "offset, m", "tolerance, m", "ms a frame", "extra", "missed"), rows)


def pile_advice(choices, reference):
    controls = [e for e in reference if e["error"] > 0]
    lines = []
    for limit in study.LIMITS:
        best = study.cheapest(choices, "wall_s_per_s", limit)
        doubt = " (less than the reference's own uncertainty)" if any(e["error"] > limit for e in controls) else ""
        if best:
            lines.append("- within %g %%%s: %s: %.3g s a simulated second, error %s" %
                         (100 * limit, doubt, pile_name(best), best["wall_s_per_s"], percent(best["error"])))
        else:
            near = min(choices, key=lambda e: e["error"])
            lines.append("- within %g %%: nothing that was measured; nearest is %s with %s" %
                         (100 * limit, pile_name(near), percent(near["error"])))
    for control in controls:
        lines.append("\nThe reference with steps %g times as long is off by %s (%s): differences below that say nothing." %
                     (study.CONTROL_STEP, percent(control["error"]),
                      max(study.PARTS, key=lambda part: control[part])))
    return "\n".join(lines) + "\n"


def pile_limits(choices):
    """What each value of each setting can reach, whatever the others are."""
    rows = []
    for name, what in (("dt", "time step, s"), ("iterations", "iterations"), ("contacts", "contacts a pair"),
                       ("precision", "precision"), ("stepping", "stepping")):
        for value in sorted({e[name] for e in choices}):
            some = [e for e in choices if e[name] == value]
            best = min(some, key=lambda e: e["error"])
            near = study.cheapest(some, "wall_s_per_s", 0.05)
            rows.append(("%s: %s" % (what, "%g" % value if isinstance(value, float) else value), percent(best["error"]),
                         "%.3g" % near["wall_s_per_s"] if near else "not reached"))
    return table(("setting", "least error", "s a simulated s for 5 %"), rows)


def pile_table(choices, reference):
    best = study.front(choices, "wall_s_per_s") + sorted(reference, key=lambda e: -e["dt"])
    rows = [(pile_name(e), "%.3g" % e["wall_s_per_s"], percent(e["error"]), "%.3f" % e["height_m"],
             "%.2f" % e["penetration_mm"], "%.1f" % max(e["largest_mm"], e["largest_falling_mm"]),
             percent(e["energy gain"]), percent(e["energy_drift_rest"]), "%.1e" % e["momentum_drift"],
             "%.1e" % e["angular_drift"]) for e in best]
    return table(("Pareto front; reference and its control", "s a simulated s", "error", "mean height, m", "penetration, mm", "largest, mm",
                  "energy gained", "drift at rest, a s", "momentum drift", "angular drift"), rows)
