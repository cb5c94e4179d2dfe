#!/usr/bin/env python3
"""Counts the instructions that a frame of the sweep takes, with every instruction set that a program has:

    count.py build/release/tests/sweep-count build/aarch64/tests/sweep-count --out instructions.csv
    count.py PROGRAM --boxes 1000 --parts loops --check     # fails where vectors save too little

Those of this machine are counted by valgrind's callgrind, those for 64-bit ARM under QEMU's user mode by a plugin that
is compiled here. A frame is a tenth of what ten more frames take, so that nothing else of the program counts. Numbers
are the same on any machine that has the set. Ends with 77 where there is nothing to count with.
"""
import argparse
import csv
import datetime
import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
FRAMES = 10
SETS = {"x86-64": ("portable", "sse2", "avx2"), "aarch64": ("portable", "neon")}
NOT_EVERYWHERE = ("avx2",)  # every processor of its kind has the others
# The most that the loops with one set may take of those with another: at most half as much again as was counted (0.56,
# 0.52 and 0.67), but less than all.
MOST = (("sse2", "portable", 0.85), ("avx2", "sse2", 0.67), ("neon", "portable", 0.85))


class Skipped(Exception):
    pass


def run(command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)


def needed(tool, package):
    if not shutil.which(tool):
        raise Skipped("there is no %s (Debian: %s)" % (tool, package))
    return tool


def is_arm(program):
    with open(program, "rb") as file:
        return file.read(20)[18:20] == b"\xb7\x00"


def compiler_of(program):
    """Which GCC it was made by, as the program itself says."""
    with open(program, "rb") as file:
        found = re.search(rb"GCC: \([^)]*\) ([0-9.]+)", file.read())
    return "GNU " + found.group(1).decode() if found else ""


def callgrind():
    """The command that counts, and what it says on stderr."""
    return [needed("valgrind", "valgrind"), "--tool=callgrind", "--callgrind-out-file=/dev/null"], r"Collected : (\d+)"


def qemu(folder):
    """The same under QEMU. Which version of the interface it wants is not to be asked, but tried."""
    command = [needed("qemu-aarch64", "qemu-user"), "-L", "/usr/aarch64-linux-gnu"]
    said = ""
    for version in (1, 2):
        plugin = os.path.join(folder, "counter%d.so" % version)
        subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-DPLUGIN_VERSION=%d" % version, "-o", plugin,
                        os.path.join(HERE, "qemu_counter.c")], check=True)
        said = run(command + ["-plugin", plugin, "/nonexistent"]).stderr
        if "plugin" not in said.lower():
            return command + ["-plugin", plugin], r"instructions: (\d+)"
    raise Skipped("QEMU takes no plugin: " + said.strip())


def count(counter, arguments):
    """(instructions, pairs); None where the processor lacks the set."""
    command, pattern = counter
    result = run(command + arguments)
    if result.returncode == 77:
        return None
    found = re.search(pattern, result.stderr)
    if result.returncode != 0 or not found:
        sys.exit("%s ended with %d and said:\n%s" % (" ".join(command + arguments), result.returncode, result.stderr))
    return int(found.group(1)), int(result.stdout)


def rows_of(program, sizes, parts, folder):
    """What each set takes, part by part and size by size."""
    processor = "aarch64" if is_arm(program) else "x86-64"
    counter = qemu(folder) if is_arm(program) else callgrind()
    for size in sizes:
        for part in parts:
            for name in SETS[processor]:
                few, many = (count(counter, [program, name, part, str(size), str(1 + more)]) for more in (0, FRAMES))
                if few is None and name in NOT_EVERYWHERE:
                    print("%s: this processor has no %s" % (processor, name))
                    continue
                if few is None:
                    sys.exit("%s: the program has no %s" % (program, name))
                a_frame = (many[0] - few[0]) / FRAMES
                yield {"processor": processor, "set": name, "part": part, "n": size, "pairs": many[1],
                       "instructions": round(a_frame), "a_pair": "%.4g" % (a_frame / many[1])}


def complaints(rows):
    """What is wrong with the numbers: all find the same pairs, and vectors are worth having."""
    for size in {row["n"] for row in rows}:
        if len({row["pairs"] for row in rows if row["n"] == size}) != 1:
            yield "%d boxes: not everywhere the same number of pairs" % size
    loops = {(row["processor"], row["n"], row["set"]): row["instructions"] for row in rows if row["part"] == "loops"}
    for (processor, size, name), taken in loops.items():
        for better, worse, most in MOST:
            if name == better and taken > most * loops[processor, size, worse]:
                yield "%d boxes: the loops with %s take more than %g of those with %s" % (size, better, most, worse)


def commit():
    said = run(["git", "-C", HERE, "describe", "--always", "--dirty", "--abbrev=10"])
    return said.stdout.strip() or "unknown"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+", metavar="PROGRAM")
    parser.add_argument("--boxes", type=lambda text: [int(n) for n in text.split(",")], default=[1000, 10000, 100000])
    parser.add_argument("--parts", default="loops,sweep")
    parser.add_argument("--out", help="a CSV file")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for program in options.programs:
            for row in rows_of(program, options.boxes, options.parts.split(","), folder):
                rows.append(dict(row, compiler=compiler_of(program), commit=commit(),
                                 date=datetime.date.today().isoformat()))
                print("%(processor)-8s %(set)-8s %(part)s %(n)7d boxes: %(instructions)11d, %(a_pair)s a pair" % row,
                      flush=True)
    if options.out:
        with open(options.out, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    wrong = list(complaints(rows)) if options.check else []
    print("\n".join(wrong), end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Skipped as reason:
        print("SKIPPED: %s" % reason)
        sys.exit(77)
