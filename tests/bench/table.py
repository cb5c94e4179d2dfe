#!/usr/bin/env python3
"""Prints the tables of a results directory as markdown, or puts them into a file:

    tests/bench/table.py DIR              all tables
    tests/bench/table.py DIR peers small  some
    tests/bench/table.py DIR --write FILE replaces what stands in FILE between the lines
                                          <!-- table NAME DIR --> and <!-- end -->, DIR being the
                                          directory's last part
"""
import argparse
import os
import re
import sys

sys.dont_write_bytecode = True  # nothing is left beside the sources
from results import LIBRARIES, OURS, best, machine, one, read, timed, values


def shown(value, suffix=""):
    """Three digits."""
    if value is None:
        return "–"
    text = "%.3g" % value if abs(value) < 1000 else "{:,.0f}".format(value)
    return text + suffix


def count(value):
    return "{:,.0f}".format(value)


def markdown(head, rows, notes=()):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join(["---"] + ["---:"] * (len(head) - 1)) + " |"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines + [""] + list(notes)) + "\n"


def by_peer(directory, study):
    """Milliseconds: a row for each scene, part that moves, number of boxes and of threads, a column a peer."""
    rows = read(directory, study)
    peers = values(rows, "peer")
    moves = {1: "", 0: ", at rest"}
    cells = {}
    for row in timed(rows):
        cell = cells.setdefault((row["n"], row.get("program", row["scene"]), -row.get("moving", 1), row["threads"]), {})
        cell[row["peer"]] = min(row["median_ms"], cell.get(row["peer"], row["median_ms"]))
    lines = [[scene + moves.get(-moving, ", %g %% moves" % (-100 * moving)), count(n), "%d" % threads] +
             [shown(cell.get(peer)) for peer in peers] for (n, scene, moving, threads), cell in sorted(cells.items())]
    return markdown(["ms a frame", "boxes", "threads"] + peers, lines, [machine(rows)])


def worlds(directory):
    """The dense cubes of the small scenes, as worlds of which a program has many: times of ODE's simplest spaces over ours."""
    rows = [row for row in read(directory, "small") if row["scene"] == "dense-cube" and row["moving"] == 1]
    lines = []
    for n in (8, 24, 96):
        ours = one(rows, n=n, peer=OURS)["median_ms"]
        lines.append([count(n), shown(1000 * ours)] + [shown(one(rows, n=n, peer=peer)["median_ms"] / ours, "×")
                                                       for peer in ("dSimpleSpace", "dHashSpace")])
    return markdown(["geoms", "us a collide", "faster than dSimpleSpace", "faster than dHashSpace"], lines, [machine(rows)])


def memory(directory):
    """Bytes of the space by its own account, on one thread."""
    rows = read(directory, "memory")
    cells = {(row["n"], row["peer"]): row for row in rows}
    lines = [[count(n), shown(cells[n, OURS]["pairs"] / n)] + [count(cells[n, peer]["own_bytes"] / n) for peer in (OURS, OURS + ":contacts")]
             for n in values(rows, "n")]
    return markdown(["geoms", "pairs a geom", "bytes a geom, `dSpaceCollide`", "bytes a geom, parallel contacts"], lines,
                    ["Commit %s." % rows[0]["commit"]])


def frames(directory):
    """Frames of a program that does something else between them, on a quiet host and on the busiest one."""
    rows = read(directory, "frames")
    sizes = values(rows, "n")
    lines = []
    busy = values(rows, "others")
    for others in busy[0], busy[-1]:
        for between, of in ("nothing", (0, 0)), ("16 ms of sleep", (16, 0)), ("5 ms of work", (0, 5)):
            line = [between, str(others)]
            for n in sizes:
                cells = [one(rows, others=others, sleep_ms=of[0], work_ms=of[1], n=n, threads=threads) for threads in (0, 1)]
                line += [shown(cell and cell["mean_ms"]) for cell in cells]
            lines.append(line)
    heads = [head for n in sizes for head in (count(n) + " boxes", "1 thread")]
    return markdown(["between frames", "busy processes"] + heads, lines, [machine(rows)])


