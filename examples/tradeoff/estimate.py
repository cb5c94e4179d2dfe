"""What a study costs before it is made: points and core-minutes by scene and stage."""

import measure
import settings
import words

TITLES = ("a first look", "until somebody can be named", "while a limit is open", "winners, with fresh seeds")


def stages(plan, chosen):
    """Of each: how many seeds of how many settings at most, and how many of the reference."""
    tried = min(chosen, len(settings.LIMITS) * plan.tries)
    return ((plan.first, chosen, plan.first), (plan.least - plan.first, chosen, plan.least - plan.first),
            (plan.most - plan.least, chosen, plan.most - plan.least), (plan.fresh, tried, plan.fresh))


def probe(study):
    """A point of the reference and one of the base, of which something is known of the others."""
    return [study.point(setting, 1) for setting in (study.reference[0], settings.BASE)]


def measure_probes(studies, parts):
    asked = [measure.Source(study.title, study.table, probe(study), study.command, None, study.alone, study.pace().expected)
             for study in studies]
    measure.run(asked, parts)


def rows_of(study):
    """Of the table: points and core-minutes of each stage."""
    plan, pace = settings.PLANS[study.mode], study.pace()

    def minutes(chosen):
        return sum(pace.expected(study.point(setting, 1)) for setting in chosen) / 60

    count, reference = len(study.settings), minutes(study.reference)
    mean = minutes(study.settings) / count
    rows = []
    for title, (seeds, chosen, of_reference) in zip(TITLES, stages(plan, count)):
        if seeds:
            points = seeds * chosen + of_reference * len(study.reference)
            rows.append((study.title, title, points, seeds * chosen * mean + of_reference * reference))
    return rows


def text(broad, studies, parts):
    """A table. Whatever a later stage looks at is an upper bound: most settings are out after the first."""
    measure_probes(studies, parts)
    rows = [(source.title, "all", len(source.points), sum(map(source.seconds, source.points)) / 60) for source in broad]
    for study in studies:
        rows += rows_of(study)
    wanted = [(study, point) for study in (*broad, *studies) for point in study.wanted()]
    now = sum(study.pace().expected(point) for study, point in wanted) / 60
    done = sum(row["took_s"] for table in {id(s.table): s.table for s in (*broad, *studies)}.values() for row in table.rows) / 60
    written = [(title, stage, "{:,}".format(points), "%.1f" % minutes) for title, stage, points, minutes in rows]
    return "\n".join((words.table(("of", "stage", "points at most", "core-minutes at most"), written),
                      "%.1f core-minutes at most, %.1f of them a first look of everything." % (
                          sum(row[3] for row in rows), sum(row[3] for row in rows if row[1] in ("all", TITLES[0]))),
                      "Done: %.1f core-minutes. Wanted now, before more can be said: %d points, about %.1f core-minutes, "
                      "%.1f minutes on these %d cores." % (done, len(wanted), now, now / len(parts), len(parts))))
