"""Tables and sentences, all made from the data."""

import math

import outcomes
import settings
import stats
import study


def percent(share):
    return "%.3g %%" % (100 * share) if math.isfinite(share) else "useless"


def span(found):
    return "%s (%s to %s)" % (percent(found.mean), percent(found.low), percent(found.high))


def cost_of(found):
    if not math.isfinite(found.mean):
        return "failed"
    return "%.3g ms (%.3g to %.3g)" % (1000 * found.mean, 1000 * found.low, 1000 * found.high)


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
                             (what, study.space_name(best), best["tolerance"], best["ms"], percent(best["extra_per_exact"])))
            else:
                lines.append("- %s: nothing that was measured" % what)
        lost = sorted({study.space_name(e) for e in here if e["missed"] > 0})
        if lost:
            lines.append("- not to be used, because coordinates are rounded so far that pairs get lost: " +
                         "; ".join(lost))
    return "\n".join(lines) + "\n"


def broad_failures(rows):
    failures = ["- %s at %g m: %s" % (study.space_name(r), r["offset"], r["status"]) for r in rows if r["status"] != "ok"]
    return "Did not finish:\n\n" + "\n".join(failures) + "\n" if failures else ""


def broad_table(entries):
    rows = [(study.space_name(e), "%g" % e["offset"], "%g" % e["tolerance"], "%.3g" % e["ms"], percent(e["extra_per_exact"]),
             "%d" % e["missed"]) for e in entries]
    return table(("space", "offset, m", "tolerance, m", "ms a frame", "extra", "missed"), rows)


def worst_part(result, setting):
    parts = result.parts[setting]
    return max(sorted(parts), key=parts.get)


def winner_sentence(result, winner):
    """Who is the cheapest within the limit, or why nobody can be named."""
    start = "- within %g %%: " % (100 * winner.limit)
    if winner.setting is not None:
        found = result.intervals[winner.setting]
        text = start + "%s: %s of processor time a simulated second, error %s with %d seeds, %s with %d fresh ones" % (
            settings.name_of(winner.setting), cost_of(result.costs[winner.setting]), span(found), found.count,
            span(winner.confirmed), winner.confirmed.count)
        equals = [name for name, other in result.intervals.items() if name != winner.setting and
                  other.high <= winner.limit and result.costs[name].low <= result.costs[winner.setting].high]
        if equals:
            text += "; %d other%s within the limit cannot be told from it in time" % (len(equals), "s" * (len(equals) > 1))
        return text + refusals(winner)
    text = start + "no setting can be named"
    open_ones = [name for name, found in result.intervals.items() if found.verdict(winner.limit) == "open"]
    if result.reference.high > winner.limit:
        text += "; the reference itself is only known to %s" % percent(result.reference.high)
    if open_ones:
        text += "; of %d settings %d may be within it or not" % (len(result.intervals), len(open_ones))
    elif not winner.refused:
        text += "; all %d settings are beyond it" % len(result.intervals)
    return text + refusals(winner)


def refusals(winner):
    return "".join("; %s seemed to be, and was not with fresh seeds: %s" % (settings.name_of(name), span(found))
                   for name, found in winner.refused)


def scene_advice(result, source):
    lines = ["%s, %s:\n" % (result.scene.title, source),
             "One run of the reference is off from its others by %s.\n" % span(result.reference)]
    return "\n".join(lines + [winner_sentence(result, winner) for winner in result.winners]) + "\n"


def shown(result):
    """The settings that tables have a row for: the front and the winners, from the cheapest."""
    costs = {name: found.mean for name, found in result.costs.items()}
    named = {w.setting for w in result.winners if w.setting is not None}
    return sorted({settings.BASE, *named, *stats.front(result.intervals, costs)}, key=costs.get)


def front_table(result):
    rows = [(settings.name_of(name), cost_of(result.costs[name]), span(result.intervals[name]),
             "%d" % result.intervals[name].count, worst_part(result, name)) for name in shown(result)]
    return "The front, the base and who was named:\n\n" + table(
        ("setting", "processor time a simulated s", "error", "seeds", "largest part on average"), rows)


def rate(happened, count):
    return "%d of %d" % (happened, count) if happened else "0 of %d (at most %s)" % (count, percent(stats.rate_at_most(count)))


def outcome_row(name, rows, counts, kind):
    good = [row for row in rows if row["status"] == "ok"]

    def most(column):
        return "%.3g" % max(row[column] for row in good) if good else "-"

    def usual(column, factor=1.0):
        return "%.3g" % (factor * outcomes.mean(good, column)) if good else "-"

    return [name, most("largest_mm"), most("largest_falling_mm"), *(rate(counts[f], len(rows)) for f in outcomes.FAILURES
            if f == "failed" or f == "lost" or (f == "collapsed" and kind.stands) or (f == "never at rest" and kind.rests)),
            usual("jitter", 100), usual("top_drift_m", 1000), usual("energy_gain", 100), usual("energy_drift", 100),
            "%.1e" % max((row["momentum_drift"] for row in good), default=math.nan),
            "%.1e" % max((row["angular_drift"] for row in good), default=math.nan)]


def outcome_table(result):
    """What users see of each, beside the one number."""
    kind = result.kind
    header = ["setting", "deepest at rest, mm", "deepest before, mm", "failed", "bodies lost"]
    header += ["collapsed"] * kind.stands + ["never at rest"] * kind.rests
    header += ["jitter, %", "top moved, mm", "energy gained, %", "energy drift, % a s", "momentum drift", "angular drift"]
    rows = [outcome_row(settings.name_of(name), result.rows[name], result.failures[name], kind) for name in shown(result)]
    counts = {f: sum(f in outcomes.failures(row, kind) for row in result.reference_rows) for f in outcomes.FAILURES}
    rows.append(outcome_row("the reference", result.reference_rows, counts, kind))
    return "Outcomes (worst of the seeds for depths and momentum, means for the rest):\n\n" + table(header, rows)


def varied_table(result):
    """What each thing changes, alone, seed by seed against the base."""
    rows = []
    for name in filter(settings.is_varied_alone, result.intervals):
        ours, base = result.errors[name], result.errors[settings.BASE]
        change = stats.interval([a - b for a, b in zip(ours, base)], least=-1.0)
        says = "better" if change.high < 0 else "worse" if change.low > 0 else "cannot be told"
        cost = result.costs[name].mean / result.costs[settings.BASE].mean
        rows.append((settings.name_of(name), "%+.3g %% (%+.3g to %+.3g)" % tuple(100 * v for v in change[:3]), says,
                     "%.3g" % cost if math.isfinite(cost) else "failed"))
    return "One thing changed, against %s:\n\n" % settings.name_of(settings.BASE) + table(
        ("setting", "change of the error", "which is", "processor time of the base's"), rows)


def scene_tables(result):
    return "\n".join((front_table(result), outcome_table(result), varied_table(result)))
