#!/usr/bin/env python3
"""Tables of recorded rows as markdown. In a document one stands between <!-- table NAME FOLDER --> and <!-- end -->, with
FOLDER below tests/bench/results, or a folder of tests/ itself.

    tests/bench/table.py                  makes those of all documents anew
    tests/bench/table.py --check          ends with 1 if one is another than its rows make
    tests/bench/table.py DIR [TABLE]...   prints those of a directory of rows
"""
import csv
import math
import pathlib
import re
import statistics
import sys

TESTS = pathlib.Path(__file__).resolve().parents[1]
PROJECT = TESTS.parent
OURS = "parallel-sap"
LIBRARIES = ("embree", "embree-default", "bullet-dbvt", "fcl-tree")  # peers that are not ODE's
TABLES = {}  # by name: a function of rows and directory, and the file of the rows


def table(*names, study=None):
    def register(function):
        TABLES.update({name: (function, study or name) for name in names})
        return function
    return register


def cell(column, text):
    try:
        return text if column == "commit" else float(text)  # a commit may look like a number: 3e04000
    except (TypeError, ValueError):
        return text or None


def read(directory, study):
    """The rows of a study, numbers as floats, empty cells as None; [] if it was not run."""
    path = pathlib.Path(directory, study + ".csv")
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # Columns added to a file by a later version would shift silently.
    if any(None in row or None in row.values() for row in rows):
        sys.exit("%s: a row with another number of columns" % path)
    return [{key: cell(key, value) for key, value in row.items()} for row in rows]


def timed(rows, **wanted):
    """Rows that were timed and have these values."""
    return [row for row in rows if row.get("status", "ok") == "ok" and
            any(row.get(name) is not None for name in ("median_ms", "step_ms")) and
            all(row[key] == value for key, value in wanted.items())]


def one(rows, **wanted):
    return next(iter(timed(rows, **wanted)), None)


def best(rows, peers, **wanted):
    """The quickest of the peers."""
    found = [row for row in timed(rows, **wanted) if row["peer"] in peers]
    return min(found, key=lambda row: row["median_ms"], default=None)


def values(rows, column):
    """The distinct values of a column, in the order in which they come."""
    return list(dict.fromkeys(row[column] for row in rows))


def machine(rows):
    row = rows[0]
    gpu = ", %s (driver %s)" % (row["gpu"], row["driver"]) if row.get("gpu") else ""
    compiler = "; %s %s" % (row["compiler"], row["flags"]) if "compiler" in row else ""
    commits = ", ".join(sorted({row["commit"] or "unknown" for row in rows}))
    return "%s, %d cores%s%s; commit %s, %s" % (row["cpu"], row["cores"], gpu, compiler, commits, max(row["date"] for row in rows))


def shown(value, suffix=""):
    """Three digits."""
    if value is None:
        return "–"
    return ("%.3g" % value if abs(value) < 1000 else count(value)) + suffix


def count(value):
    return "{:,.0f}".format(value)


def percent(value):
    value *= 100
    return "0" if value < 1e-5 else "%.2g" % value if value < 99.5 else "%.0f" % value


def markdown(head, rows, *notes, words=1):
    """Of `words` columns of words, and others of numbers."""
    rule = ["---"] * words + ["---:"] * (len(head) - words)
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in [head, rule] + rows]
    return "\n".join(lines + [line for note in notes for line in ("", note)]) + "\n"


@table("peers", "rivals", "small", "scaling", "collide", "trace_peers")
def by_peer(rows, _):
    """Milliseconds: a row for each scene, part that moves, number of boxes and of threads, a column a peer."""
    peers = values(rows, "peer")
    moves = {1: "", 0: ", at rest"}
    cells = {}
    for row in timed(rows):
        times = cells.setdefault((row["n"], row.get("program", row["scene"]), -row.get("moving", 1), row["threads"]), {})
        times[row["peer"]] = min(row["median_ms"], times.get(row["peer"], row["median_ms"]))
    lines = [[scene + moves.get(-moving, ", %g %% moves" % (-100 * moving)), count(n), "%d" % threads] +
             [shown(times.get(peer)) for peer in peers] for (n, scene, moving, threads), times in sorted(cells.items())]
    return markdown(["ms a frame", "boxes", "threads"] + peers, lines, machine(rows))


