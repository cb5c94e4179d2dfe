"""What is known of a scene by the rows that there are, and which points are wanted next: from coarse to fine."""

import math
import statistics
from typing import NamedTuple

import outcomes
import stats

LIMITS = (0.01, 0.05, 0.2)
MOST_BIAS = 0.25    # of a limit, where a setting is to be named
FRESH_SEEDS = range(1001, 1013)  # of a confirmation, with which nobody was chosen
TRIES = 3           # so many candidates at most are put to it, for each limit
LIKELY = 1.5        # of a limit: whose mean is above gets no more seeds
GAIN = 0.95         # of the best so far's cost: who takes more gets no more seeds
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
    sor: float = 1.3
    solver: str = "quick"
    sleep: str = "off"


BASE = Setting()
KEY = ("scene", "bodies", *Setting._fields, "seed")
GRID = [Setting(dt, iterations) for dt in (0.02, 0.01, 0.005) for iterations in (10, 20)]
# Around the best so far, one at a time.
VARIED = dict(iterations=(5, 10, 20, 35, 50, 100), contacts=(1, 2, 8), reducer=("deepest", "spread"), erp=(0.1, 0.4, 0.8),
              cfm=(1e-8, 1e-6, "step/mass"), sor=(0.8, 1.0, 1.6), solver=("step",), sleep=("on",))
STEPS = (0.04, 0.02, 0.014, 0.01, 0.007, 0.005, 0.0035, 0.0025, 0.00125)
# References, from coarse to fine. The coarsest is only there to tell the bias of others.
REFERENCE = [Setting(0.005 / 2 ** i, 100, 8) for i in range(-1, 5)]


def name_of(setting):
    """In words; of what is as in the base only step and iterations."""
    words = ["%g ms" % (1000 * setting.dt)]
    words.append("dWorldStep" if setting.solver == "step" else "%d iterations" % setting.iterations)
    known = dict(contacts="at most %s contacts", reducer="the %s contacts", erp="ERP %s", cfm="CFM %s", sor="SOR %s",
                 sleep="sleeping %s")
    words += [form % (value if isinstance(value, str) else "%g" % value) for name, form in known.items()
              for value in (getattr(setting, name),) if value != getattr(BASE, name)]
    return ", ".join(words)


def neighbours(setting, bodies):
    """What differs in one thing; steps by one in their list."""
    near = [abs(math.log(step / setting.dt)) for step in STEPS]
    at = near.index(min(near))
    found = [setting._replace(dt=STEPS[i]) for i in (at - 1, at + 1) if 0 <= i < len(STEPS)]
    for name, values in VARIED.items():
        if name == "solver" and bodies > MOST_BODIES_OF_STEP:
            continue
        found += [setting._replace(**{name: value}) for value in values if value != getattr(setting, name)]
    return found


def work_of(setting):
    """Time of a simulated second, about, in some unit: collisions and the like take as long as 30 iterations."""
    return (30 + setting.iterations) / setting.dt


class Winner(NamedTuple):
    """Of a limit, the cheapest setting that is within it by all that is known. `why` says what is lacking until it is
    named for certain; where that is empty it is confirmed."""
    limit: float
    setting: object
    interval: object
    fresh: object
    why: str


