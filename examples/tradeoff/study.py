"""What is known of a scene by the rows that there are, and which points are wanted next: from coarse to fine."""

import math
import statistics
from typing import NamedTuple

import outcomes
import stats

LIMITS = (0.01, 0.05, 0.2)
MOST_BIAS = 0.25    # of a limit: by so much a reference may still change
FRESH_SEEDS = range(1001, 1013)  # of a confirmation, with which nobody was chosen
FIRST_SEEDS = range(1, stats.LADDER[0] + 1)
TRIES = 3           # so many candidates at most are put to it, for each limit
LIKELY = 1.5        # of a limit: whose mean is above gets no more seeds
NOISE = 1.1         # costs that differ by less are alike
FAVOURITES = 3      # so many competitors at a time get more seeds
MOST_BODIES_OF_STEP = 30  # dWorldStep takes time by the cube of a heap's contacts


class Setting(NamedTuple):
    """The defaults are ODE's own where it has any."""
    dt: float = 0.01
    iterations: int = 20
    contacts: int = 4
    reducer: str = "first"
    erp: float = 0.2
    cfm: object = 1e-10  # or "step/mass", of the lightest body
    solver: str = "quick"
    sleep: str = "off"


BASE = Setting()
KEY = ("scene", "bodies", *Setting._fields, "seed")
STEPS = (0.04, 0.02, 0.014, 0.01, 0.007, 0.005, 0.0035, 0.0025, 0.00125)
ITERATIONS = (5, 10, 20, 35, 50, 100)
# A setting has one of these at most, so that each answer says what makes it.
KNOBS = dict(contacts=(1, 2, 8), reducer=("deepest", "spread"), erp=(0.1, 0.4, 0.8), cfm=(1e-8, 1e-6, "step/mass"), sleep=("on",))
# References, each of half the step of the one before.
HALVINGS = [0.01 / 2 ** i for i in range(7)]
EXACT = [Setting(dt, contacts=8, solver="step") for dt in HALVINGS]
ITERATED = [Setting(dt, 100, 8) for dt in HALVINGS[:5]]


def twice(reference):
    """With twice the iterations: halved steps alone would not show that there are too few."""
    return reference._replace(iterations=2 * reference.iterations)


REFERENCES = {*EXACT, *ITERATED, *map(twice, ITERATED)}


def name_of(setting):
    """In words; of what is as in the base only step and iterations."""
    words = ["%g ms" % (1000 * setting.dt)]
    words.append("dWorldStep" if setting.solver == "step" else "%d iterations" % setting.iterations)
    known = dict(contacts="at most %s contacts", reducer="the %s contacts", erp="ERP %s", cfm="CFM %s", sleep="sleeping %s")
    words += [form % (value if isinstance(value, str) else "%g" % value) for name, form in known.items()
              for value in (getattr(setting, name),) if value != getattr(BASE, name)]
    return ", ".join(words)


def knobs_of(setting):
    return sum(getattr(setting, name) != getattr(BASE, name) for name in KNOBS)


def next_to(values, value):
    at = min(range(len(values)), key=lambda i: abs(math.log(values[i] / value)))
    return [values[i] for i in (at - 1, at + 1) if 0 <= i < len(values)]


def neighbours(setting, few, undriven):
    """What differs in one thing. `few` bodies may use dWorldStep; bodies may sleep where nothing drives them."""
    found = [setting._replace(dt=dt) for dt in next_to(STEPS, setting.dt)]
    if setting.solver == "quick":
        found += [setting._replace(iterations=count) for count in next_to(ITERATIONS, setting.iterations)]
        found += [setting._replace(solver="step")] if few else []
    plain = BASE._replace(dt=setting.dt, iterations=setting.iterations, solver=setting.solver)
    found += [plain] + [plain._replace(**{name: value}) for name, values in KNOBS.items() if name != "sleep" or undriven
                        for value in values]
    return [other for other in found if other != setting]


def work_of(setting):
    """Time of a simulated second, about, in some unit: collisions and the like take as long as 30 iterations."""
    return (30 + setting.iterations) / setting.dt


def work_alike(setting):
    return setting._replace(erp=BASE.erp, cfm=BASE.cfm)


class Winner(NamedTuple):
    """Of a limit, the simplest of the cheapest settings that are within it by all that is known. `why` says what is lacking
    until it is named for certain; where that is empty it is confirmed."""
    limit: float
    setting: object
    interval: object
    fresh: object
    why: str