@table("worlds", study="small")
def worlds(rows, _):
    """The dense cubes of the small scenes, as worlds of which a program has many: times of ODE's simplest spaces over ours."""
    rows = [row for row in rows if row["scene"] == "dense-cube" and row["moving"] == 1]
    lines = []
    for n in (8, 24, 96):
        ours = one(rows, n=n, peer=OURS)["median_ms"]
        lines.append([count(n), shown(1000 * ours)] + [shown(one(rows, n=n, peer=peer)["median_ms"] / ours, "×")
                                                       for peer in ("dSimpleSpace", "dHashSpace")])
    return markdown(["geoms", "us a collide", "faster than dSimpleSpace", "faster than dHashSpace"], lines, machine(rows))


@table("memory")
def memory(rows, _):
    """Bytes of the space by its own account, on one thread."""
    cells = {(row["n"], row["peer"]): row for row in rows}
    lines = [[count(n), shown(cells[n, OURS]["pairs"] / n)] + [count(cells[n, peer]["own_bytes"] / n) for peer in (OURS, OURS + ":contacts")]
             for n in values(rows, "n")]
    return markdown(["geoms", "pairs a geom", "bytes a geom, `dSpaceCollide`", "bytes a geom, parallel contacts"], lines,
                    "Commit %s." % rows[0]["commit"])


@table("frames")
def frames(rows, _):
    """Frames of a program that does something else between them, on a quiet host and on the busiest one."""
    sizes, busy = [n for n in values(rows, "n") if n != 20000], values(rows, "others")
    lines = []
    for others in busy[0], busy[-1]:
        for between, sleep, work in ("nothing", 0, 0), ("16 ms of sleep", 16, 0), ("5 ms of work", 0, 5):
            cells = [one(rows, others=others, sleep_ms=sleep, work_ms=work, n=n, threads=threads) for n in sizes for threads in (0, 1)]
            lines.append([between, count(others)] + [shown(row and row["mean_ms"]) for row in cells])
    heads = [head for n in sizes for head in (count(n) + " boxes", "1 thread")]
    return markdown(["between frames", "busy processes"] + heads, lines, machine(rows))


def certain_gain(rows, base):
    """The option that takes least, if that is less for its median frame than the base takes for its quickest."""
    gain = min((row for row in rows if row["median_ms"] < base["least_ms"]), key=lambda row: row["median_ms"], default=None)
    if not gain:
        return "none"
    threads = " on %d threads" % gain["threads"] if gain["threads"] > 1 else ""
    return "%s%s, %s" % (gain["option"], threads, shown(base["median_ms"] / gain["median_ms"], "×"))


@table("traces")
def traces(rows, _):
    """Other people's programs by their traces: ODE's hash space, ours as it comes, and what an option adds to contacts."""
    lines = []
    for program in values(rows, "program"):
        pairs, both = ([row for row in rows if row["program"] == program and row["collides"] == collides] for collides in (0, 1))
        base, serial = one(pairs, option="as traced", threads=1), both[0]
        ode = one(pairs, option="ODE's hash space")
        lines.append([program, count(base["geoms"]), shown(base["pairs"]), shown(1000 * ode["median_ms"]),
                      shown(1000 * base["median_ms"]), shown(ode["median_ms"] / base["median_ms"], "×"),
                      shown(1000 * serial["median_ms"]), certain_gain(both, serial)])
    return markdown(["program", "geoms", "pairs a frame", "dHashSpace, us a frame", "ours", "gain", "pairs and dCollide, us",
                     "best option"], lines, machine(rows))


