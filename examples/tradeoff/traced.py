"""The study of a program that is not ours, by a trace of it: tradeoff.py --trace FILE."""

import os

KEY = ("trace", "bytes", "space", "work", "skip", "tolerance", "threads", "devices")
COLUMNS = ("ms", "least_ms", "pairs", "contacts", "tolerance_length", "frames")
WORKS = (("pairs", "Pairs alone"), ("loop", "Pairs, and dCollide in the callback"),
         ("contacts", "dParallelSAPSpaceCollideContacts"))
SKIPS = ("static", "asleep", "planes", "all")
TOLERANCES = (0.01, 0.03, 0.1, 0.3)  # of the usual size of a geom
NO_TOLERANCE = 0.0


def points(trace, cores, has_cuda):
    """All that a program could set: each rule, each tolerance, threads, GPUs; with each kind of work, since a pair
    too many costs a frame most where it is collided."""
    base = dict(trace=trace, bytes=float(os.path.getsize(trace)), space="parallel", skip="nothing",
                tolerance=NO_TOLERANCE, threads=1.0, devices=0.0)
    for work, _ in WORKS:
        yield dict(base, work=work)
        for skip in SKIPS:
            yield dict(base, work=work, skip=skip)
        for tolerance in TOLERANCES:
            yield dict(base, work=work, tolerance=tolerance)
        threads = 2.0
        while work != "loop" and threads <= cores:
            yield dict(base, work=work, threads=threads)
            threads *= 2
        if has_cuda:
            yield dict(base, work=work, devices=1.0)
        if work != "contacts":
            for space in ("hash", "sap"):
                yield dict(base, work=work, space=space)


def command_line(point):
    """The point as tradeoff-point takes it."""
    return dict(file=point["trace"], **{name: point[name] for name in KEY[2:]})


def name_of(row):
    if row["space"] != "parallel":
        return "ODE's %s space" % row["space"]
    if row["skip"] != "nothing":
        return {"static": "pairs of static geoms skipped", "asleep": "pairs asleep skipped",
                "planes": "planes culled", "all": "these three"}[row["skip"]]
    if row["tolerance"]:
        return "tolerance %.3g (%g of a usual geom)" % (row["tolerance_length"], row["tolerance"])
    if row["devices"]:
        return "%d GPU" % row["devices"]
    return "as traced" if row["threads"] == 1 else "%d threads" % row["threads"]


def table(rows):
    """What each setting gives, by work: a table of all, and what is quickest."""
    text = ""
    for work, title in WORKS:
        some = [row for row in rows if row["work"] == work and row["status"] == "ok"]
        base = [row for row in some if name_of(row) == "as traced"]
        if not base:
            continue
        text += "%s:\n\n| setting | ms a frame | least | pairs | contacts | of as traced |\n" % title
        text += "| --- | ---: | ---: | ---: | ---: | ---: |\n"
        for row in some:
            text += "| %s | %.4g | %.4g | %.1f | %.1f | %.3g |\n" % (
                name_of(row), row["ms"], row["least_ms"], row["pairs"], row["contacts"], row["ms"] / base[0]["ms"])
        # As long as a frame as it is, at its best, takes less than the others' median, nothing is gained.
        gains = [row for row in some if row["ms"] < base[0]["least_ms"]]
        quickest = min(gains, key=lambda row: row["ms"]) if gains else None
        text += "\nQuickest for certain: %s.\n\n" % (
            "%s, %.3g ms instead of %.3g" % (name_of(quickest), quickest["ms"], base[0]["ms"]) if quickest else
            "none of them takes less for its median frame than the space as traced for its quickest")
    return text
