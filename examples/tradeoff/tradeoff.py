#!/usr/bin/env python3
"""Says what accuracy costs in a scene: examples/tradeoff/README.md.

Goes on from the rows that there are, and says what is known when it ends: when all is said (exit code 0), after
--budget seconds, or after Ctrl-C (exit code 75)."""

import argparse
import csv
import datetime
import hashlib
import math
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True  # this folder is for sources

import study

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
POINT = os.path.join(TOP, "build", "release", "examples", "tradeoff", "tradeoff-point")
SCENES = ("arm", "tower", "heap")
CORES = len(os.sched_getaffinity(0))
ORIGIN = ("cpu", "cores", "commit", "date")


def origin():
    with open("/proc/cpuinfo") as file:
        cpu = re.findall(r"model name\s*: (.*)", file.read()) or ["unknown CPU"]
    describe = "git -C '%s' describe --always --exclude='*' --abbrev=10 --dirty=-changed 2>/dev/null || echo unknown" % TOP
    commit = subprocess.run(describe, shell=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    return dict(zip(ORIGIN, (cpu[0], str(CORES), commit, datetime.date.today().isoformat())))


def parsed(name, text):
    try:
        return text if name in ORIGIN else float(text)
    except ValueError:
        return text


class Table:
    """A CSV file that grows by a row at a time."""
    def __init__(self, folder):
        os.makedirs(folder, exist_ok=True)
        self.path, self.rows, self.columns, self.origin = os.path.join(folder, "scenes.csv"), [], [], origin()
        if os.path.exists(self.path):
            with open(self.path, newline="") as file:
                reader = csv.DictReader(file)
                # A row that was cut short is measured again.
                self.rows = [{name: parsed(name, text) for name, text in row.items()} for row in reader if None not in row.values()]
                self.columns = list(reader.fieldnames or ())

    def add(self, row):
        self.rows.append(dict(row, **self.origin))
        new = [name for name in self.rows[-1] if name not in self.columns]
        self.columns += new
        with open(self.path, "w" if new else "a", newline="") as file:
            writer = csv.DictWriter(file, self.columns, restval="", lineterminator="\n")
            if new:
                writer.writeheader()
            writer.writerows(self.rows if new else self.rows[-1:])


def play(command, points, patience):
    """Yields each point with its row, in the order in which they end; as many run at a time as there are cores."""
    waiting, children = list(points), {}
    limit = patience and (lambda: resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(patience),) * 2))
    try:
        while waiting or children:
            while waiting and len(children) < CORES:
                setting, seed = waiting.pop(0)
                # ODE's random numbers begin alike from neighbouring seeds.
                words = [word for name, value in dict(setting._asdict(), seed=seed * 618033989 % 10**9).items()
                         for word in ("--" + name, value if isinstance(value, str) else "%.12g" % value)]
                files = tempfile.TemporaryFile("w+"), tempfile.TemporaryFile("w+")
                child = subprocess.Popen(command + words, stdout=files[0], stderr=files[1], start_new_session=True, preexec_fn=limit)
                children[child.pid] = child, setting, seed, files
            pid, status, usage = os.wait4(-1, 0)
            child, setting, seed, files = children.pop(pid)
            code = child.returncode = os.waitstatus_to_exitcode(status)
            said, complaint = (file.seek(0) or file.read().strip() for file in files)
            values = re.findall(r"^(ms_per_s|undriven|outcome_\w+) (\S+)$", said, re.MULTILINE)
            if code == 2 or code == 0 and not values:
                sys.exit("%s: %s" % (" ".join(child.args), complaint or "it wrote no row"))
            row = dict(status="ok" if code == 0 else "exit code %d" % code, took_s=round(usage.ru_utime + usage.ru_stime, 4))
            yield setting, seed, dict(row, **{name: float(text) for name, text in values})
    finally:
        for child, *_ in children.values():
            child.kill()
            child.wait()


def conduct(one, name, command, table):
    """Does what the study of a scene wants; yields where there may be something new to say."""
    for row in table.rows:
        if row["scene"] == name:
            one.add(study.Setting(*(row[field] for field in study.Setting._fields)), int(row["seed"]), row)
    for points in one.search():
        missing = [point for point in dict.fromkeys(points) if point not in one.rows]
        for setting, seed, row in play(command, missing, one.patience):
            table.add(dict(setting._asdict(), scene=name, seed=seed, **row))
            one.add(setting, seed, row)
        yield


