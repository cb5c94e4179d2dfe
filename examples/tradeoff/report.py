"""Sentences and tables, all made of rows."""

import outcomes
import stats
import study


def percent(share):
    return "%.2g %%" % (100 * share) if share < 0.995 else "100 %"


def cells(one, winner):
    """What is known of a limit: the cheapest setting, and what is lacking until it is certain."""
    if winner.setting is None:
        return [winner.why, "", "", ""]
    level = one.level_for(winner.limit)
    error = "%s (%s to %s)" % tuple(percent(value).rstrip(" %") for value in (winner.fresh or winner.interval)[:3])
    return [study.name_of(winner.setting) + (" (uncertain: %s)" % winner.why if winner.why else ""),
            "%.3g (%.3g to %.3g)" % tuple(1000 * value for value in one.costs(winner.setting)), error,
            "%s ± %s" % (study.name_of(one.reference_for(winner.limit)._replace(contacts=4)), percent(one.bias(level)))]


def answer(studies):
    """What is to be said now; limits with the same setting share a row."""
    lines = ["| scene | within | cheapest setting | ms of processor a simulated second | error, % | reference and its bias |",
             "| --- | ---: | --- | ---: | ---: | ---: |"]
    for one in studies:
        same = {}
        for winner in one.winners():
            same.setdefault((winner.setting, winner.why), []).append(winner)
        for winners in same.values():
            limits = "%s %%" % ", ".join("%g" % (100 * winner.limit) for winner in winners)
            lines.append("| %s |" % " | ".join([one.title, limits, *cells(one, winners[0])]))
    return "\n".join(lines) + "\n"


def origin(table):
    """Where the rows are from."""
    machines = {}
    for row in table.rows:
        machines.setdefault((row["cpu"], row["cores"], row["date"]), set()).add(row["commit"])
    return "\n".join("%s, a run a core on %s cores, %s, commit %s" % (*machine, ", ".join(sorted(commits)))
                     for machine, commits in sorted(machines.items())) + "\n"


def shown(one):
    """The settings that tables have a row for: the base and who was named, from the cheapest."""
    named = {winner.setting for winner in one.winners() if winner.setting}
    return sorted({one.one_of(study.BASE), *named} & set(one.settings()), key=one.cost)


def table_of(one):
    """What a user sees with each: the parts of the error, and beside them the depths, which are not in it."""
    reference = one.reference_for(study.LIMITS[0])
    rows = {setting: [row for row in one.rows_of(setting) if row["seed"] not in study.FRESH_SEEDS]
            for setting in (*shown(one), reference)}
    parts = {setting: [outcomes.parts_of(row, one.row(reference, int(row["seed"]))) for row in found
                       if (one.row(reference, int(row["seed"])) or {}).get("status") == "ok"] for setting, found in rows.items()}
    names = list(dict.fromkeys(name for found in parts.values() for part in found for name in part
                               if name not in outcomes.FAILURES))
    lines = ["| setting | " + " | ".join(names) + " | failures | depth at rest, mm | impact, mm | speed × step, mm |",
             "| --- |" + " ---: |" * (len(names) + 4)]
    for setting, found in rows.items():
        good = [row for row in found if row["status"] == "ok"]
        failed = sum(bool(outcomes.failures(row)) for row in found)
        cells = [percent(sum(part.get(name, 0.0) for part in parts[setting]) / max(1, len(parts[setting]))) for name in names]
        cells.append("%d of %d" % (failed, len(found)) if failed else "0 (at most %s)" % percent(stats.rate_at_most(len(found))))
        cells += ["%.2g" % max((row[column] for row in good), default=float("nan")) for column in ("depth_mm", "impact_mm")]
        cells.append("%.2g" % max((1000 * row["fastest_m_s"] * setting.dt for row in good), default=float("nan")))
        name = "the reference" if setting == reference else study.name_of(setting)
        lines.append("| %s | %s |" % (name, " | ".join(cells)))
    return "\n".join(lines) + "\n"
