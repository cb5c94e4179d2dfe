#!/usr/bin/env python3
"""Where the time of a whole step goes, in ODE's spaces and in ours: records the study `step`.

    tests/bench/step.py --pile build/release/examples/pile/pile --out tests/bench/results/MACHINE/step.csv
    tests/bench/plot.py tests/bench/results/MACHINE       draws it

Runs the example's pile of boxes in dHashSpace, in dSweepAndPruneSpace and in the parallel space, in this with
contacts found by a loop and on its threads. Before what is measured the pile has settled in one and the same
way, so that all begin with the same boxes in the same places. They take turns. A row has the median of each part
over the steps of all turns but the first two of each, in which a space takes memory and finds out about its
machine; `step_ms` is their sum. What takes longer than --limit seconds is left out, and its row says so.
"""
import argparse
import csv
import datetime
import os
import pathlib
import re
import statistics
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SPACES = {"dHashSpace": ["--space", "hash"],
          "dSweepAndPruneSpace": ["--space", "sap"],
          "the one line": ["--space", "parallel", "--narrow", "serial"],
          "parallel contacts": ["--space", "parallel", "--narrow", "parallel"]}
# Steps to settle, and steps that are measured, the same in all spaces.
STEPS = {1000: (150, 60), 10000: (150, 20), 50000: (100, 8)}
DROPPED = 2
PARTS = ["broad_ms", "narrow_ms", "joints_ms", "solver_ms"]
COLUMNS = ["bodies", "space", "status", "threads", "steps", "pairs", "contacts"] + PARTS + [
    "step_ms", "cpu", "cores", "commit", "date"]


def machine():
    """Without git the commit is empty."""
    cpu = re.search(r"^model name\s*: (.*)|\Z", pathlib.Path("/proc/cpuinfo").read_text(), re.M)[1] or "unknown"
    try:
        commit = subprocess.run(["git", "rev-parse", "--short=10", "HEAD"], stdout=subprocess.PIPE, text=True, stderr=subprocess.DEVNULL,
                                cwd=HERE).stdout.strip()
    except OSError:
        commit = ""
    return {"cpu": cpu, "cores": len(os.sched_getaffinity(0)), "commit": commit, "date": datetime.date.today().isoformat()}


def frames_of(options, bodies, space):
    """The rows of a run of pile; a text where there are none."""
    settle, steps = STEPS[bodies]
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "frames.csv")
        command = [options.pile, "--bodies", str(bodies), "--steps", str(steps + DROPPED), "--settle", str(settle),
                   "--csv", file]
        try:
            status = subprocess.run(command + SPACES[space], stdout=subprocess.DEVNULL, timeout=options.limit).returncode
        except subprocess.TimeoutExpired:
            return "left out: longer than %g s" % options.limit
        if status != 0:
            return "left out: pile ends with %d" % status
        with open(file, newline="") as rows:
            return list(csv.DictReader(rows))[DROPPED:]


def row_of(bodies, space, turns):
    ours = "parallel" in SPACES[space]
    row = {"bodies": bodies, "space": space, "threads": len(os.sched_getaffinity(0)) if ours else 1}
    if isinstance(turns[-1], str):
        return dict(row, status=turns[-1])
    frames = sum(turns, [])
    typical = {name: statistics.median(float(frame[name]) for frame in frames) for name in ["pairs", "contacts"] + PARTS}
    typical["step_ms"] = sum(typical[name] for name in PARTS)
    row.update({name: ("%.0f" if name in ("pairs", "contacts") else "%.4f") % value for name, value in typical.items()})
    return dict(row, status="ok", steps=len(frames))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pile", required=True, help="the program")
    parser.add_argument("--out", required=True, help="the CSV file")
    parser.add_argument("--bodies", type=int, nargs="+", choices=STEPS, default=list(STEPS))
    parser.add_argument("--turns", type=int, default=5, help="runs of each space")
    parser.add_argument("--limit", type=float, default=90, help="seconds that a run may take")
    options = parser.parse_args()
    where = machine()
    os.makedirs(os.path.dirname(os.path.abspath(options.out)), exist_ok=True)
    with open(options.out, "w", newline="") as file:
        out = csv.DictWriter(file, COLUMNS)
        out.writeheader()
        for bodies in options.bodies:
            turns = {space: [] for space in SPACES}
            for _ in range(options.turns):
                for space, runs in turns.items():
                    if not runs or not isinstance(runs[-1], str):
                        runs.append(frames_of(options, bodies, space))
            for space, runs in turns.items():
                row = row_of(bodies, space, runs)
                out.writerow(dict(row, **where))
                file.flush()
                print(bodies, space, row["status"], row.get("step_ms", ""), flush=True)


if __name__ == "__main__":
    main()
