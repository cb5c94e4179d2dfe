"""What the study of scenes varies: settings, scenes, the reference, how many seeds."""

import itertools
from typing import NamedTuple

import stats

LIMITS = (0.01, 0.05, 0.2)


class Setting(NamedTuple):
    """The defaults are the base that settings are varied around, one at a time."""
    dt: float = 0.01
    iterations: int = 20
    contacts: int = 4
    reducer: str = "first"
    erp: float = 0.2
    cfm: float = 1e-10
    sor: float = 1.3
    solver: str = "quick"
    sleep: str = "off"
    skip: str = "nothing"
    tolerance: float = 0.0
    precision: str = "double"


BASE = Setting()

# What a point of a scene is named by: the columns of its input.
KEY = ("scene", "bodies", "density", *Setting._fields, "seed")

# Of each, besides the base. One at a time.
VARIED = {
    "smoke": dict(contacts=(1,), tolerance=(0.1,)),
    "quick": dict(contacts=(1, 2, 8), reducer=("deepest", "spread"), erp=(0.1, 0.4, 0.8), cfm=(1e-8, 1e-6),
                  sor=(1.0, 1.6), sleep=("on",), skip=("static", "asleep")),
    "full": dict(contacts=(1, 2, 3, 8), reducer=("deepest", "spread"), erp=(0.05, 0.1, 0.4, 0.6, 0.8),
                 cfm=(1e-9, 1e-8, 1e-7, 1e-6, 1e-5), sor=(0.8, 1.0, 1.6, 1.8), sleep=("on",),
                 skip=("static", "asleep", "all"), tolerance=(0.02, 0.1, 0.3)),
}
# Every one with every other.
GRID = {
    "smoke": dict(dt=(0.02,), iterations=(5, 20)),
    "quick": dict(dt=(0.02, 0.01, 0.005), iterations=(5, 20, 50)),
    "full": dict(dt=(0.02, 0.01, 0.005, 0.0025), iterations=(5, 10, 20, 50, 100), contacts=(1, 2, 4, 8)),
}
# dWorldStep takes time by the cube of a heap's contacts: only where the scene is small.
STEPS = (Setting(solver="step"), Setting(solver="step", dt=0.02), Setting(solver="step", dt=0.005))
MOST_BODIES_OF_STEP = 12
# The space takes no notice of a tolerance where there are few geoms.
LEAST_BODIES_OF_TOLERANCE = 121

# The reference is an ensemble: each seed is run once with each of these.
REFERENCE = {
    "smoke": tuple(Setting(dt=dt, iterations=30, contacts=8) for dt in (0.01, 0.008)),
    "quick": tuple(Setting(dt=dt, iterations=60, contacts=8) for dt in (0.004, 0.0032)),
    "full": tuple(Setting(dt=dt, iterations=100, contacts=8) for dt in (0.002, 0.0018, 0.0016)),
}
PLANS = {
    "smoke": stats.Plan(first=4, least=4, more=2, most=6, fresh=6, tries=2),
    "quick": stats.Plan(most=18, fresh=18),
    # Six seeds tell what fails or is far beyond every limit, which most of the settings are.
    "full": stats.Plan(first=6, least=12, more=6, most=24, fresh=24),
}
SCENES = {
    "smoke": dict(tower=3),
    "quick": dict(heap=20, wall=20, tower=10, hopper=30, vehicle=5, meshes=6),
    "full": dict(tower=12, wall=42, vehicle=10, meshes=12, heap=40, hopper=125),
}
DENSITY = 1000.0  # kg/m^3: water, wood, plastics; stone has 2,500, steel 8,000


def settings_of(mode, precisions, bodies):
    """All settings of a scene of so many bodies, each once, the base first. A user's scene has no number of them."""
    grid = GRID[mode]
    found = [BASE]
    found += [BASE._replace(**dict(zip(grid, values))) for values in itertools.product(*grid.values())]
    small = bodies and bodies < LEAST_BODIES_OF_TOLERANCE and mode != "smoke"
    found += [BASE._replace(**{name: value}) for name, values in VARIED[mode].items() for value in values
              if not (small and name == "tolerance")]
    found += [BASE._replace(precision=precision) for precision in precisions]
    if bodies and bodies <= MOST_BODIES_OF_STEP:
        found += STEPS if mode != "smoke" else STEPS[:1]
    return list(dict.fromkeys(found))


def name_of(setting):
    """In words; of what is as in the base only step, iterations and contacts."""
    words = ["steps of %g ms" % (1000 * setting.dt)]
    words.append("dWorldStep" if setting.solver == "step" else "%d iterations" % setting.iterations)
    words.append("%d contact%s a pair" % (setting.contacts, "" if setting.contacts == 1 else "s"))
    known = dict(reducer="the %s contacts", erp="ERP %g", cfm="CFM %g", sor="SOR %g", sleep="sleeping %s", skip="skip %s",
                 tolerance="tolerance %g sizes", precision="%s precision")
    words += [form % getattr(setting, name) for name, form in known.items() if getattr(setting, name) != getattr(BASE, name)]
    return ", ".join(words)


def is_varied_alone(setting):
    """Whether it differs from the base in one thing."""
    return sum(a != b for a, b in zip(setting, BASE)) == 1
