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
    status, said = measure.measure([program, "--describe"])
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
    """Measures as it is asked. `measures` is false for a report: then what is missing is an error of its own."""

    def __init__(self, scene, mode, table, parts, measures=True):
        self.scene, self.mode, self.table, self.cores, self.measures = scene, mode, table, parts, measures
        self.reference, self.done = settings.REFERENCE[mode], {}

    def point(self, setting, seed):
        return dict(scene=self.scene.name, bodies=self.scene.bodies, density=self.scene.density, **setting._asdict(),
                    seed=seed)

    def command(self, point):
        given = {name: value for name, value in point.items()
                 if name not in ("scene", "bodies", "density", "precision")}
        return [*self.scene.commands[point["precision"]], *measure.words_of(given)]

    def rows_of(self, setting, seeds):
        points = [self.point(setting, seed) for seed in seeds]
        rows = self.table.of(points)
        if len(rows) < len(points):
            raise Missing("%s: %s, %d of %d seeds" % (self.scene.name, settings.name_of(setting), len(rows), len(points)))
        return rows

    def run(self, requests):
        """Both what is asked for and the reference of the same seeds, the reference first."""
        if not self.measures:
            return
        seeds = sorted({seed for _, some in requests for seed in some})
        for title, asked in (("reference", [(setting, seeds) for setting in self.reference]), ("settings", requests)):
            points = [self.point(setting, seed) for setting, some in asked for seed in some]
            points.sort(key=work_of, reverse=True)  # what takes long is not begun last, beside idle cores
            measure.run(self.table, "%s, %s" % (self.scene.title, title), points, self.command, None, self.cores)

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
        self.run(requests)
        return [[outcomes.error(row, self.members(int(row["seed"])), self.kind)
                 for row in self.rows_of(setting, seeds)] for setting, seeds in requests]

    def cost(self, setting):
        return self.cost_interval(setting).mean

    def cost_interval(self, setting):
        rows = [row for row in self.rows_of(setting, range(1, settings.PLANS[self.mode].first + 1)) if row["status"] == "ok"]
        if not rows:
            return stats.Interval(math.inf, math.inf, math.inf, 0)
        return stats.interval([row["cpu_s_per_s"] for row in rows], most=math.inf)


def work_of(point):
    """What it costs, about, against others of the same scene."""
    return point["iterations"] / point["dt"]


class Missing(Exception):
    """A row that a report needs is not there."""


def reference_error(study, seeds):
    """Of the first of the reference's runs against the others: below it nothing can be told."""
    errors = [outcomes.error(study.members(s)[0], study.members(s)[1:], study.kind) for s in seeds]
    return stats.interval(errors)


def examine(study, precisions):
    plan = settings.PLANS[study.mode]
    names = settings.settings_of(study.mode, precisions, study.scene.bodies)
    intervals, winners = stats.decide(names, study.errors, study.cost, settings.LIMITS, plan)
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
