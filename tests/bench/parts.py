#!/usr/bin/env python3
"""What each part that may run in parallel gains in a whole time step of examples/pile.

    tests/bench/parts.py --pile build/examples/pile/pile --ode tls --out parts.csv --threads 2 16
    tests/bench/parts.py --table parts.csv        a table of it, as markdown

Runs the pile of 10,000 boxes and that of 1,000 tori with ODE's dHashSpace, then with the parallel
space, then also with its narrow phase, then also with ODE's own threads for the solver; each on the
first T cores, with T threads. Means over the second half of the steps, when the pile has formed.
--ode says what the ODE below is: tls (built from source, thread-local caches) or system.
"""
import argparse
import csv
import datetime
import os
import subprocess
import sys
import tempfile

SCENES = {"cubes": ["--bodies", "10000", "--steps", "240"],
          "torus": ["--bodies", "1000", "--steps", "400"]}
PARTS = {"dHashSpace": ["--space", "hash"],
         "broad phase": ["--space", "parallel"],
         "+ narrow phase": ["--space", "parallel", "--narrow", "parallel"],
         "+ solver": ["--space", "parallel", "--narrow", "parallel", "--stepping", "parallel"]}
TIMES = ["broad_ms", "narrow_ms", "joints_ms", "solver_ms", "step_ms"]
COLUMNS = ["scene", "bodies", "ode", "parts", "threads", "pairs", "contacts"] + TIMES + [
    "cpu", "date", "session"]


def cpu_name():
    with open("/proc/cpuinfo") as file:
        return next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")),
                    "unknown")


def measure(pile, scene, parts, threads, steps):
    options = ["--scene", scene] + SCENES[scene] + PARTS[parts]
    if steps:
        options[options.index("--steps") + 1] = str(steps)
    if parts != "dHashSpace":
        options += ["--threads", str(threads)]
    cores = sorted(os.sched_getaffinity(0))[:threads]
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "frames.csv")
        subprocess.run([pile] + options + ["--csv", file], check=True, stdout=subprocess.DEVNULL,
                       preexec_fn=lambda: os.sched_setaffinity(0, cores))
        with open(file) as rows:
            frames = list(csv.DictReader(rows))
    frames = frames[len(frames) // 2:]
    mean = {name: sum(float(frame[name]) for frame in frames) / len(frames)
            for name in ["pairs", "contacts"] + TIMES}
    row = {"scene": scene, "bodies": SCENES[scene][1], "parts": parts, "threads": threads}
    row.update({name: "%.0f" % mean[name] if name in ("pairs", "contacts") else "%.4f" % mean[name]
                for name in mean})
    return row


def record(options):
    with open(options.out, "w", newline="") as file:
        out = csv.DictWriter(file, COLUMNS)
        out.writeheader()
        for scene in options.scenes:
            for threads in options.threads:
                for parts in options.parts:
                    row = measure(options.pile, scene, parts, threads, options.steps)
                    row.update(ode=options.ode, cpu=cpu_name(), session=options.session,
                               date=datetime.date.today().isoformat())
                    out.writerow(row)
                    file.flush()
                    print(scene, parts, threads, {name: row[name] for name in TIMES}, flush=True)


def table(names):
    rows = []
    for name in names:
        with open(name) as file:
            rows += list(csv.DictReader(file))
    print("| scene | ODE | threads | parallel parts | broad | narrow | joints | solver | step |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for row in rows:
        print("| " + " | ".join([row["scene"], row["ode"], row["threads"], row["parts"]] +
                                ["%.2f" % float(row[name]) for name in TIMES]) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pile", help="the program")
    parser.add_argument("--ode", default="system", choices=["system", "tls"])
    parser.add_argument("--session", default="1", help="tells runs on different machines apart")
    parser.add_argument("--out", default="parts.csv")
    parser.add_argument("--threads", type=int, nargs="+", default=[len(os.sched_getaffinity(0))])
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS))
    parser.add_argument("--steps", type=int, help="fewer steps than usual, to see that it works")
    parser.add_argument("--table", nargs="+", metavar="CSV", help="print these results and do no more")
    options = parser.parse_args()
    if options.table:
        table(options.table)
    elif not options.pile:
        sys.exit("parts.py: --pile names the program to measure")
    else:
        record(options)


if __name__ == "__main__":
    main()