class Study:
    def __init__(self, name, title, bodies, command, table):
        self.name, self.title, self.bodies, self.command, self.table = name, title, bodies, command, table
        self.spent, self.cache, self.seen = 0.0, {}, 0
        self.rows = {}  # by setting and seed
        self.refresh()

    # Rows.

    def point(self, setting, seed):
        return dict(scene=self.name, bodies=self.bodies, **setting._asdict(), seed=seed)

    def refresh(self):
        """What follows from rows is kept until there are more."""
        for row in self.table.rows[self.seen:]:
            if row["scene"] == self.name and row["bodies"] == self.bodies:
                self.cache = {}
                setting = Setting(*(row[name] if isinstance(row[name], str) else type(old)(row[name])
                                    for name, old in BASE._asdict().items()))
                self.rows.setdefault(setting, {})[int(row["seed"])] = row
        self.seen = len(self.table.rows)

    def cached(self, key, make):
        self.refresh()
        if key not in self.cache:
            self.cache[key] = make()
        return self.cache[key]

    def row(self, setting, seed):
        return self.rows.get(setting, {}).get(seed)

    def rows_of(self, setting):
        return list(self.rows.get(setting, {}).values())

    def said(self, name):
        """What the program says of the scene; 0 before its first run."""
        return next((row[name] for row in self.rows_of(BASE) if row["status"] == "ok"), 0)

    def is_small(self):
        return 0 < self.said("bodies_seen") <= MOST_BODIES_OF_STEP

    # The reference.

    def references(self):
        return EXACT if self.is_small() else ITERATED

    def level(self):
        """The finest reference with three seeds; -1 where none has."""
        return self.cached("level", lambda: max((i for i, setting in enumerate(self.references()) if all(
            self.row(setting, seed) for seed in FIRST_SEEDS)), default=-1))

    def change(self, one, other):
        """How far apart outcomes are by six seeds; by three twice as much, to be safe."""
        def make():
            both = [(self.row(one, seed), self.row(other, seed)) for seed in range(1, stats.LADDER[1] + 1)]
            return min(factor * outcomes.bias(both[:count]) if all(map(all, both[:count])) else math.inf
                       for count, factor in zip(stats.LADDER, (2, 1)))
        return self.cached(("change", one, other), make)

    def bias(self, level):
        """What is left of a reference's error, as ODE's is of first order, by three steps: two may agree by chance."""
        if level < 2:
            return math.inf
        coarse, middle, fine = self.references()[level - 2:level + 1]
        steps = max(self.change(middle, fine), self.change(coarse, middle) / 2)
        return steps if fine.solver == "step" else max(steps, self.change(fine, twice(fine)))

    def level_for(self, limit):
        """The coarsest reference that has converged for the limit; the finest where none has."""
        return self.cached(("level", limit), lambda: next(
            (level for level in range(self.level() + 1) if self.bias(level) <= MOST_BIAS * limit), self.level()))

    def reference_for(self, limit):
        return self.references()[max(self.level_for(limit), 0)]

    def has_converged(self, limit):
        return self.bias(self.level_for(limit)) <= MOST_BIAS * limit

    # Settings.

    def groups(self):
        """Settings that give the same bits with the same seeds are one: by each, the one that is closest to the base and all."""
        def make():
            alike = {}
            for name, rows in self.rows.items():
                digests = tuple(rows.get(seed, {}).get("digest") for seed in FIRST_SEEDS)
                alike.setdefault(digests if all(digests) else name, []).append(name)
            closest = [(min(group, key=lambda one: (sum(a != b for a, b in zip(one, BASE)), str(one))), group) for group in alike.values()]
            return {name: (first, group) for first, group in closest for name in group}
        return self.cached("groups", make)

    def one_of(self, setting):
        return self.groups().get(setting, (setting,))[0]

    def costs(self, setting):
        """Processor seconds a simulated second: the median over all rows of the same work, and its quartiles. ERP and CFM change
        no work. Rows of another machine than the first one's tell errors, but no costs."""
        def make():
            first, same = self.table.rows[0], {work_alike(one) for one in self.groups().get(setting, (setting, (setting,)))[1]}
            values = [row["cpu_s_per_s"] for one in self.rows if work_alike(one) in same for row in self.rows_of(one)
                      if row["status"] == "ok" and all(row.get(name) == first.get(name) for name in ("cpu", "cores"))]
            if len(values) < 2:
                return tuple(values) * 3 if values else (math.inf,) * 3
            low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
            return middle, low, high
        return self.cached(("costs", setting), make)

    def cost(self, setting):
        return self.costs(setting)[0]

    def errors(self, setting, seeds, limit):
        """Of those of the seeds that were run, with this limit's reference too."""
        pairs = [(self.row(setting, seed), self.row(self.reference_for(limit), seed)) for seed in seeds]
        return tuple(outcomes.error(*pair) for pair in pairs if all(pair) and pair[1]["status"] == "ok")

    def interval(self, setting, limit=LIMITS[0]):
        """By as many seeds as the ladder's last step that is whole; None before its first."""
        def make():
            errors = self.errors(setting, range(1, stats.LADDER[-1] + 1), limit)
            whole = [count for count in stats.LADDER if count <= len(errors)]
            return stats.interval(errors[:whole[-1]]) if whole else None
        return self.cached(("interval", setting, limit), make)

    def fresh(self, setting, limit):
        def make():
            errors = self.errors(setting, FRESH_SEEDS, limit)
            return stats.interval(errors, 1 - (1 - stats.LEVEL) / TRIES) if len(errors) == len(FRESH_SEEDS) else None
        return self.cached(("fresh", setting, limit), make)

    def settings(self):
        """Those with an interval and a cost, one of each group, from the cheapest. The reference's own are none."""
        def make():
            measured = [s for s in self.rows if s not in REFERENCES and self.one_of(s) == s and
                        all(self.interval(s, limit) for limit in LIMITS)]
            return sorted((s for s in measured if math.isfinite(self.cost(s))), key=self.cost)
        return self.cached("settings", make)

    # Who is named.

    def confirmed_for(self, setting, limit):
        """The widest limit up to this one for which fresh seeds confirm the setting: what is within a limit is within every
        wider one, also if that has a coarser reference. None where there is none."""
        return next((each for each in reversed(LIMITS) if each <= limit and self.has_converged(each) and
                     self.interval(setting, each).verdict(each) == "within" and self.fresh(setting, each) and
                     self.fresh(setting, each).high <= each), None)

    def simplest_first(self, found):
        """From the cheapest, but first the simplest of those that cost as much as that one."""
        if not found:
            return []
        most = max(NOISE * self.cost(found[0]), self.costs(found[0])[2])
        first = min((s for s in found if self.cost(s) <= most or self.costs(s)[1] <= self.cost(found[0])), key=knobs_of)
        return sorted(found, key=lambda s: s != first)

    def named(self, limit):
        """Settings that are certain to be within the limit."""
        return self.cached(("named", limit), lambda: self.simplest_first(
            [s for s in self.settings() if self.confirmed_for(s, limit)]))

    def candidates(self, limit):
        """Within the limit by the seeds that choose, and not refused by fresh ones; after some refusals only those that are named."""
        def make():
            within = [s for s in self.settings() if self.interval(s, limit).verdict(limit) == "within"]
            refused = {s for s in within if self.fresh(s, limit) and self.fresh(s, limit).high > limit}
            return self.simplest_first([s for s in self.settings() if self.confirmed_for(s, limit) or
                                        len(refused) < TRIES and s in within and s not in refused])
        return self.cached(("candidates", limit), make)

    def winner(self, limit):
        if not self.settings():
            return Winner(limit, None, None, None, "nothing was measured yet")
        if not self.has_converged(limit):
            return Winner(limit, None, None, None, self.lacking_reference())
        for best in self.named(limit)[:1]:
            of = self.confirmed_for(best, limit)
            return Winner(limit, best, self.interval(best, of), self.fresh(best, of), "")
        for best in self.candidates(limit)[:1]:
            return Winner(limit, best, self.interval(best, limit), self.fresh(best, limit), "not confirmed with fresh seeds")
        likely = [s for s in self.settings() if self.interval(s, limit).mean <= limit and not self.fresh(s, limit)]
        if not likely:
            return Winner(limit, None, None, None, "none is within")
        found = self.interval(likely[0], limit)
        why = "more seeds are needed" if found.count < stats.LADDER[-1] else "%d seeds do not decide" % found.count
        return Winner(limit, likely[0], found, None, why)

    def lacking_reference(self):
        """That there is no converged reference, and what would make one."""
        level, ways = self.level(), "a shorter scene or a wider scale of the observations"
        if level < 2:
            return "no converged reference yet"
        fine = self.references()[level]
        if level + 1 < len(self.references()):
            ways = "more time for smaller steps, " + ways
        by = "" if math.isinf(self.bias(level)) else " may be off by %.2g %%" % (100 * self.bias(level))
        return "no converged reference: %s%s. It takes %s" % (name_of(fine), by, ways)

    def winners(self):
        return self.cached("winners", lambda: [self.winner(limit) for limit in LIMITS])

    # What is wanted.

    def missing(self, setting, seeds):
        return [self.point(setting, seed) for seed in seeds if not self.row(setting, seed)]

    def with_reference(self, setting, seeds, limit):
        return self.missing(self.reference_for(limit), seeds) + self.missing(setting, seeds)

    def finer_reference(self, limit):
        """What its bias needs to come below a quarter of the limit: six seeds and twice the iterations, then half the step."""
        level, references = self.level(), self.references()
        if not self.has_converged(limit):
            known = references[max(level - 2, 0):level + 1]
            checks = [twice(references[level])] if references is ITERATED else []
            near = level > 1 and self.bias(level) <= 2 * MOST_BIAS * limit  # twice as much by three seeds only
            lacking = [point for setting in known + checks
                       for point in self.missing(setting, range(1, stats.LADDER[near] + 1))]
            if not lacking and level + 1 < len(references):
                lacking = self.missing(references[level + 1], FIRST_SEEDS)
            yield from lacking

    def competitors(self, limit):
        """Those that are likely to be within the limit, are not known to be, and would be cheaper, or simpler at the same cost."""
        first = next(iter(self.candidates(limit)), None)
        def gains(s):
            return first is None or NOISE * self.cost(s) < self.cost(first) or (
                knobs_of(s) < knobs_of(first) and self.cost(s) <= NOISE * self.cost(first))
        return [s for s in self.settings() if gains(s) and self.interval(s, limit).verdict(limit) == "open" and
                self.interval(s, limit).mean < LIKELY * limit and self.interval(s, limit).count < stats.LADDER[-1]][:FAVOURITES]

    def more_seeds(self, limit):
        for setting in self.competitors(limit):
            count = next(step for step in stats.LADDER if step > self.interval(setting, limit).count)
            yield from self.with_reference(setting, range(1, count + 1), limit)

    def confirm(self, limit):
        """What the first candidate lacks to be named; where there is none, seeds for those that may become one."""
        found = self.candidates(limit)
        if not found:
            yield from self.more_seeds(limit)
        for setting in found[:1]:
            yield from self.with_reference(setting, FRESH_SEEDS, limit)

    def improve(self, limit):
        """Seeds for those that may beat the best so far, and its neighbours; no dearer ones of what is within the limit."""
        yield from self.more_seeds(limit)
        known = self.candidates(limit)
        best = known[0] if known else min(self.settings(), key=lambda s: self.interval(s, limit).mean)
        near = [s for s in neighbours(best, self.is_small(), self.said("undriven")) if not known or work_of(s) < 1.05 * work_of(best)]
        for setting in sorted(near, key=work_of):
            yield from self.missing(setting, FIRST_SEEDS)

    def wanted(self):
        """Points in the order in which they are wanted, as far as is known now: something certain first, then something
        cheaper. The narrowest limit needs the finest reference, which takes the longest: it comes last."""
        self.refresh()
        yield from self.missing(BASE, FIRST_SEEDS)
        if not self.said("bodies_seen"):
            return
        grid = [Setting(dt, iterations) for dt in (0.02, 0.01, 0.005) for iterations in (10, 20)]
        grid += [Setting(dt, solver="step") for dt in (0.04, 0.02, 0.01) if self.is_small()]
        for setting in (*self.references()[:3], *grid):
            yield from self.missing(setting, FIRST_SEEDS)
        if not self.settings():
            return
        for limits in LIMITS[:0:-1], LIMITS[:1]:
            for stage in self.finer_reference, self.confirm, self.improve:
                for limit in limits:
                    if stage == self.finer_reference or self.has_converged(limit):
                        yield from stage(limit)

    def expected(self, point):
        """Seconds that a point takes, by those that were measured: as the same setting, or by steps and iterations."""
        setting = Setting(*(point[name] for name in Setting._fields))
        def make():
            known = [(of, row["took_s"]) for of in self.rows for row in self.rows_of(of) if row["status"] == "ok"]
            return sum(took for _, took in known) / sum(work_of(of) for of, _ in known) if known else 0.0
        same = [row["took_s"] for row in self.rows_of(setting)]
        return sum(same) / len(same) if same else work_of(setting) * self.cached("pace", make)