@table("nearest", study="peers")
def nearest(rows, _):
    """Our time, the nearest other library with its time, and how many times faster ours is, for numbers of boxes and threads."""
    groups = ((100000, 1), (100000, 2))
    rows = [row for row in rows if (row["n"], row["threads"]) in groups]
    lines = []
    for scene in values(rows, "scene"):
        line = [scene]
        for n, threads in groups:
            wanted = dict(scene=scene, n=n, threads=threads)
            ours, near = one(rows, peer=OURS, **wanted), best(rows, LIBRARIES, **wanted)
            line += [shown(ours["median_ms"]), shown(ours["mean_ms"]), shown(ours["max_ms"]), near["peer"], shown(near["median_ms"]),
                     shown(near["median_ms"] / ours["median_ms"], "×")] if ours and near else ["–"] * 6
        lines.append(line)
    heads = [head for n, threads in groups for head in (
        "ours: %s boxes, %d thread%s" % (count(n), threads, "s" if threads > 1 else ""), "mean", "worst", "nearest library", "its ms",
        "times faster")]
    return markdown(["ms a frame"] + heads, lines, machine(rows))


@table("rest")
def rest(rows, _):
    """Scenes of which little moves, on one thread: (scene, whether all, few or none move, peer)."""
    ways = {("shaking", 1, ""): "all", ("shaking", 0.5, ""): "the same few", ("shaking", 0.5, ":notified"): "the same few, notified",
            ("shaking", 0, ""): "none", ("shaking", 0, ":notified"): "none, notified", ("some-shaking", 1, ""): "other few in each frame",
            ("shaking", 0.5, ":skip-asleep"): "the same few, asleep skipped",
            ("shaking", 0.5, ":notified-skip-asleep"): "the same few, asleep skipped, notified",
            ("shaking", 0.5, ":skip-static"): "the same few, static skipped",
            ("shaking", 1, ":tolerance-0.2"): "all by 0.01 boxes, tolerance 0.2",
            ("shaking", 1, ":tolerance-0.002"): "all by 0.01 boxes, tolerance 0.002"}
    lines = []
    for n in values(rows, "n"):
        cells = {(row["scene"], math.ceil(2 * row["moving"]) / 2 if row["moving"] < 0.5 else 1, row["peer"][len(OURS):]): row
                 for row in timed(rows, n=n, threads=1)}
        for way, name in ways.items():
            if way in cells:
                row = cells[way]
                lines.append([name, count(n), count(n * (0.01 if way[0] == "some-shaking" else row["moving"])), shown(row["mean_ms"]),
                              shown(cells["shaking", 1, ""]["mean_ms"] / row["mean_ms"], "×"), count(row["pairs"] + (row["extra_pairs"] or 0))])
    return markdown(["what moves", "boxes", "moving", "ms a frame", "times faster than all", "pairs reported"], lines, machine(rows))


@table("devices")
def devices(rows, _):
    rows = [row for row in rows if row["scene"] == "cube"]
    fixed = [on for on in values(rows, "on") if on != "auto"]
    names = ["CPU, %d threads" % rows[0]["threads"] if on == 0 else "%d GPU%s" % (on, "s" if on > 1 else "") for on in fixed]
    lines = []
    for n in [n for n in values(rows, "n") if n == 100 or n >= 1000]:  # below, Auto is the CPU
        times = [one(rows, n=n, on=on)["median_ms"] for on in fixed]
        auto = one(rows, n=n, on="auto")["median_ms"]
        lines.append([count(n)] + [shown(ms) for ms in times] + [shown(auto), shown(auto / min(times))])
    return markdown(["ms a frame; boxes"] + names + ["Auto", "Auto / the least"], lines, machine(rows))


@table("callback", study="collide")
def callback(rows, _):
    """The stages of whole frames, with a callback that counts and with concurrent blocks."""
    ways = {"": "CPU, callback", ":concurrent-blocks": "CPU, blocks", ":cuda": "GPU, callback", ":cuda-concurrent-blocks": "GPU, blocks"}
    cells = [(n, name, one(rows, n=n, peer=OURS + way)) for n in (100000, 1000000) for way, name in ways.items()]
    lines = [["%s boxes, %s" % (count(n), name)] + [shown(row[stage + "_ms"]) for stage in ("update", "extract", "report", "median", "mean", "max")]
             for n, name, row in cells if row]
    return markdown(["ms", "update", "extract", "report", "all", "mean", "worst"], lines, machine(rows))


