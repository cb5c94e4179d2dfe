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
from results import LIBRARIES, ODE_SPACES, OURS, best, machine, on_devices, one, read, timed, values


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


def peers(directory):
    """Milliseconds of every peer on the dense cube."""
    rows = read(directory, "peers")
    scene = "dense-cube"
    sizes = values(timed(rows, scene=scene), "n")
    lines = []
    for peer in values([row for row in rows if row["scene"] == scene], "peer"):
        for threads in values([row for row in rows if row["peer"] == peer], "threads"):
            cells = [one(rows, scene=scene, peer=peer, threads=threads, n=n) for n in sizes]
            if any(cells):
                lines.append(["%s, %d thread%s" % (peer, threads, "s" if threads > 1 else "")] +
                             [shown(cell and cell["median_ms"]) for cell in cells])
    return markdown(["ms a frame, dense cube"] + [count(n) + " boxes" for n in sizes], lines, [machine(rows)])


def distributions(directory):
    """How many times longer the best library, and the best and the sweep-and-prune space of ODE, take."""
    rows = read(directory, "peers")
    most = max(values(rows, "threads"))
    lines = []
    for scene in values(rows, "scene"):
        for n in values([row for row in rows if row["scene"] == scene], "n"):
            for threads in sorted({1, most}):
                ours = one(rows, scene=scene, n=n, peer=OURS, threads=threads)
                if not ours:
                    continue
                library = best(rows, scene, n, threads, LIBRARIES)
                def times(row):
                    return shown(row and row["median_ms"] / ours["median_ms"], "×") if row else "–"
                lines.append([scene, count(n), "%d" % threads, shown(ours["median_ms"]),
                              shown(ours["ns_per_pair"]), times(library), library["peer"] if library else "–",
                              times(one(rows, scene=scene, n=n, peer="dHashSpace", threads=1)),
                              times(one(rows, scene=scene, n=n, peer="dSweepAndPruneSpace", threads=1))])
    return markdown(["scene", "boxes", "threads", "ms", "ns a pair", "best library", "which", "dHashSpace",
                     "dSweepAndPruneSpace"], lines, [machine(rows)])


def small(directory):
    """Ours against the best space of ODE, all moving and none."""
    rows = read(directory, "small")
    lines = []
    for moving in values(rows, "moving"):
        for scene in values(rows, "scene"):
            some = [row for row in rows if row["moving"] == moving and row["scene"] == scene]
            cells = []
            for n in values(some, "n"):
                ours, other = one(some, n=n, peer=OURS), best(some, scene, n, 1, ODE_SPACES)
                cells.append(shown(other["median_ms"] / ours["median_ms"], "×") if ours and other else "–")
            lines.append(["%s, %s" % (scene, "moving" if moving else "still")] + cells)
    return markdown(["best space of ODE / ours"] + [count(n) for n in values(rows, "n")], lines, [machine(rows)])


def scaling(directory):
    rows = read(directory, "scaling")
    lines = []
    for peer in values(rows, "peer"):
        some = timed(rows, peer=peer)
        first = one(some, threads=1)
        for row in some:
            extract = row["extract_ms"] and first["extract_ms"] / row["extract_ms"]
            lines.append([peer, count(row["n"]), "%d" % row["threads"], shown(row["median_ms"]),
                          shown(first["median_ms"] / row["median_ms"], "×"), shown(row["extract_ms"]),
                          shown(extract, "×" if extract else "")])
    return markdown(["dense cube", "boxes", "threads", "ms", "speed-up", "extraction ms", "speed-up"], lines,
                    [machine(rows)])


def memory(directory):
    rows = read(directory, "memory")
    lines = []
    for row in timed(rows):
        allowed = 150 * row["n"] + 16 * row["pairs"]
        lines.append([row["scene"], count(row["n"]), row["peer"], shown(row["held_bytes"] / row["n"]),
                      shown(row["peak_bytes"] / row["n"]), shown(row["own_bytes"] and row["own_bytes"] / row["n"]),
                      shown(allowed / row["n"])])
    return markdown(["scene", "boxes", "peer", "bytes a box held", "at most", "by its own account",
                     "150 + 16 a pair"], lines, [machine(rows)])


def oversubscription(directory):
    rows = read(directory, "oversubscription")
    lines = [[row["method"], "%d" % row["threads"], shown(row["update_ms"]), shown(row["overlap_ms"]),
              shown(row["total_ms"])] for row in rows]
    return markdown(["cubes on two cores", "threads", "update ms", "overlap ms", "whole ms"], lines, [machine(rows)])


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