def draw(path, title, one):
    """Cost and error of all settings that were tried, as an SVG; those that are named have their names."""
    wide, high, left, low = 720, 400, 60, 1e-4
    trade, named = one.trade(), {answer.setting for answer in one.answers.values()}
    first, last = math.floor(math.log10(trade[0][0])), math.ceil(math.log10(trade[-1][0])) + 0.3
    def x(cost):
        return left + (math.log10(cost) - first) / (last - first) * (wide - left)
    def y(off):
        return 20 + math.log10(max(off, low)) / math.log10(low) * (high - 60)
    def text(across, down, words, anchor="start", colour="black"):
        return '<text x="%.0f" y="%.0f" text-anchor="%s" fill="%s">%s</text>' % (across, down, anchor, colour, words)
    finest = study.name_of(one.references[min(one.references)])
    parts = [text(left, 14, "%s: error of a run by %s, ms of processor for a simulated second" % (title, finest))]
    for share in (1, *study.LIMITS, 0.001, low):
        line = '<path d="M%d %.0fH%d" stroke="%s"/>' % (left, y(share), wide, "#888" if share in study.LIMITS else "#ddd")
        parts += [line, text(left - 6, y(share) + 4, "%g %%" % (100 * share), "end")]
    parts += [text(x(10 ** power), high - 22, "%g ms" % 10 ** power, "middle") for power in range(first, math.floor(last) + 1)]
    for solver, colour, across in (("quick", "#c60", left), ("step", "#06c", left + 140)):
        dots = "".join("M%.1f %.1fh0" % (x(cost), y(off)) for cost, off, setting in trade if setting.solver == solver)
        parts.append('<path d="%s" stroke="%s" stroke-width="5" stroke-linecap="round" opacity="0.5"/>' % (dots, colour))
        parts.append(text(across, high - 5, dict(quick="dWorldQuickStep", step="dWorldStep")[solver], colour=colour))
    for cost, off, setting in trade:
        if setting in named:
            parts += ['<circle cx="%.1f" cy="%.1f" r="5" fill="none" stroke="black"/>' % (x(cost), y(off)),
                      text(x(cost) + 8, y(off) + 4, study.name_of(setting))]
    with open(path, "w") as file:
        file.write('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" font-family="sans-serif" font-size="12">'
                   '<rect width="%d" height="%d" fill="white"/>%s</svg>\n' % (wide, high, wide, high, "".join(parts)))


def parse():
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("--budget", type=float, metavar="SECONDS", help="end after so many seconds (default: when all is said)")
    made.add_argument("--program", metavar="FILE", help="study the scene of this program, made with harness.h")
    made.add_argument("--scene", metavar="NAME", help="only this one of the program's scenes (default program: %s)" % ", ".join(SCENES))
    made.add_argument("--out", metavar="DIR", help="folder of the results (default: beside the program)")
    made.add_argument("--write", metavar="FILE", help="put the answers between <!-- tradeoff --> and <!-- end --> there")
    options = made.parse_args()
    for name in ("program", "write"):
        if getattr(options, name) and not os.path.isfile(getattr(options, name)):
            made.error("--%s: there is no file %s" % (name, getattr(options, name)))
    if not options.program and options.scene not in (None, *SCENES):
        made.error("--scene: one of %s" % ", ".join(SCENES))
    options.out = options.out or (options.program or POINT) + ".study"
    return options


def scenes_of(options):
    """Titles, names in the table, commands."""
    if not options.program:
        return [(name.capitalize(), name, [POINT, name]) for name in SCENES if options.scene in (None, name)]
    title = options.scene or os.path.basename(options.program)
    with open(options.program, "rb") as file:  # a new build is measured anew
        digest = hashlib.sha256(file.read()).hexdigest()[:10]
    return [(title, "%s-%s" % (title, digest), [os.path.abspath(options.program)] + [options.scene] * bool(options.scene))]


def main():
    options = parse()
    began, table, scenes = time.monotonic(), Table(options.out), scenes_of(options)
    def stop(*_):
        options.budget = 0  # for the other scenes, too
        raise KeyboardInterrupt
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    code, lines = 0, ["| scene | within | cheapest setting | ms | error (at most) |\n| --- | ---: | --- | ---: | ---: |"]
    for at, (title, name, command) in enumerate(scenes):
        one, said = study.Study(), set()
        try:
            if options.budget is not None:  # what is left of it, divided by the scenes that are left
                left = options.budget + began - time.monotonic()
                signal.setitimer(signal.ITIMER_REAL, max(left / (len(scenes) - at), 1e-3))
            for _ in conduct(one, name, command, table):
                new = [line for line in one.lines(title) if line not in said]
                print("".join("%4.0f s %s\n" % (time.monotonic() - began, line) for line in new), end="", flush=True)
                said.update(new)
        except KeyboardInterrupt:
            code = 75
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
        lines += one.lines(title)
        if one.trade():
            draw(os.path.join(options.out, title.lower() + ".svg"), title, one)
    machines = sorted({"%s, a run a core on %s cores" % (row["cpu"], row["cores"]) for row in table.rows})
    answer = "\n".join([*lines, "", *machines]) + "\n"
    print(answer)
    if options.write:
        with open(options.write) as file:
            before, rest = file.read().split("<!-- tradeoff -->\n")
        with open(options.write, "w") as file:
            file.write(before + "<!-- tradeoff -->\n\n" + answer + "\n<!-- end -->" + rest.split("<!-- end -->", 1)[1])
    sys.exit(code)


if __name__ == "__main__":
    main()