@table("step")
def step(rows, _):
    """The whole step in each way, and how many times faster than in ODE's spaces pairs and step are in ours."""
    stock = ("dHashSpace", "dSweepAndPruneSpace")
    ours = ("the one line", "parallel contacts")
    threads = lambda space: "%d thread%s" % (max(row["threads"] for row in rows if row["space"] == space),
                                             "" if space in stock else "s")
    gain = lambda cells, column, space, other: cells[other] and cells[space] and cells[other][column] / cells[space][column]
    lines, pairs = [], {other: [] for other in stock}
    for bodies in sorted(set(values(rows, "bodies"))):
        cells = {space: one(rows, bodies=bodies, space=space) for space in stock + ours}
        lines.append([count(bodies)] + [shown(row and row["step_ms"]) for row in cells.values()] +
                     [shown(gain(cells, "step_ms", space, other), "×") for space in ours for other in stock])
        for other in stock:
            pairs[other] += [times for times in [gain(cells, "broad_ms", ours[0], other)] if times]
    heads = ["%s, %s" % (space, threads(space)) for space in stock + ours]
    heads += ["%s faster than %s" % (space, other) for space in ("one line", "contacts") for other in stock]
    return markdown(["boxes; ms a step"] + heads, lines, "Finding pairs alone is %s. %s" % (" and ".join(
        "%s to %s times faster than %s" % (shown(min(times)), shown(max(times)), other) for other, times in pairs.items()), machine(rows)))


@table("warehouse")
def warehouse(rows, _):
    """A frame of the robots in the warehouse, on the best number of threads, and how many times faster it is than in dHashSpace."""
    names = {"dHashSpace": "dHashSpace", "bullet-dbvt": "Bullet", "embree": "Embree", OURS: "one line",
             OURS + ":batches": "batches"}
    peers = [peer for peer in names if peer in values(rows, "peer")]
    others = [peer for peer in peers if not peer.startswith(OURS)]
    lines = []
    for n in values(rows, "n"):
        times = {peer: best(rows, [peer], n=n)["median_ms"] for peer in peers}
        lines.append([count(n)] + [shown(times[peer]) for peer in peers] + [shown(times[peer] / times[peers[-1]], "×") for peer in others])
    heads = [names[peer] for peer in peers] + ["batches faster than %s" % names[peer] for peer in others]
    return markdown(["shelves; ms a frame"] + heads, lines, "Below 1×, batches are slower. " + machine(rows))


def interval(part, whole):
    """Scenes in 10,000 with the 95 % interval of Wilson."""
    z, share = 1.96, part / whole
    middle, spread = share + z * z / (2 * whole), z * (share * (1 - share) / whole + (z / (2 * whole)) ** 2) ** 0.5
    low, high = ((middle + sign * spread) / (1 + z * z / whole) for sign in (-1, 1))
    return "%s (%s–%s)" % tuple(count(10000 * value) for value in (share, low, high))


@table("wrong-scenes", study="rows")
def stock_spaces(rows, _):
    """How many scenes ODE's spaces get wrong, by tests/stock_spaces/campaign.cpp."""
    names = values(rows, "space")
    spaces, aborting = ([space for space in names if any(row["space"] == space and any(row[fault] for fault in faults) for row in rows)]
                        for faults in (("missed", "invented", "repeated"), ("scenes_aborting",)))
    cells = {}
    for row in rows:
        said = [verb + " " + interval(row["scenes_" + what], row["scenes"]) for verb, what in (
            ("misses", "missing"), ("invents", "inventing"), ("repeats", "repeating"), ("aborts", "aborting")) if row["scenes_" + what]]
        cells[row["scene"], row["space"]] = ", ".join(said) or "exact"
    lines = [[scene] + [cells[scene, space] for space in spaces] for scene in values(rows, "scene")]
    exact = ", ".join(space + (" (where it does not abort)" if space in aborting else "") for space in names if space not in spaces)
    touching = sum(row["missed_contacts"] for row in rows) / sum(row["missed"] for row in rows)
    return markdown(["scenes in 10,000 (95 % interval)"] + spaces, lines,
                    "Exact in all: %s. dCollide finds contacts in %s of the missed pairs. ODE %s; commit %s" %
                    (exact, shown(100 * touching, " %"), rows[0]["ode"], rows[0]["commit"]))