def trace_peers(directory):
    """The bounding boxes of those traces in other libraries, one thread each."""
    rows = read(directory, "trace_peers")
    lines = []
    for program in values(rows, "program"):
        here = [row for row in timed(rows) if row["program"] == program]
        ours, told = (one(here, peer="parallel-sap" + setting) for setting in ("", ":begun-ended"))
        others = sorted((row for row in here if row["peer"] in LIBRARIES), key=lambda row: row["median_ms"])
        stock = sorted((row for row in here if row["peer"] in ODE_SPACES), key=lambda row: row["median_ms"])
        cell = lambda found: "%s %s" % (found[0]["peer"], shown(1000 * found[0]["median_ms"])) if found else "–"
        lines.append([program, count(ours["n"]), shown(1000 * ours["median_ms"]), shown(1000 * told["median_ms"]) if told else "–", cell(others),
                      cell(stock)])
    return markdown(["boxes of", "boxes", "ours, us a frame", "ours, begun and ended pairs", "nearest other library",
                     "nearest of ODE's spaces"], lines, [machine(rows)])


def nearest_cells(rows, scene, threads):
    """Our time, the nearest other library with its time, and the gain."""
    mine = one(rows, scene=scene, peer="parallel-sap", threads=threads)
    others = [peer for peer in values(rows, "peer") if peer in LIBRARIES]
    found = [row for row in (one(rows, scene=scene, peer=peer, threads=threads) for peer in others) if row]
    if not mine or not found:
        return ["–"] * 3
    near = min(found, key=lambda row: row["median_ms"])
    return [shown(mine["median_ms"]), "%s %s" % (near["peer"], shown(near["median_ms"])),
            shown(near["median_ms"] / mine["median_ms"], "×")]


def nearest(directory):
    """Ours against the nearest other library at 100,000 boxes, by scene and threads."""
    rows = [row for row in timed(read(directory, "peers"), n=100000)]
    lines = [[scene] + nearest_cells(rows, scene, 1) + nearest_cells(rows, scene, 2)
             for scene in values(rows, "scene")]
    return markdown(["100,000 boxes", "ours, 1 thread", "nearest library", "gain", "ours, 2 threads",
                     "nearest", "gain"], lines, [machine(rows)])


def rival_rows(directory, columns, at_rest_only):
    """Milliseconds, a row for each scene, part that moves, size and number of threads."""
    rows = read(directory, "rivals")
    moves = {1: "all move", 0.01: "1 % moves", 0: "at rest"}
    keys = sorted({(row["n"], -row["moving"], row["scene"], row["threads"]) for row in rows
                   if not at_rest_only or row["moving"] < 1})
    lines = []
    for n, part, scene, threads in keys:
        cells = [one(rows, n=n, moving=-part, scene=scene, threads=threads, peer=peer) for peer in columns]
        # Of a pile's recording next to nothing moves.
        what = scene if scene.startswith("pile") else "%s, %s" % (scene, moves[-part])
        lines.append([what, count(n), "%d" % threads] + [shown(cell and cell["median_ms"]) for cell in cells])
    return markdown(["ms", "boxes", "threads"] + list(columns), lines, [machine(rows)])


def rivals(directory):
    """Broad phases of engines. Those that keep pairs stand with ours that tells what began and ended."""
    return rival_rows(directory, (OURS + ":begun-ended", OURS + ":notified-begun-ended", "physx-abp", "physx-pabp",
                                  "physx-mbp", "physx-sap", "box3d", "bullet-dbvt", OURS, "jolt", "scalable-ccd",
                                  "embree"), False)


def rivals_asleep(directory):
    """The same where pairs of boxes at rest are not due."""
    return rival_rows(directory, (OURS + ":skip-asleep", OURS + ":skip-asleep-begun-ended",
                                  OURS + ":notified-skip-asleep-begun-ended", "jolt-asleep"), True)


def many_threads(directory):
    """The same at 100,000 and 1,000,000 boxes on all cores of a large machine."""
    rows = read(directory, "nearest")
    threads = rows[0]["threads"]
    small, large = (list(timed(rows, n=n)) for n in (100000, 1000000))
    lines = [[scene] + nearest_cells(small, scene, threads) + nearest_cells(large, scene, threads)
             for scene in values(rows, "scene")]
    return markdown(["%d threads" % threads, "ours, 100,000", "nearest library", "gain",
                     "ours, 1,000,000", "nearest", "gain"], lines,
                    ["100,000: " + machine(small) + "  ", "1,000,000: " + machine(large)])