def certain_gain(rows, base):
    """The option that takes least, if that is less for its median frame than the base takes for its quickest."""
    gains = [row for row in rows if row["median_ms"] < base["least_ms"]]
    if not gains:
        return "none of these"
    best = min(gains, key=lambda row: row["median_ms"])
    threads = " on %d threads" % best["threads"] if best["threads"] > 1 else ""
    return "%s%s, %s" % (best["option"], threads, shown(base["median_ms"] / best["median_ms"], "×"))


def traces(directory):
    """Other people's programs by their traces: ODE's hash space, ours as it comes, and what an option adds."""
    rows = read(directory, "traces")
    lines = []
    for program in values(rows, "program"):
        pairs = [row for row in rows if row["program"] == program and row["collides"] == 0]
        both = [row for row in rows if row["program"] == program and row["collides"] == 1]
        base, serial = one(pairs, option="as traced", threads=1), both[0]
        ode = one(pairs, option="ODE's hash space")
        ours = [row for row in pairs if not row["option"].startswith("ODE's")]
        lines.append([program, count(base["geoms"]), shown(base["pairs"]), shown(1000 * ode["median_ms"]),
                      shown(1000 * base["median_ms"]), shown(ode["median_ms"] / base["median_ms"], "×"),
                      certain_gain(ours, base), shown(1000 * serial["median_ms"]), certain_gain(both, serial)])
    return markdown(["program", "geoms", "pairs a frame", "dHashSpace, us a frame", "ours", "gain", "what would help the pairs",
                     "pairs and dCollide, us", "what would help these"], lines, [machine(rows)])


def nearest(directory):
    """Our time, the nearest other library with its time, and how many times faster ours is, for numbers of boxes and threads."""
    groups = ((100000, 1), (100000, 2))
    rows = [row for row in read(directory, "peers") if (row["n"], row["threads"]) in groups]
    lines = []
    for scene in values(rows, "scene"):
        line = [scene]
        for n, threads in groups:
            cell = dict(scene=scene, n=n, threads=threads)
            ours, near = one(rows, peer=OURS, **cell), best(rows, LIBRARIES, **cell)
            line += [shown(ours["median_ms"]), shown(ours["mean_ms"]), shown(ours["max_ms"]), near["peer"], shown(near["median_ms"]),
                     shown(near["median_ms"] / ours["median_ms"], "×")] if ours and near else ["–"] * 6
        lines.append(line)
    heads = [head for n, threads in groups for head in (
        "ours: %s boxes, %d thread%s" % (count(n), threads, "s" if threads > 1 else ""), "mean", "worst", "nearest library", "its ms",
        "times faster")]
    return markdown(["ms a frame"] + heads, lines, [machine(rows)])


def rest(directory):
    """Scenes of which little moves, on one thread."""
    names = {"all-move": "all", "some-move": "the same few", "some-move-notified": "the same few, notified",
             "none-move": "none", "none-move-notified": "none, notified", "others-move": "other few in each frame",
             "skip-asleep": "the same few, asleep skipped",
             "skip-asleep-notified": "the same few, asleep skipped, notified", "skip-static": "the same few, static skipped",
             "tolerance-0.2": "all by 0.01 boxes, tolerance 0.2", "tolerance-0.002": "all by 0.01 boxes, tolerance 0.002"}
    rows = [row for row in read(directory, "rest") if row["threads"] == 1 and row["setting"] in names]
    lines = [[names[row["setting"]], count(row["n"]), count(row["movers"]), shown(row["mean_ms"]), shown(1 / row["ratio"], "×"),
              count(row["pairs"])] for row in rows]
    return markdown(["what moves", "boxes", "moving", "ms a frame", "times faster than all", "pairs reported"], lines,
                    [machine(rows)])


def finder_names(rows, fixed):
    return ["CPU, %d threads" % rows[0]["threads"] if on == 0 else "%d GPU%s" % (on, "s" if on > 1 else "") for on in fixed]


