#!/usr/bin/env python3
"""Vectors save instructions: fails where the loops of the sweep with one instruction set take too many of those with another.

    count.py build/release/tests/sweep-count

Instructions for this machine are counted by valgrind's callgrind, those for 64-bit ARM under QEMU's user mode by a plugin
that is compiled here. A frame is a tenth of what ten more frames take, so that nothing else of the program counts. Numbers
are the same on any machine that has the set. Ends with 77 where there is nothing to count with.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
BOXES = 1000
FRAMES = 10
SETS = {"x86-64": ("portable", "sse2", "avx2"), "aarch64": ("portable", "neon")}
NOT_EVERYWHERE = ("avx2",)  # every processor of its kind has the others
# The most that the loops with one set may take of those with another: at most half as much again as was counted (0.73,
# 0.58 and 0.86), but less than all.
MOST = (("sse2", "portable", 0.85), ("avx2", "sse2", 0.67), ("neon", "portable", 0.93))


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


def main(program):
    taken, pairs = {}, set()
    with tempfile.TemporaryDirectory() as folder:
        counter = qemu(folder) if is_arm(program) else callgrind()
        for name in SETS["aarch64" if is_arm(program) else "x86-64"]:
            few, many = (count(counter, [program, name, str(BOXES), str(1 + more)]) for more in (0, FRAMES))
            if few is None and name in NOT_EVERYWHERE:
                print("this processor has no " + name)
                continue
            if few is None:
                sys.exit("the program has no " + name)
            taken[name] = (many[0] - few[0]) / FRAMES
            pairs.add(many[1])
            print("%-8s %11.0f instructions" % (name, taken[name]), flush=True)
    wrong = ["other pairs with another set"] if len(pairs) != 1 else []
    wrong += ["%s takes more than %g of %s" % (better, most, worse) for better, worse, most in MOST
              if better in taken and taken[better] > most * taken[worse]]
    sys.exit("\n".join(wrong) if wrong else 0)


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except Skipped as reason:
        print("SKIPPED: %s" % reason)
        sys.exit(77)