def rest(directory):
    """Scenes of which little moves, on one thread."""
    names = {"all-move": "all move", "some-move": "the same few move, all pairs reported",
             "some-move-told": "the same few move, the space is told of the rest",
             "none-move": "none moves, all pairs reported",
             "none-move-told": "none moves, the space is told of the rest",
             "others-move": "others move in every frame", "some-awake": "the others asleep, all pairs reported",
             "skip-asleep": "the others asleep, pairs at rest left out",
             "skip-asleep-told": "likewise, the space is told of the rest",
             "skip-static": "the others static, pairs at rest left out",
             "tolerance-0.2": "all move by a hundredth, tolerance a fifth of a box",
             "tolerance-0.002": "likewise, tolerance a five-hundredth of a box",
             "ground": "all move on a plane", "ground-culled": "likewise, the plane culled",
             "bowl": "all move among 40 planes", "bowl-culled": "likewise, the planes culled"}
    rows = [row for row in read(directory, "rest") if row["threads"] == 1]
    lines = [[names[row["setting"]], count(row["n"]), count(row["movers"]), shown(row["mean_ms"]),
              shown(row["ratio"]), count(row["pairs"])] for row in rows]
    return markdown(["what moves", "boxes", "moving", "ms a frame", "of all moving", "pairs reported"], lines,
                    [machine(rows)])


def collide(directory):
    """The whole dSpaceCollide with one GPU and on the processor, against ODE's two fastest spaces."""
    rows = read(directory, "collide")
    peers = (OURS + ":cuda", OURS, "dSweepAndPruneSpace", "dHashSpace")
    lines = []
    for n in sorted(set(values(rows, "n"))):
        cells = [one(rows, n=n, peer=peer) for peer in peers]
        theirs = [cell["median_ms"] for cell in cells[2:] if cell]
        gain = theirs and cells[0] and min(theirs) / cells[0]["median_ms"]
        lines.append([count(n)] + [shown(cell and cell["median_ms"]) for cell in cells] + [shown(gain or None, "×")])
    return markdown(["boxes", "one GPU", "CPU, all threads", "dSweepAndPruneSpace", "dHashSpace", "gain of the GPU"],
                    lines, [machine(rows)])


def devices(directory):
    rows = [row for row in read(directory, "devices") if row["scene"] == "cube"]
    fixed = [on for on in values(rows, "on") if on != "auto"]
    names = ["CPU" if on == 0 else "%d GPU%s" % (on, "s" if on > 1 else "") for on in fixed]
    table = []
    for n in values(rows, "n"):
        times = [one(rows, n=n, on=on)["median_ms"] for on in fixed]
        auto = one(rows, n=n, on="auto")["median_ms"]
        table.append([count(n)] + [shown(ms) for ms in times] + [shown(auto), shown(auto / min(times))])
    return markdown(["boxes"] + names + ["Auto", "by the best"], table, [machine(rows)])


def device_rivals(directory):
    """One device: the sweep and cuBQL's trees, each builder at its best, host to host and the device's part of it."""
    rows = read(directory, "device-rivals")
    peers = [OURS] + [peer for peer in values(rows, "peer") if peer != OURS]
    lines = []
    for scene in values(rows, "scene"):
        for n in values([row for row in rows if row["scene"] == scene], "n"):
            cells = [min(timed(rows, scene=scene, n=n, peer=peer), key=lambda row: row["median_ms"], default=None)
                     for peer in peers]
            theirs = [cell["median_ms"] for cell in cells[1:] if cell]
            gain = theirs and cells[0] and min(theirs) / cells[0]["median_ms"]
            pairs = next(row["pairs"] for row in rows if row["scene"] == scene and row["n"] == n)
            lines.append([scene, count(n), count(pairs)] +
                         ["%s (%s)" % (shown(cell["median_ms"]), shown(cell["device_ms"])) if cell else "–"
                          for cell in cells] + [shown(gain or None, "×")])
    return markdown(["ms, host to host (device)", "boxes", "pairs"] + peers + ["gain"], lines, [machine(rows)])