def devices(directory):
    rows = [row for row in read(directory, "devices") if row["scene"] == "cube"]
    fixed = [on for on in values(rows, "on") if on != "auto"]
    names = finder_names(rows, fixed)
    table = []
    for n in values(rows, "n"):
        times = [one(rows, n=n, on=on)["median_ms"] for on in fixed]
        auto = one(rows, n=n, on="auto")["median_ms"]
        table.append([count(n)] + [shown(ms) for ms in times] + [shown(auto), shown(auto / min(times))])
    return markdown(["ms a frame; boxes"] + names + ["Auto", "Auto / the least"], table, [machine(rows)])


def callback(directory):
    """The stages of whole frames, with a callback that counts and with concurrent blocks."""
    rows = read(directory, "collide")
    ways = {"": "CPU, callback", ":concurrent-blocks": "CPU, blocks", ":cuda": "GPU, callback", ":cuda-concurrent-blocks": "GPU, blocks"}
    lines = []
    for n in (100000, 1000000):
        for way, name in ways.items():
            row = one(rows, n=n, peer=OURS + way)
            if row:
                lines.append(["%s boxes, %s" % (count(n), name)] +
                             [shown(row[stage + "_ms"]) for stage in ("update", "extract", "report", "median", "mean", "max")])
    return markdown(["ms", "update", "extract", "report", "all", "mean", "worst"], lines, [machine(rows)])


def step(directory):
    """The whole step in each way, and how many times faster than in ODE's spaces pairs and step are in ours."""
    rows = read(directory, "step")
    stock = ("dHashSpace", "dSweepAndPruneSpace")
    ours = ("the one line", "parallel contacts")
    threads = lambda space: "%d thread%s" % (max(row["threads"] for row in rows if row["space"] == space),
                                             "" if space in stock else "s")
    gain = lambda cell, column, space, other: cell[other] and cell[space] and cell[other][column] / cell[space][column]
    lines, pairs = [], {other: [] for other in stock}
    for bodies in sorted(set(values(rows, "bodies"))):
        cell = {space: one(rows, bodies=bodies, space=space) for space in stock + ours}
        lines.append([count(bodies)] + [shown(row and row["step_ms"]) for row in cell.values()] +
                     [shown(gain(cell, "step_ms", space, other), "×") for space in ours for other in stock])
        for other in stock:
            pairs[other] += [times for times in [gain(cell, "broad_ms", ours[0], other)] if times]
    heads = ["%s, %s" % (space, threads(space)) for space in stock + ours]
    heads += ["%s faster than %s" % (space, other) for space in ("one line", "contacts") for other in stock]
    note = "The pairs alone: %s. %s" % (" and ".join(
        "%s to %s times faster than %s" % (shown(min(times)), shown(max(times)), other) for other, times in pairs.items()), machine(rows))
    return markdown(["boxes; ms a step"] + heads, lines, [note])


def warehouse(directory):
    """A frame of the robots in the warehouse, on the best number of threads, and how many times faster it is than in dHashSpace."""
    rows = read(directory, "warehouse")
    names = {"dHashSpace": "dHashSpace", "bullet-dbvt": "Bullet", "embree": "Embree", OURS: "one line",
             OURS + ":batches": "batches"}
    peers = [peer for peer in names if peer in values(rows, "peer")]
    lines = []
    for n in values(rows, "n"):
        times = [best(rows, [peer], n=n)["median_ms"] for peer in peers]
        others = [(names[peer], ms) for peer, ms in zip(peers, times) if not peer.startswith(OURS)]
        lines.append([count(n)] + [shown(ms) for ms in times] + [shown(ms / times[-1], "×") for _, ms in others])
    heads = [names[peer] for peer in peers] + ["batches faster than %s" % other for other, _ in others]
    return markdown(["shelves; ms a frame"] + heads, lines, ["Below 1×, batches are slower. " + machine(rows)])


