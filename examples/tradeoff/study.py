"""The study of one scene: which runs it wants, one batch after the other, and what it concludes from their rows."""

import math
import statistics
from typing import NamedTuple

LIMITS = (0.2, 0.05, 0.01)
SEEDS = range(1, 7)         # of references; settings are chosen by the first three
FRESH = range(1001, 1021)   # with which nobody was chosen, to confirm
SURE = 3.5                  # standard errors above the mean, to confirm
TRIES = 5                   # settings that fresh seeds may refuse, for each limit
MOST_BIAS = 0.25            # of a limit: by so much a reference may still change
STEADY = 0.8                # references whose runs come no nearer to each other than by this differ by chance
LIKELY = 3                  # of a limit: whose first run is off by more gets no more seeds
NOISE = 1.1                 # costs that differ by less are alike
MARGIN = 1.5                # by so much a cost may be less than expected
AFFORDABLE = 5              # dWorldStep is tried where it takes at most so often the time of 100 iterations
BATCH = 24                  # settings that are tried at a time


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
STEPS = (0.04, 0.025, 0.02, 0.0125, 0.01, 0.00625, 0.005, 0.0025, 0.00125)  # all end with a second
ITERATIONS = (5, 10, 20, 35, 50, 100)
# A setting has one of these at most, so that each answer says what makes it.
KNOBS = dict(contacts=(1, 2, 8), reducer=("deepest", "spread"), sleep=("on",), erp=(0.1, 0.4, 0.8), cfm=(1e-8, 1e-6, "step/mass"))
WORDS = dict(contacts="at most %s contacts", reducer="the %s contacts", sleep="sleeping %s", erp="ERP %s", cfm="CFM %s")
# References, each of half the step of the one before; twice the iterations, as steps alone would not show that these are too few.
EXACT = [Setting(0.01 / 2 ** i, contacts=8, solver="step") for i in range(7)]
ITERATED = [Setting(0.01 / 2 ** i, 100, 8) for i in range(5)]
TWICE = [reference._replace(iterations=200) for reference in ITERATED]
REFERENCES = {*EXACT, *ITERATED, *TWICE}  # whoever is one has no error, and is no answer


def knobs_of(setting):
    return [name for name in KNOBS if getattr(setting, name) != getattr(BASE, name)]


def plain(setting):
    return BASE._replace(dt=setting.dt, iterations=setting.iterations, solver=setting.solver)


def work_of(setting):
    return setting._replace(erp=BASE.erp, cfm=BASE.cfm)  # these change no work


def name_of(setting):
    """In words; of what is as in the base only step and iterations."""
    solver = "dWorldStep" if setting.solver == "step" else "%g iterations" % setting.iterations
    values = [(name, getattr(setting, name)) for name in knobs_of(setting) if setting not in REFERENCES]
    return ", ".join(["%g ms" % (1000 * setting.dt), solver] +
                     [WORDS[name] % (value if isinstance(value, str) else "%g" % value) for name, value in values])


def percent(share):
    return "%.2g %%" % (100 * share) if share < 0.995 else "100 %"


def differences(row, reference):
    """Of a run from the reference's run of the same seed, by outcome, as shares with their signs."""
    if row["status"] != "ok" or reference["status"] != "ok":
        return {"failed": 1.0}
    off = {name: row[name] - reference[name] for name in reference if name.startswith("outcome_") and reference[name] != ""}
    return {name: max(-1.0, min(1.0, value)) if math.isfinite(value) else 1.0 for name, value in off.items()}


def error(row, reference):
    """The largest difference: what a user would notice first."""
    return max(map(abs, differences(row, reference).values()), default=0.0)


def at_most(errors, sure):
    return min(1.0, statistics.fmean(errors) + sure * statistics.stdev(errors) / math.sqrt(len(errors)))


class Answer(NamedTuple):
    """The simplest of the cheapest settings within a limit, or None; `why` says what it lacks to be certain."""
    setting: object = None
    errors: object = None
    why: str = "not known yet"