def step(directory):
    """The whole step in each way, and how many times faster than in ODE's spaces pairs and step are in ours."""
    rows = read(directory, "step")
    stock = ("dHashSpace", "dSweepAndPruneSpace")
    ours = {"ours, serial contacts": "the one line", "ours, parallel contacts": "parallel contacts"}
    gains = (("broad_ms", "ours, serial contacts"), ("step_ms", "ours, serial contacts"), ("step_ms", "ours, parallel contacts"))
    threads = lambda space: "%d thread%s" % (max(row["threads"] for row in rows if row["space"] == space),
                                             "" if space in stock else "s")
    lines = []
    for bodies in sorted(set(values(rows, "bodies"))):
        cell = {space: one(rows, bodies=bodies, space=space) for space in stock + tuple(ours)}
        times = lambda column, space, other: shown(cell[other][column] / cell[space][column], "×") if cell[other] and cell[space] else "–"
        lines.append([count(bodies)] + [shown(row and row["step_ms"]) for row in cell.values()] +
                     ["%s, %s" % tuple(times(*gain, other) for other in stock) for gain in gains])
    heads = ["step, ms: %s, %s" % (ours.get(space, space), threads(space)) for space in stock + tuple(ours)]
    heads += ["times faster*: " + what for what in ("pairs", "step, the one line", "step, parallel contacts")]
    return markdown(["boxes"] + heads, lines, ["\\* than dHashSpace, than dSweepAndPruneSpace. " + machine(rows)])


def instructions(directory):
    """What the sweep takes with each instruction set, whatever the processor."""
    rows = read(directory, "instructions")
    parts = [(part, n) for part in ("loops", "sweep") for n in values(rows, "n")]
    lines = []
    for processor, name in dict.fromkeys((row["processor"], row["set"]) for row in rows):
        cells = {(row["part"], row["n"]): row["a_pair"] for row in rows
                 if (row["processor"], row["set"]) == (processor, name)}
        lines.append(["%s, %s" % (processor, name)] + [shown(cells[part]) for part in parts])
    heads = ["%s, %s boxes" % ("inner loops" if part == "loops" else "whole sweep", count(n)) for part, n in parts]
    row = rows[0]
    return markdown(["instructions a pair"] + heads, lines,
                    ["%s; commit %s, %s" % (row["compiler"], row["commit"], row["date"])])


def interval(part, whole):
    """Scenes in 10,000 with the 95 % interval of Wilson."""
    z, share = 1.96, part / whole
    middle, spread = share + z * z / (2 * whole), z * (share * (1 - share) / whole + (z / (2 * whole)) ** 2) ** 0.5
    low, high = ((middle + sign * spread) / (1 + z * z / whole) for sign in (-1, 1))
    return "%s (%s–%s)" % tuple(count(10000 * value) for value in (share, low, high))


def stock_spaces(directory):
    """How many scenes ODE's spaces get wrong, by tests/stock_spaces/campaign.cpp: the mean of a space's settings, which play
    the same scenes."""
    rows = read(directory, "rows")
    faulty = lambda *faults: [space for space in values(rows, "space") if any(
        row["space"] == space and any(row[fault] for fault in faults) for row in rows)]
    spaces = faulty("missed", "invented", "repeated")
    aborting = [space for space in faulty("scenes_aborting") if space not in spaces]
    lines = []
    for scene in values(rows, "scene"):
        cells = []
        for space in spaces:
            here = [row for row in rows if row["scene"] == scene and row["space"] == space]
            said = [verb + " " + interval(sum(row["scenes_" + what] for row in here) / len(here), here[0]["scenes"]) for verb, what in (
                ("misses", "missing"), ("invents", "inventing"), ("repeats", "repeating"), ("aborts", "aborting"))
                if any(row["scenes_" + what] for row in here)]
            cells.append(", ".join(said) or "exact")
        lines.append([scene] + cells)
    exact = ", ".join(space + (" (where it does not abort)" if space in aborting else "")
                      for space in values(rows, "space") if space not in spaces)
    touching = sum(row["missed_contacts"] for row in rows) / sum(row["missed"] for row in rows)
    return markdown(["scenes in 10,000 (95 % interval)"] + spaces, lines,
                    ["Exact in all: %s. dCollide finds contacts in %s of the missed pairs. ODE %s; commit %s" %
                     (exact, shown(100 * touching, " %"), rows[0]["ode"], rows[0]["commit"])])


# By name: the function and the file of rows.
TABLES = {"instructions": (instructions, "instructions"), "step": (step, "step"),
          "peers": (peers, "peers"), "distributions": (distributions, "peers"), "small": (small, "small"),
          "scaling": (scaling, "scaling"), "memory": (memory, "memory"),
          "oversubscription": (oversubscription, "oversubscription"),
          "traces": (traces, "traces"), "trace-peers": (trace_peers, "trace_peers"),
          "devices": (devices, "devices"), "device-rivals": (device_rivals, "device-rivals"),
          "collide": (collide, "collide"), "rest": (rest, "rest"), "nearest": (nearest, "peers"),
          "rivals": (rivals, "rivals"), "rivals-asleep": (rivals_asleep, "rivals"),
          "many-threads": (many_threads, "nearest"), "wrong-scenes": (stock_spaces, "rows")}


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