def interval(part, whole):
    """Scenes in 10,000 with the 95 % interval of Wilson."""
    z, share = 1.96, part / whole
    middle, spread = share + z * z / (2 * whole), z * (share * (1 - share) / whole + (z / (2 * whole)) ** 2) ** 0.5
    low, high = ((middle + sign * spread) / (1 + z * z / whole) for sign in (-1, 1))
    return "%s (%s–%s)" % tuple(count(10000 * value) for value in (share, low, high))


def stock_spaces(directory):
    """How many scenes ODE's spaces get wrong, by tests/stock_spaces/campaign.cpp."""
    rows = read(directory, "rows")
    faulty = lambda *faults: [space for space in values(rows, "space") if any(
        row["space"] == space and any(row[fault] for fault in faults) for row in rows)]
    spaces = faulty("missed", "invented", "repeated")
    aborting = [space for space in faulty("scenes_aborting") if space not in spaces]
    lines = []
    for scene in values(rows, "scene"):
        cells = []
        for space in spaces:
            row = next(row for row in rows if row["scene"] == scene and row["space"] == space)
            said = [verb + " " + interval(row["scenes_" + what], row["scenes"]) for verb, what in (
                ("misses", "missing"), ("invents", "inventing"), ("repeats", "repeating"), ("aborts", "aborting"))
                if row["scenes_" + what]]
            cells.append(", ".join(said) or "exact")
        lines.append([scene] + cells)
    exact = ", ".join(space + (" (where it does not abort)" if space in aborting else "")
                      for space in values(rows, "space") if space not in spaces)
    touching = sum(row["missed_contacts"] for row in rows) / sum(row["missed"] for row in rows)
    return markdown(["scenes in 10,000 (95 % interval)"] + spaces, lines,
                    ["Exact in all: %s. dCollide finds contacts in %s of the missed pairs. ODE %s; commit %s" %
                     (exact, shown(100 * touching, " %"), rows[0]["ode"], rows[0]["commit"])])


# By name: the function and the file of rows.
TABLES = {"step": (step, "step"), "worlds": (worlds, "small"), "memory": (memory, "memory"), "frames": (frames, "frames"),
          "traces": (traces, "traces"), "devices": (devices, "devices"),
          "warehouse": (warehouse, "warehouse"), "callback": (callback, "collide"),
          "rest": (rest, "rest"), "nearest": (nearest, "peers"), "wrong-scenes": (stock_spaces, "rows")}
for study in ("peers", "rivals", "small", "scaling", "collide", "trace_peers"):
    TABLES[study] = (lambda directory, study=study: by_peer(directory, study)), study


def make(name, directory):
    table, study = TABLES[name]
    return table(directory) if read(directory, study) else None


def write(path, directory):
    label = os.path.basename(os.path.normpath(directory))
    with open(path) as file:
        text = file.read()
    marker = re.compile(r"(<!-- table (\S+) " + re.escape(label) + r" -->\n).*?(<!-- end -->)", re.S)

    def replace(match):
        table = make(match.group(2), directory)
        if table is None:
            sys.exit("%s: no results for the table %s" % (directory, match.group(2)))
        return match.group(1) + "\n" + table + "\n" + match.group(3)

    text, number = marker.subn(replace, text)
    if number == 0:
        sys.exit("%s: no line <!-- table NAME %s -->" % (path, label))
    with open(path, "w") as file:
        file.write(text)
    print("%s: %d tables" % (path, number))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory")
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=", ".join(TABLES))
    parser.add_argument("--write", metavar="FILE")
    options = parser.parse_args()
    for name in options.tables:
        if name not in TABLES:
            parser.error("no table " + name)
    if options.write:
        return write(options.write, options.directory)
    printed = 0
    for name in options.tables or TABLES:
        table = make(name, options.directory)
        if table:
            print("## %s\n\n%s" % (name, table))
            printed += 1
        elif options.tables:
            sys.exit("%s: no results for the table %s" % (options.directory, name))
    if not printed:
        sys.exit("%s: no results" % options.directory)


if __name__ == "__main__":
    main()