class Study:
    def __init__(self):
        self.rows = {}         # by setting and seed; who drives search() adds them
        self.spent = {}        # costs of the rows, by the work of their settings
        self.answers = dict.fromkeys(LIMITS, Answer())
        self.references = {}   # of the limits for which one has converged
        self.exact = False     # dWorldStep is affordable
        self.patience = None   # processor seconds that the runs now wanted may take

    def add(self, setting, seed, row):
        self.rows[setting, seed] = row
        if row["status"] == "ok":
            self.spent.setdefault(work_of(setting), []).append(row["ms_per_s"])

    # What follows from rows.

    def errors(self, setting, seeds, limit):
        return [error(self.rows[setting, seed], self.rows[self.references[limit], seed]) for seed in seeds]

    def costs(self, setting):
        """Processor milliseconds a simulated second: the median over all rows of the same work, and its quartiles."""
        low, middle, high = statistics.quantiles(2 * self.spent.get(work_of(setting), [0.0]), n=4)
        return middle, low, high

    def cost(self, setting):
        return self.costs(setting)[0]

    def change(self, one, other):
        """How far two references are from each other: on average over the seeds, in which chance cancels, and in single runs."""
        apart = [differences(self.rows[one, seed], self.rows[other, seed]) for seed in SEEDS]
        names = {name for parts in apart for name in parts}
        mean = max((abs(statistics.fmean(parts.get(name, 1.0) for parts in apart)) for name in names), default=0.0)
        return mean, statistics.fmean(max(map(abs, parts.values()), default=0.0) for parts in apart)

    # Generators of the runs that are wanted, as lists of settings and seeds.

    def search(self):
        """From the widest limit to the narrowest, which needs the finest reference and takes the longest."""
        yield [(BASE, seed) for seed in SEEDS[:3]] + [(ITERATED[0], 1)]
        self.patience = 1 + AFFORDABLE * self.rows[ITERATED[0], 1]["took_s"]
        yield [(EXACT[0], 1)]
        self.patience, self.exact = None, self.rows[EXACT[0], 1]["status"] == "ok"
        settings = yield from self.in_order()
        for limit in LIMITS:
            yield from self.converge(limit)
            if limit not in self.references:
                self.answers.update({narrower: self.answers[limit] for narrower in LIMITS if narrower < limit})
                return
            yield from self.cheapest(settings, limit)

    def in_order(self):
        """All settings, with the costs that they are expected to have by what each part of them costs in the base."""
        undriven = any(self.rows[BASE, seed].get("undriven") for seed in SEEDS[:3])
        knobs = [{name: value} for name, values in KNOBS.items() if name != "sleep" or undriven for value in values]
        solvers = [dict(iterations=count) for count in ITERATIONS] + [dict(solver="step")] * self.exact
        parts = [BASE._replace(**part) for part in knobs + solvers]
        yield [(part, seed) for part in parts if work_of(part) == part for seed in SEEDS[:3]]
        def expected(dt, *parts):
            return math.prod(self.cost(BASE._replace(**part)) for part in parts) / (self.cost(BASE) or 1.0) * BASE.dt / dt
        settings = ((expected(dt, solver, knob), BASE._replace(dt=dt, **solver, **knob))
                    for dt in STEPS for solver in solvers for knob in [{}] + knobs)
        return sorted((pair for pair in settings if pair[1] not in REFERENCES), key=lambda pair: pair[0])

    def converge(self, limit):
        """Halves the reference's step until halving it, and twice its iterations, change little: three steps, as two may agree
        by chance."""
        references = EXACT if self.exact else ITERATED
        for coarse, middle, fine in zip(references, references[1:], references[2:]):
            checks = [] if self.exact else [TWICE[ITERATED.index(fine)]]
            yield [(reference, seed) for reference in (coarse, middle, fine, *checks) for seed in SEEDS]
            (before, far), (now, near) = self.change(coarse, middle), self.change(middle, fine)
            bias = max([before / 2, now] + [self.change(fine, check)[0] for check in checks])
            if bias <= MOST_BIAS * limit and near <= limit:
                self.references[limit] = fine
                return
            hopeless = max(limit, STEADY * far) < near < 0.9
            why = "single runs differ by " + percent(near) if hopeless else "it may be off by " + percent(bias)
            self.answers[limit] = Answer(why="no converged reference: with %s %s" % (name_of(fine), why))
            if hopeless:
                return

    def screen(self, settings, limit):
        """Those that are within the limit by the mean of three seeds, but for those whose knob changes nothing."""
        yield [(of, SEEDS[0]) for setting in settings for of in (plain(setting), setting)]
        def is_new(setting):
            return setting == plain(setting) or error(*(self.rows[of, SEEDS[0]] for of in (plain(setting), setting)))
        near = [setting for setting in settings if is_new(setting) and self.errors(setting, SEEDS[:1], limit)[0] <= LIKELY * limit]
        yield [(setting, seed) for setting in near for seed in SEEDS[:3]]
        return [setting for setting in near if statistics.fmean(self.errors(setting, SEEDS[:3], limit)) <= limit]

    def simplest(self, settings):
        """Of those whose costs are alike the cheapest's."""
        best, _, most = min(map(self.costs, settings))
        alike = [s for s in settings if self.cost(s) <= max(NOISE * best, most) or self.costs(s)[1] <= best]
        return min(alike, key=lambda s: (len(knobs_of(s)), self.cost(s)))

    def cheapest(self, settings, limit):
        """Every setting that could be cheaper than the best so far is tried; then the simplest of the best with fresh seeds."""
        waiting, within, refused = list(settings), [], 0
        while True:
            best = min(map(self.cost, within), default=math.inf)
            if waiting and waiting[0][0] <= MARGIN * best:
                within += yield from self.screen([setting for _, setting in waiting[:BATCH]], limit)
                del waiting[:BATCH]
                continue
            if not within or refused == TRIES:
                why = "fresh seeds refuse %d that seemed to be within" % refused if refused else "none is within"
                self.answers[limit] = Answer(why=why)
                return
            setting = self.simplest(within)
            simpler = [s for s in within if knobs_of(setting) and not knobs_of(s) and self.cost(s) <= MARGIN * self.cost(setting)]
            if simpler:  # costs of different times differ by what else the machine did: these are of one time
                pair = setting, min(simpler, key=self.cost)
                yield [(of, seed) for seed in FRESH for of in pair]
                setting = self.simplest(pair)
            self.answers[limit] = Answer(setting, why="not confirmed")
            yield [(setting, seed) for seed in SEEDS]
            if at_most(self.errors(setting, SEEDS, limit), 2) <= limit:
                yield [(of, seed) for of in (self.references[limit], setting) for seed in FRESH]
                errors = self.errors(setting, FRESH, limit)
                if at_most(errors, SURE) <= limit:
                    known = Answer(setting, errors, "")  # within every wider limit, too
                    self.answers.update({each: known for each in LIMITS if each >= limit and not self.answers[each].errors})
                    return
                refused += 1
            within.remove(setting)

    # What is known, as rows of tables.

    def trade(self):
        """Cost, error and setting of all that were tried, by up to three seeds."""
        limit = min(self.references, default=None)
        tried = {of for of, seed in self.rows if seed == 1} - REFERENCES if limit else ()
        def off(setting):
            return statistics.fmean(self.errors(setting, [seed for seed in SEEDS[:3] if (setting, seed) in self.rows], limit))
        return sorted(((self.cost(s), off(s), s) for s in tried if self.cost(s) > 0), key=lambda row: row[:2])

    def lines(self, title):
        """The answers; limits with the same share a row."""
        same = {}
        for limit in reversed(LIMITS):
            same.setdefault((self.answers[limit].setting, self.answers[limit].why), []).append(limit)
        for (setting, why), limits in same.items():
            cells = [title, "%s %%" % ", ".join("%g" % (100 * limit) for limit in limits), why, "", ""]
            if setting:
                errors = self.answers[limits[0]].errors
                cells[2:] = [name_of(setting) + (" (%s)" % why if why else ""), "%.3g" % self.cost(setting),
                             "%s (%s)" % (percent(statistics.fmean(errors)), percent(at_most(errors, SURE))) if errors else ""]
            yield "| %s |" % " | ".join(cells)