class Study:
    def __init__(self, name, title, bodies, command, table):
        self.name, self.title, self.bodies, self.command, self.table = name, title, bodies, command, table
        self.spent, self.cache, self.seen = 0.0, {}, 0
        self.rows, self.lasting = {}, {}  # rows by setting and seed
        self.refresh()

    # Rows.

    def point(self, setting, seed):
        return dict(scene=self.name, bodies=self.bodies, **setting._asdict(), seed=seed)

    def refresh(self):
        """What follows from rows is kept until there are more."""
        if self.seen == len(self.table.rows):
            return
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

    def kept(self, key, setting, level, make):
        """What follows from the rows of a setting and of a reference is kept until one of these has more."""
        state = len(self.rows.get(setting, ())), len(self.rows.get(REFERENCE[level], ()))
        if self.lasting.get((key, setting, level), (None,))[0] != state:
            self.lasting[key, setting, level] = state, make()
        return self.lasting[key, setting, level][1]

    def row(self, setting, seed):
        return self.rows.get(setting, {}).get(seed)

    def rows_of(self, setting):
        return list(self.rows.get(setting, {}).values())

    # The reference.

    def level(self):
        """The finest of REFERENCE with three seeds; -1 where none has."""
        return self.cached("level", lambda: max((i for i, setting in enumerate(REFERENCE) if all(
            self.row(setting, seed) for seed in range(1, stats.LADDER[0] + 1))), default=-1))

    def change(self, level):
        """By how much halving the step to this reference's changed outcomes, by six seeds; by three twice as much, to be safe."""
        def make():
            both = [[self.row(setting, seed) for setting in REFERENCE[level - 1:level + 1]] for seed in range(1, stats.LADDER[1] + 1)]
            return min(factor * outcomes.bias(both[:count]) if all(map(all, both[:count])) else math.inf
                       for count, factor in zip(stats.LADDER, (2, 1)))
        return self.cached(("change", level), make) if 0 < level < len(REFERENCE) else math.inf

    def bias(self, level):
        """What is left of a reference's error, as ODE's is of first order, by three steps: two may agree by chance. More rows
        never make it worse: what was certain stays so."""
        return max(self.change(level), min(self.change(level - 1) / 2, 2 * self.change(level + 1)))

    def level_for(self, limit):
        """Of the references that are fine enough for a limit the one with most fresh seeds; of these the coarsest, which takes
        the least time. The finest where none is."""
        def make():
            fine = [level for level in range(self.level() + 1) if self.bias(level) <= MOST_BIAS * limit]
            return max(fine, key=lambda level: (-len(self.missing(REFERENCE[level], FRESH_SEEDS)), -level), default=self.level())
        return self.cached(("level", limit), make)

    def is_fine(self, limit):
        return self.bias(self.level_for(limit)) <= MOST_BIAS * limit

    # Settings.

    def groups(self):
        """Settings that give the same bits with the same seeds are one: by each, the one that is closest to the base and all."""
        def make():
            alike = {}
            for name, rows in self.rows.items():
                digests = tuple(rows.get(seed, {}).get("digest") for seed in range(1, stats.LADDER[0] + 1))
                alike.setdefault(digests if all(digests) else name, []).append(name)
            closest = [(min(group, key=lambda one: (sum(a != b for a, b in zip(one, BASE)), str(one))), group) for group in alike.values()]
            return {name: (first, group) for first, group in closest for name in group}
        return self.cached("groups", make)

    def one_of(self, setting):
        return self.groups().get(setting, (setting,))[0]

    def costs(self, setting):
        """Processor seconds a simulated second: the median over all rows of the setting, and its quartiles. Rows of another
        machine than the first one's tell errors, but no costs."""
        group, first = self.groups().get(setting, (setting, ()))[1], self.table.rows[0]
        values = [row["cpu_s_per_s"] for one in group for row in self.rows_of(one)
                  if row["status"] == "ok" and all(row.get(name) == first.get(name) for name in ("cpu", "cores"))]
        if len(values) < 2:
            return tuple(values) * 3 if values else (math.inf,) * 3
        low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
        return middle, low, high

    def cost(self, setting):
        return self.cached(("cost", setting), lambda: self.costs(setting)[0])

    def errors(self, setting, seeds, level):
        """Of those of the seeds that were run, with this reference too."""
        pairs = [(self.row(setting, seed), self.row(REFERENCE[level], seed)) for seed in seeds] if level >= 0 else []
        return tuple(outcomes.error(*pair) for pair in pairs if all(pair) and pair[1]["status"] == "ok")

    def interval(self, setting, limit=LIMITS[0]):
        """By as many seeds as the ladder's last step that is whole; None before its first."""
        level = self.level_for(limit)
        def make():
            errors = self.errors(setting, range(1, stats.LADDER[-1] + 1), level)
            whole = [count for count in stats.LADDER if count <= len(errors)]
            return stats.interval(errors[:whole[-1]]) if whole else None
        return self.kept("interval", setting, level, make)

    def fresh(self, setting, limit):
        level = self.level_for(limit)
        def make():
            errors = self.errors(setting, FRESH_SEEDS, level)
            return stats.interval(errors, 1 - (1 - stats.LEVEL) / TRIES) if len(errors) == len(FRESH_SEEDS) else None
        return self.kept("fresh", setting, level, make)

    def verdict(self, setting, limit):
        return self.interval(setting, limit).verdict(limit)

    def settings(self):
        """Those with an interval and a cost, one of each group, from the cheapest. The reference's own are none."""
        def make():
            measured = [s for s in self.rows if s not in REFERENCE and self.one_of(s) == s and
                        all(self.interval(s, limit) for limit in LIMITS)]
            return sorted((s for s in measured if math.isfinite(self.cost(s))), key=self.cost)
        return self.cached("settings", make)

    # Who is named.

    def confirmed_for(self, setting, limit):
        """The widest limit up to this one for which fresh seeds confirm the setting: what is within a limit is within every
        wider one, also if that has a coarser reference. None where there is none."""
        return next((each for each in reversed(LIMITS) if each <= limit and self.is_fine(each) and
                     self.verdict(setting, each) == "within" and self.fresh(setting, each) and
                     self.fresh(setting, each).high <= each), None)

    def named(self, limit):
        """Settings that are certain to be within the limit, from the cheapest."""
        return self.cached(("named", limit), lambda: [s for s in self.settings() if self.confirmed_for(s, limit)])

    def candidates(self, limit):
        """Within the limit by the seeds that choose, and not refused by fresh ones, from the cheapest; after some refusals only
        those that are named."""
        def make():
            within = [s for s in self.settings() if self.verdict(s, limit) == "within"]
            refused = {s for s in within if self.fresh(s, limit) and self.fresh(s, limit).high > limit}
            return [s for s in self.settings() if s in self.named(limit) or
                    len(refused) < TRIES and s in within and s not in refused]
        return self.cached(("candidates", limit), make)

    def winner(self, limit):
        best = next(iter(self.named(limit)), None)
        if best:
            of = self.confirmed_for(best, limit)
            return Winner(limit, best, self.interval(best, of), self.fresh(best, of), "")
        best = next(iter(self.candidates(limit)), None)
        if best:
            why = "not confirmed with fresh seeds" if self.is_fine(limit) else "the reference's bias is above a quarter of the limit"
            return Winner(limit, best, self.interval(best, limit), self.fresh(best, limit), why)
        likely = [s for s in self.settings() if self.interval(s, limit).mean <= limit and not self.fresh(s, limit)]
        if not likely:
            return Winner(limit, None, None, None, "none is within" if self.settings() else "nothing was measured yet")
        found = self.interval(likely[0], limit)
        why = "more seeds are needed" if found.count < stats.LADDER[-1] else "%d seeds do not decide" % found.count
        return Winner(limit, likely[0], found, None, why)

    def winners(self):
        return self.cached("winners", lambda: [self.winner(limit) for limit in LIMITS])

    # What is wanted.

    def missing(self, setting, seeds):
        return [self.point(setting, seed) for seed in seeds if not self.row(setting, seed)]

    def with_reference(self, setting, seeds, limit):
        return self.missing(REFERENCE[max(self.level_for(limit), 0)], seeds) + self.missing(setting, seeds)

    def competitors(self, limit):
        """The cheapest that are likely to be within the limit, are not known to be, and would save something."""
        most = GAIN * min((self.cost(s) for s in self.candidates(limit)), default=math.inf)
        return [s for s in self.settings() if self.cost(s) < most and self.verdict(s, limit) == "open" and
                self.interval(s, limit).mean < LIKELY * limit and self.interval(s, limit).count < stats.LADDER[-1]][:FAVOURITES]

    def more_seeds(self, limit):
        for setting in self.competitors(limit):
            count = next(step for step in stats.LADDER if step > self.interval(setting, limit).count)
            yield from self.with_reference(setting, range(1, count + 1), limit)

    def finer_reference(self, limit):
        """What its bias needs to come below a quarter of the limit: six seeds, then half the step."""
        level = self.level()
        if level > 0 and not self.is_fine(limit):
            lacking = [point for setting in REFERENCE[max(level - 2, 0):level + 1]
                       for point in self.missing(setting, range(1, stats.LADDER[1] + 1))]
            yield from lacking or self.missing(REFERENCE[min(level + 1, len(REFERENCE) - 1)], range(1, stats.LADDER[0] + 1))

    def confirm(self, limit):
        """What the cheapest candidate lacks to be named; where there is none, seeds for those that may become one."""
        found = self.candidates(limit)
        if not found:
            yield from self.more_seeds(limit)
        if found or self.competitors(limit):
            yield from self.finer_reference(limit)
        for setting in found[:1] if self.is_fine(limit) else ():
            yield from self.with_reference(setting, FRESH_SEEDS, limit)

    def improve(self, limit):
        """Seeds for those that may beat the best so far, and its neighbours; no dearer ones of what is within the limit."""
        yield from self.more_seeds(limit)
        known = self.candidates(limit)
        best = known[0] if known else min(self.settings(), key=lambda s: self.interval(s, limit).mean)
        bodies = next((row["bodies_seen"] for row in self.rows_of(BASE) if row["status"] == "ok"), math.inf)
        near = [s for s in neighbours(best, bodies) if not known or work_of(s) < 1.05 * work_of(best)]
        for setting in sorted(near, key=work_of):
            yield from self.missing(setting, range(1, stats.LADDER[0] + 1))

    def wanted(self):
        """Points in the order in which they are wanted, as far as is known now: something certain first, then something
        cheaper. The narrowest limit needs the finest reference, which takes the longest: it comes last."""
        self.refresh()
        first = range(1, stats.LADDER[0] + 1)
        for setting in (REFERENCE[1], BASE, *GRID):
            yield from self.missing(setting, first)
        if self.level() < 0 or not self.settings():
            return
        for setting in REFERENCE[2], REFERENCE[0]:
            yield from self.missing(setting, first)
        for limits in LIMITS[:0:-1], LIMITS[:1]:
            for stage in self.confirm, self.improve:
                for limit in limits:
                    yield from stage(limit)

    def expected(self, point):
        """Seconds that a point takes, by those that were measured: as the same setting, or by steps and iterations."""
        setting = Setting(*(point[name] for name in Setting._fields))
        def make():
            known = [(of, row["took_s"]) for of in self.rows for row in self.rows_of(of) if row["status"] == "ok"]
            return sum(took for _, took in known) / sum(work_of(of) for of, _ in known) if known else 0.0
        same = [row["took_s"] for row in self.rows_of(setting)]
        return sum(same) / len(same) if same else work_of(setting) * self.cached("pace", make)
