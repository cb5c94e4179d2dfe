"""Studies a scene: what accuracy its settings have, with how much doubt, and for how much time."""

import hashlib
import math
import os
from collections import Counter
from typing import NamedTuple

import measure
import outcomes
import settings
import stats


class Scene(NamedTuple):
    """What is studied. `commands` are, by precision, what is to be called, without the setting."""
    name: str
    title: str
    bodies: object  # a number, or "" for a user's scene
    density: object
    commands: dict


def preset(name, mode, density, programs):
    bodies = settings.SCENES[mode][name]
    commands = {precision: [program, "scene", "--scene", name, "--bodies", str(bodies), "--density", "%g" % density]
                for precision, program in programs.items()}
    return Scene(name, "%s of %d bodies, %g kg/m³" % (name.capitalize(), bodies, density), bodies, density, commands)


def own(path, programs):
    """A user's program. Rows are of the very file: a new build is measured anew."""
    with open(path, "rb") as file:
        digest = hashlib.sha256(file.read()).hexdigest()[:10]
    name = os.path.basename(path)
    for precision, program in programs.items():
        check(program, precision)
    return Scene("%s-%s" % (name, digest), name, "", "", {precision: [p] for precision, p in programs.items()})


def check(program, precision):
    status, said = measure.measure([program, "--describe"]) or ("there was no time to ask", {})
    if status != "ok" or "precision" not in said:
        raise SystemExit("tradeoff.py: %s --describe does not say what scene it is (%s). Its main is to end with "
                         "tradeoff::run, of harness.h." % (program, status))
    if said["precision"] != precision:
        raise SystemExit("tradeoff.py: %s is for an ODE of %s precision, not %s" % (program, said["precision"], precision))


class Result(NamedTuple):
    """What there is to say of a scene. Everything is by setting but the winners, one for each limit."""
    scene: Scene
    kind: outcomes.Kind
    intervals: dict
    costs: dict  # intervals, too: processor seconds a simulated second
    winners: list
    rows: dict    # by setting, its rows of the first set of seeds
    parts: dict   # by setting, the mean of each part of the error
    failures: dict  # by setting, how many runs had each of the failures
    errors: dict  # by setting, a list, from seed 1 on
    reference: stats.Interval  # the error of one of the reference's runs against the others
    reference_rows: list


class Study:
    """What there is to say of a scene by the rows that there are, and which are missing (see measure.Source)."""

    alone = staticmethod(lambda point: False)
    columns = None

    def __init__(self, scene, mode, table, precisions):
        self.scene, self.mode, self.table, self.title = scene, mode, table, scene.title
        self.reference, self.done = settings.REFERENCE[mode], {}
        self.settings = settings.settings_of(mode, precisions, scene.bodies)

    def wanted(self):
        """The points without which nothing more can be said; none where all is said."""
        try:
            examine(self)
            return []
        except Missing as missing:
            return missing.points

    def point(self, setting, seed):
        return dict(scene=self.scene.name, bodies=self.scene.bodies, density=self.scene.density, **setting._asdict(),
                    seed=seed)

    def command(self, point):
        given = {name: value for name, value in point.items()
                 if name not in ("scene", "bodies", "density", "precision")}
        return [*self.scene.commands[point["precision"]], *measure.words_of(given)]

    def pace(self):
        return Pace([row for row in list(self.table.rows) if row["scene"] == self.scene.name])

    def need(self, points):
        """Raises Missing unless all of them were measured."""
        missing = self.table.missing(points)
        if missing:
            raise Missing("%s: %d of %d points" % (self.scene.name, len(missing), len(points)), missing)

    def rows_of(self, setting, seeds):
        points = [self.point(setting, seed) for seed in seeds]
        self.need(points)
        return self.table.of(points)

    def members(self, seed):
        if seed not in self.done:
            rows = [self.rows_of(setting, [seed])[0] for setting in self.reference]
            broken = [row["status"] for row in rows if row["status"] != "ok"]
            if broken:
                raise SystemExit("tradeoff.py: the reference failed: %s" % broken[0])
            self.done[seed] = rows
        return self.done[seed]

    @property
    def kind(self):
        return outcomes.kind_of(self.members(1)[0])

    def errors(self, requests):
        """Of the settings, against the reference's runs of the same seeds. What of either is missing is asked for at
        once, so that as much as can be is measured side by side."""
        seeds = sorted({seed for _, some in requests for seed in some})
        asked = [*requests, *((setting, seeds) for setting in self.reference)]
        self.need([self.point(setting, seed) for setting, some in asked for seed in some])
        return [[outcomes.error(row, self.members(int(row["seed"])), self.kind)
                 for row in self.rows_of(setting, some)] for setting, some in requests]

    def cost(self, setting):
        return self.cost_interval(setting).mean

    def cost_interval(self, setting):
        rows = [row for row in self.rows_of(setting, range(1, settings.PLANS[self.mode].first + 1)) if row["status"] == "ok"]
        if not rows:
            return stats.Interval(math.inf, math.inf, math.inf, 0)
        return stats.interval([row["cpu_s_per_s"] for row in rows], most=math.inf)


class Missing(Exception):
    """Points that are not measured yet."""

    def __init__(self, text, points):
        super().__init__(text)
        self.points = points


# A step of one body takes about so long, for as many iterations and these; a run is some seconds of simulated time.
ITERATIONS_BESIDES = 30
SECONDS_OF_WORK = 5e-7


def work_of(point):
    return (point["bodies"] or 10) * (ITERATIONS_BESIDES + point["iterations"]) / point["dt"]


class Pace:
    """How long points of a scene take, about, by those that were measured."""

    def __init__(self, rows):
        known = [row for row in rows if row["status"] == "ok"]
        work = sum(map(work_of, known))
        self.seconds_of_work = sum(row["took_s"] for row in known) / work if work else SECONDS_OF_WORK
        self.by_setting = {}
        for row in known:
            self.by_setting.setdefault(setting_of(row), []).append(row["took_s"])

    def expected(self, point):
        same = self.by_setting.get(setting_of(point))
        return sum(same) / len(same) if same else work_of(point) * self.seconds_of_work


def setting_of(row):
    return settings.Setting(*(row[name] for name in settings.Setting._fields))


def reference_error(study, seeds):
    """Of the first of the reference's runs against the others: below it nothing can be told."""
    errors = [outcomes.error(study.members(s)[0], study.members(s)[1:], study.kind) for s in seeds]
    return stats.interval(errors)


def examine(study):
    plan, names = settings.PLANS[study.mode], study.settings
    alone = [name for name in names if name == settings.BASE or settings.is_varied_alone(name)]
    intervals, winners = stats.decide(names, study.errors, study.cost, settings.LIMITS, plan, alone)
    rows = {name: study.rows_of(name, range(1, intervals[name].count + 1)) for name in names}
    parts, failures, errors = {}, {}, {}
    for name in names:
        found = [outcomes.parts_of(row, study.members(int(row["seed"])), study.kind) for row in rows[name]]
        parts[name] = {part: sum(f.get(part, 0.0) for f in found) / len(found) for part in {p for f in found for p in f}}
        failures[name] = Counter(f for row in rows[name] for f in outcomes.failures(row, study.kind))
        errors[name] = [max(f.values()) for f in found]
    first = range(1, plan.first + 1)
    return Result(study.scene, study.kind, intervals, {name: study.cost_interval(name) for name in names}, winners, rows, parts,
                  failures, errors, reference_error(study, first), [row for s in first for row in study.members(s)])
