#!/usr/bin/env python3
"""Lists the results that are older than the last change of what they time:

    tests/bench/stale.py                those of tests/bench/results and examples/tradeoff/results
    tests/bench/stale.py DIR FILE ...   some

A file is as old as the oldest commit that its rows name; where none does, as the commit that it came with. Rows of
other libraries do not age. What changes documents or comments only is no change. Ends with 1 if any file is older, or names a commit that is not to be had.
"""
import csv
import glob
import os
import re
import subprocess
import sys

OURS = "ode-parallel-sap"  # where a column says which library a row is of
LIBRARY = ("space",)
DEVICES = ("space", "cuda")
# What a study times, where that is not the whole library on the CPU. A measured constant changes with what is
# around it, so `tuning` and `ablation` are of the whole library, too.
TIMED = {
    "sort": ("space/sort", "space/simd", "space/data", "tests/bench/sort_benchmark.cpp"),
    "instructions": ("space/simd", "space/extract", "space/cells", "space/sort", "space/data", "tests/instructions"),
    "narrow": ("space/contacts", "space/ode", "space/geom", "space/data"),
    "apart": ("space/contacts", "space/geom", "space/data"),
    "collide": DEVICES,
    "devices": DEVICES,
    "device-rivals": DEVICES,
    "figure14": DEVICES,
    "figure15": DEVICES,
    "parts": ("space", "examples/pile"),
    "step": ("space", "examples/pile"),
    "broad": ("space", "cuda", "examples/tradeoff/broad_point.cpp"),
    # What becomes of a scene is the same with any version of the space.
    "scenes": ("examples/tradeoff/harness", "examples/tradeoff/harness.h", "examples/tradeoff/scenes.cpp",
               "examples/tradeoff/vehicle_scene.cpp", "examples/tradeoff/mesh_scene.cpp"),
}
DOCUMENTS = ":(exclude,glob)**/*.md"


def git(root, *arguments):
    """What git says, or None where it refuses."""
    result = subprocess.run(["git", "-C", root] + list(arguments), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                            universal_newlines=True)
    return result.stdout.strip() if result.returncode == 0 else None


def commits_of(path):
    """The commits that the rows of our library name, without what says that files were changed beside."""
    with open(path, newline="") as file:
        named = {row.get("commit") or "" for row in csv.DictReader(file)
                 if (row.get("library") or OURS).startswith(OURS)}
    return {re.sub("-dirty$", "", name) for name in named if name}


def code_of(line):
    """What is left without comments; a line that begins with an asterisk and a space is within one."""
    return re.sub(r"^\s*\* .*|/\*.*?(\*/|$)|//.*", "", line).strip()


def changes_code(diff):
    """Whether it changes more than blank lines and comments. What has no lines (a file that got another name, a merge)
    counts as code."""
    lines = re.findall(r"^(?!\+\+\+ |--- )([+-])(.*)", diff, re.M)
    before, after = (list(filter(None, (code_of(line) for sign, line in lines if sign == side))) for side in "-+")
    return not lines or before != after


def changes_since(root, commit, paths):
    """The commits since then that changed one of the paths, newest first; None if there is no such commit."""
    if git(root, "cat-file", "-e", commit + "^{commit}") is None:
        return None
    listing = git(root, "log", "--format=%x00%h %cs %s", "--patch", "--unified=0", commit + "..HEAD", "--", *paths,
                  DOCUMENTS)
    found = (entry.partition("\n") for entry in listing.split("\0")[1:])
    return [title for title, _, diff in found if changes_code(diff)]


def judge(root, path):
    """(is as it should be, what there is to say)."""
    study = os.path.splitext(os.path.basename(path))[0]
    paths = TIMED.get(study, LIBRARY)
    commits = commits_of(path) or {git(root, "log", "-1", "--format=%h", "--", os.path.abspath(path))}
    if "" in commits:
        return True, "not committed yet"
    found = {commit: changes_since(root, commit, paths) for commit in commits}
    unknown = sorted(commit for commit, changes in found.items() if changes is None)
    if unknown:
        return False, "unknown commit " + ", ".join(unknown)
    oldest, changes = max(found.items(), key=lambda item: len(item[1]))
    if not changes:
        return True, "up to date"
    return False, "of %s, %d changes of %s since, the last: %s" % (oldest, len(changes), " ".join(paths), changes[0])


def files_of(arguments):
    for argument in arguments:
        if os.path.isdir(argument):
            yield from sorted(glob.glob(os.path.join(argument, "**", "*.csv"), recursive=True))
        else:
            yield argument


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    root = os.path.dirname(os.path.dirname(here))
    if sys.argv[1:2] in (["-h"], ["--help"]):
        print(__doc__)
        return 0
    arguments = sys.argv[1:] or [os.path.join(root, *parts, "results")
                                 for parts in (("tests", "bench"), ("examples", "tradeoff"))]
    if sys.argv[1:]:
        root = git(os.path.dirname(os.path.abspath(arguments[0])), "rev-parse", "--show-toplevel")
        if root is None:
            sys.exit("%s: in no repository" % arguments[0])
    old = 0
    for path in files_of(arguments):
        is_fine, why = judge(root, path)
        old += not is_fine
        if not is_fine:
            print("%s: %s" % (os.path.relpath(path, root), why))
    print("%d older than what they time" % old)
    return 1 if old else 0


if __name__ == "__main__":
    sys.exit(main())