@table("ablation")
def ablation(rows, _):
    """Time without a mechanism over the median of all libraries, which is steadier than one library, as most mechanisms have
    nothing to do in a cell; where it did not run the cell does not count. The machine was unsteady in a cell in which libraries
    that do the same differ."""
    most_spread = 1.1
    mechanisms = re.findall(r"\nconstexpr bool (\w+) = true;", (PROJECT / "space/base/mechanisms.h").read_text("utf-8"))
    times, by_name, unsteady = {}, {}, 0
    for row in rows:
        times.setdefault(row["cell"], {"whole": (row["ms"], True)})[row["without"]] = (row["ms_without"], row["runs"] != 0)
    for cell_name, of in times.items():
        same = [of[name][0] for name in ("whole", "nothing") if name in of]
        if max(same) > most_spread * min(same):
            unsteady += 1
            continue
        middle = statistics.median(ms for ms, _ in of.values())
        for name, (ms, ran) in of.items():
            if ran:
                by_name.setdefault(name, []).append((ms / middle, re.sub(r"^pair | threads=1| moving=1|(scene|setting|kind)s?=", "", cell_name)))
    noise = sorted(ratio for name in ("whole", "nothing") for ratio, _ in by_name[name])
    least_noise, most_noise = noise[len(noise) // 40], noise[-1 - len(noise) // 40]
    lines = []
    for name in (name for name in mechanisms if name in by_name):
        ratios = by_name[name]
        (most, at_best), (least, at_worst) = max(ratios), min(ratios)
        mean = math.exp(sum(math.log(ratio) for ratio, _ in ratios) / len(ratios))
        lines.append(["`%s`" % name, "%.3f" % mean, len(ratios), sum(ratio > most_noise for ratio, _ in ratios), "%.2f" % most, at_best,
                      "%.2f" % least, at_worst])
    return markdown(["without", "mean", "cells it ran in", "gains", "most", "there", "least", "there"], lines,
                    "%d cells, %d others were unsteady. Noise, from 95 %% of the cells of the library made twice: %.2f to %.2f." % (
                        len(by_name["whole"]), unsteady, least_noise, most_noise))


def by_setting(rows, heads, names, text):
    """A line for each name, a column for each setting."""
    settings, groups = values(rows, "setting"), {}
    for row in rows:
        groups.setdefault(names(row), {})[row["setting"]] = text(row)
    return markdown(heads + settings, [[*name] + [cells.get(setting, "") for setting in settings] for name, cells in groups.items()],
                    words=len(heads))


def ranged(row):
    return "%s (%s–%s)" % tuple(percent(row[name]) for name in ("error", "least", "most"))


@table("trades", study="truth")
def trades(rows, _):
    """What a step costs, the median over scenes; errors in percent; of those that starts change much, the range."""
    costs, first = {}, {}
    own = {row["scene"]: row["us_a_step"] for row in rows if row["setting"] == "as ODE comes"}
    for row in rows:
        costs.setdefault(row["setting"], []).append(row["us_a_step"] / own[row["scene"]])
        first.setdefault(row["of"], row["scene"] + row["quantity"])
    costs = [dict(setting=setting, cost=sorted(found)[len(found) // 2]) for setting, found in costs.items()]

    def text(row):
        if "cost" in row:
            return "%.2g" % row["cost"]
        if row["quantity"] == "half-life":
            return "%.2g s" % abs(row["value"])
        return ranged(row) if row["scene"] == "elastic balls" else percent(row["error"])

    def names(row):
        if "cost" in row:
            return "cost of a step", ""
        said = "%s: %.2g" % (row["quantity"], row["exact"])
        if row["quantity"] == "half-life":
            said = "%s, %.2g s at 10 ms" % ("doubles" if row["value"] < 0 else "halves", abs(row["exact"]) * row["dt"] / 0.01)
        of = ": " + row["of"] if first[row["of"]] == row["scene"] + row["quantity"] else ""
        return row["scene"].replace(" degrees", "°") + of, said

    return by_setting(costs + rows, ["scene", "quantity: truth"], names, text)


@table("swept")
def swept(rows, _):
    """Of scenes that differ by a number, the one in which swept contacts are worst."""
    names = lambda row: (row["scene"].split(": ")[0], row["quantity"])
    errors, worst = {}, {}
    for row in rows:
        errors.setdefault((row["scene"], row["quantity"]), []).insert(0, row["error"])
    for row in rows:
        found = errors[row["scene"], row["quantity"]], row["scene"]
        worst[names(row)] = max(worst.get(names(row), found), found)
    return by_setting([row for row in rows if worst[names(row)][1] == row["scene"]], ["scene", "error"], names, ranged)


@table("machines")
def machines(rows, _):
    names = lambda row: (row["machine"] + ("" if row["step_s"] == 0.01 else ", %g ms" % (1000 * row["step_s"])),)
    return by_setting(rows, ["machine"], names, lambda row: "%d (%s)" % (row["held"], percent(row["off"])))


@table("thresholds", study="double")
def thresholds(_, directory):
    """Of each series, up to where all ten starts do what they owe, and from where on none does."""
    series = {"mass that a box bears, in its own": r"a box on one as large, 1:(\S+) of its mass", "boxes in a stack": r"a stack of (\d+)",
              "step of a stack of 5, s": r"a stack of 5, steps of (\S+) s",
              "speed of 0.2 m at a plate of 0.1 m, m/s": r"boxes of 0.2 m at a plate.* (\d+) m/s"}
    lines = []
    for title, pattern in series.items():
        lines.append([title])
        for precision in "double", "single":
            matches = [(re.fullmatch(pattern, row["extreme"]), row["held"]) for row in read(directory, precision)]
            found = [(match[1], held) for match, held in matches if match]
            first = next(number for number, (_, held) in enumerate(found) if held != 10)
            lines[-1] += [found[first - 1][0] if first else "< " + found[0][0], next(value for value, held in found if held == 0)]
    heads = [precision + head for precision in ("double", "single") for head in (" precision: all up to", "")]
    return markdown(["value"] + [head if head.endswith("to") else "none from" for head in heads], lines)


def make(name, directory):
    function, study = TABLES[name]
    rows = read(directory, study)
    return function(rows, directory) if rows else None


def folder_of(label):
    folders = TESTS / "bench/results" / label, TESTS / label / "results", TESTS / label
    return next((folder for folder in folders if folder.is_dir()), None) or sys.exit("no rows of " + label)


def documents(check):
    """Makes the tables of all documents, or tells which are others."""
    def replace(match):
        made = make(match[2], folder_of(match[3]))
        return match[1] + "\n" + (made or sys.exit("%s: no results for the table %s" % (match[3], match[2]))) + "\n" + match[4]

    number, others = 0, []
    paths = [path for path in PROJECT.rglob("*.md") if not re.search(r"(^|/)(build|[.].*)/", str(path.relative_to(PROJECT)))]
    for path in sorted(paths):
        old = path.read_text("utf-8")
        new, found = re.subn(r"(<!-- table ([\w-]+) (\S+) -->\n).*?(<!-- end -->)", replace, old, flags=re.S)
        number += found
        if new != old:
            others.append(str(path.relative_to(PROJECT)))
            if not check:
                path.write_text(new, "utf-8")
    print("%d tables; %s: %s" % (number, "not as their rows" if check else "made anew", ", ".join(others) or "none"))
    sys.exit(1 if check and others or number < 10 else 0)


def main(arguments):
    if arguments in ([], ["--check"]):
        return documents(bool(arguments))
    directory, *names = arguments
    if directory.startswith("-") or set(names) - set(TABLES):
        print(__doc__ + "\nTables: " + ", ".join(TABLES))
        sys.exit(0 if directory in ("-h", "--help") else 2)
    made = {name: make(name, directory) for name in names or TABLES}
    for name, text in made.items():
        if text:
            print("## %s\n\n%s" % (name, text))
        elif names:
            sys.exit("%s: no results for the table %s" % (directory, name))
    if not any(made.values()):
        sys.exit("%s: no results" % directory)


if __name__ == "__main__":
    main(sys.argv[1:])
