#!/usr/bin/env python3
"""Vectors save instructions: fails where the loops of the sweep with one instruction set take too many of those with another.

    count.py build/release/tests/sweep-count

Instructions for this machine are counted by valgrind's callgrind, those for 64-bit ARM under QEMU's user mode, which logs each
one. A frame is half of what two more frames take, so that nothing else of the program counts. Numbers are the same on any machine
that has the set. Ends with 77 where there is nothing to count with.
"""
import re
import shutil
import subprocess
import sys

BOXES, FRAMES = "1000", 2
SETS = {"x86-64": ("portable", "sse2", "avx2"), "aarch64": ("portable", "neon")}
NOT_EVERYWHERE = ("avx2",)  # every processor of its kind has the others
# The most that the loops with one set may take of those with another: at most half as much again as was counted (0.57,
# 0.79, 0.45 and 0.72), but less than all; AVX2 no more of the portable ones than before SSE2 took so few.
MOST = (("sse2", "portable", 0.85), ("avx2", "sse2", 0.95), ("avx2", "portable", 0.57), ("neon", "portable", 0.93))


def run(command, **options):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def need(tool, package):
    if not shutil.which(tool):
        print("SKIPPED: there is no %s (Debian: %s)" % (tool, package))
        sys.exit(77)


def is_arm(program):
    with open(program, "rb") as file:
        return file.read(20)[18:20] == b"\xb7\x00"


def callgrind(command):
    """What is printed, and instructions."""
    need("valgrind", "valgrind")
    result = run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"] + command)
    return result, re.search(r"Collected : (\d+)", result.stderr)


def qemu(command):
    """The same. The option by which a block is one instruction has another name since QEMU 8.1."""
    need("qemu-aarch64", "qemu-user")
    emulator = ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]
    single = next(option for option in ("-one-insn-per-tb", "-singlestep") if option in run(["qemu-aarch64", "-h"]).stdout)
    counted = run(" ".join(emulator + [single, "-d", "exec,nochain"] + command) + " 2>&1 >/dev/null | grep -c ^Trace", shell=True)
    return run(emulator + command), re.match(r"(\d+)", counted.stdout)


def count(program, name, frames):
    """(instructions, pairs); None where the processor lacks the set."""
    command = [program, name, BOXES, str(frames)]
    result, found = (qemu if is_arm(program) else callgrind)(command)
    if result.returncode == 77:
        return None
    if result.returncode != 0 or not found:
        sys.exit("%s ended with %d and said:\n%s" % (" ".join(command), result.returncode, result.stderr))
    return int(found[1]), int(result.stdout)


def main(program):
    taken, pairs, wrong = {}, set(), []
    for name in SETS["aarch64" if is_arm(program) else "x86-64"]:
        few, many = (count(program, name, 1 + more) for more in (0, FRAMES))
        if few is None:
            print("this processor has no " + name)
            wrong += [] if name in NOT_EVERYWHERE else ["the program has no " + name]
            continue
        taken[name] = (many[0] - few[0]) / FRAMES
        pairs.add(many[1])
        print("%-8s %11.0f instructions" % (name, taken[name]), flush=True)
    wrong += ["other pairs with another set"] if len(pairs) != 1 else []
    wrong += ["%s takes more than %g of %s" % (better, most, worse) for better, worse, most in MOST
              if better in taken and taken[better] > most * taken[worse]]
    sys.exit("\n".join(wrong) or 0)


main(sys.argv[1])
