"""Builds the library again with a line of its source changed, and times such variants against each other.

A variant is made of a copy of space/ and cuda/, by the compile commands of a build that CMake made with
-DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DODE_PARALLEL_SAP_BENCHMARKS=ON -DODE_PARALLEL_SAP_CUDA=OFF. It takes the library's
place under the programs of that build, so what is timed differs by that line alone.
"""
import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor


class Project:
    """The source and a build of it. `database` is its compile_commands.json, if that is not in the build."""

    def __init__(self, source, build, programs=None, database=None):
        self.source, self.build = os.path.abspath(source), os.path.abspath(build)
        self.programs = os.path.abspath(programs or os.path.join(build, "tests", "bench"))
        database = database or os.path.join(build, "compile_commands.json")
        if not os.path.exists(database):
            sys.exit("%s is missing: configure with -DCMAKE_EXPORT_COMPILE_COMMANDS=ON" % database)
        with open(database) as file:
            entries = json.load(file)
        self.commands = [entry for entry in entries if self.takes(entry)]
        if any(entry["file"].endswith(".cu") and not self.takes(entry) for entry in entries):
            sys.exit("%s: libraries with CUDA are not made here, configure with -DODE_PARALLEL_SAP_CUDA=OFF" % database)

    def takes(self, entry):
        """Whether a compile command is for what is made: the library."""
        return (entry["file"].startswith(os.path.join(self.source, "space") + os.sep)
                and "/ode-parallel-sap" in entry["command"] and "preload" not in entry["command"])

    def link(self, objects, directory):
        library = os.path.join(directory, "libode-parallel-sap.so.0")
        subprocess.run(["c++", "-shared", "-Wl,-soname,libode-parallel-sap.so.0", "-o", library] + objects +
                       ["-fopenmp", "-pthread"], check=True)

    def prepare(self, directory, jobs):
        """Compiles all as it is, into a directory that variants take their other files from."""
        self.base = os.path.join(directory, "base")
        os.mkdir(self.base)
        with ThreadPoolExecutor(jobs) as pool:
            self.texts = list(pool.map(self.preprocess, self.commands))
            list(pool.map(lambda number: self.compile(number, self.source, self.base), range(len(self.commands))))

    def make(self, directory, edit, jobs):
        """Links the library into a new directory, after an edit, (file, name, replacement), of the definition of a
        constant: "name = ...;". None: the library as it is."""
        os.mkdir(directory)
        changed = []
        if edit:
            copy = os.path.join(directory, "source")
            for room in ("space", "cuda"):
                shutil.copytree(os.path.join(self.source, room), os.path.join(copy, room))
            change(os.path.join(copy, edit[0]), edit[1], edit[2])
            # Whoever does more than define it.
            changed = [number for number, text in enumerate(self.texts)
                       if len(re.findall(r"\b%s\b" % edit[1], text)) > 1]
            if not changed:
                raise RuntimeError("nothing uses %s" % edit[1])
            with ThreadPoolExecutor(jobs) as pool:
                list(pool.map(lambda number: self.compile(number, copy, directory), changed))
            shutil.rmtree(copy)
        objects = [os.path.join(directory if number in changed else self.base, "%d.o" % number)
                   for number in range(len(self.commands))]
        self.link(objects, directory)
        return directory

    def command(self, number, source):
        """A compiler's call for the source at another place, and without what compiles it faster."""
        words = shlex.split(self.commands[number]["command"])
        for room in ("space", "cuda"):
            words = [word.replace(os.path.join(self.source, room) + os.sep, os.path.join(source, room) + os.sep)
                     for word in words]
        words = ["-I" + source if word == "-I" + self.source else word for word in words]
        return [word for word in words if not word.endswith("ccache")]

    def compile(self, number, source, directory):
        words = self.command(number, source)
        words[words.index("-o") + 1] = os.path.join(directory, "%d.o" % number)
        subprocess.run(words, cwd=self.commands[number]["directory"], check=True)

    # What a preprocessor is asked for besides its output.
    preprocessing = ["-P"]

    def preprocess(self, entry):
        words = self.command(self.commands.index(entry), self.source)
        words[words.index("-c")] = "-E"
        words[words.index("-o") + 1] = "-"
        words += self.preprocessing
        return subprocess.run(words, cwd=entry["directory"], check=True, stdout=subprocess.PIPE,
                              universal_newlines=True).stdout


def change(path, name, replacement):
    with open(path) as file:
        text, count = re.subn(r"\b%s = [^;]*;" % name, lambda _: "%s = %s;" % (name, replacement), file.read())
    if count != 1:
        raise RuntimeError("%s has %d definitions of %s" % (path, count, name))
    with open(path, "w") as file:
        file.write(text)


# What is timed: program, arguments, columns of its CSV that tell cells apart, and the column of the time. The scenes
# of pair-benchmark are found pairs first, so a variant that finds others is not timed.
def measurements(quick):
    ours = ["--peers=parallel-sap", "--budget=%g" % (0.02 if quick else 0.03), "--rounds=1"]
    told = ["--peers=parallel-sap:notified-begun-ended"] + ours[1:]
    pairs = ("scene", "n", "threads", "moving")
    seconds = "%g" % (0.02 if quick else 0.05)
    many = "dense-cube,heap,clusters,far-clusters,two-decades-of-size,six-decades-of-size,log-sizes-6,giant-among-dust," \
           "bars-among-cubes,long-bars,thin-bars,brownian-assorted,trembling,jumps,crowd-and-cube,touching-lattice,one-place"
    few = "dense-cube,heap,straight-line"
    runs = [
        ("pair-benchmark", ["--scenes=" + many, "--sizes=" + ("1000" if quick else "300,3000,30000")] + ours, pairs),
        ("pair-benchmark", ["--scenes=dense-cube,crowd-and-cube", "--sizes=" + ("2000" if quick else "10000,200000")] +
         ours, pairs),
        ("pair-benchmark", ["--scenes=" + few, "--sizes=2,4,8,16,32,64,96,120", "--batch=64"] + ours, pairs),
        ("pair-benchmark", ["--scenes=" + few, "--sizes=2,4,8,16,32,64,96,120", "--batch=64", "--still"] + ours, pairs),
        ("pair-benchmark", ["--scenes=" + few, "--sizes=300" + ("" if quick else ",30000"), "--still"] + ours,
         pairs),
        # Of a program that tells what it changes, and asks what began and ended.
        ("pair-benchmark", ["--scenes=dense-cube", "--sizes=" + ("2000" if quick else "20000"), "--moving=0.01"] + told,
         pairs),
        ("pair-benchmark", ["--scenes=dense-cube", "--sizes=" + ("2000" if quick else "20000"), "--still"] + told, pairs),
        ("rest-benchmark", ["--sizes=" + ("2000" if quick else "1000,30000"), "--seconds=" + seconds,
                            "--rounds=1"], ("setting", "n", "threads")),
        ("query-benchmark", ["--spaces=parallel-sap", "--sizes=" + ("1000" if quick else "32000"),
                             "--queries=100", "--seconds=" + seconds, "--rounds=1"],
         ("kind", "n", "queries", "moving")),
        # With one thread nobody looks ahead.
        ("query-benchmark", ["--spaces=parallel-sap", "--kinds=spaces", "--queries=100" + ("" if quick else ",10000"),
                             "--sizes=" + ("1000" if quick else "1000,32000"), "--threads=2", "--seconds=" + seconds,
                             "--rounds=1"], ("kind", "n", "queries", "moving", "threads")),
        # Geoms of a user's class: edges that may all meet, and vertices and faces, told apart by bits. (In two spaces, and
        # without trees for queries, one frame would take minutes.)
        ("mesh-benchmark", ["--made=" + ("40" if quick else "30,120,300"), "--seconds=" + seconds, "--rounds=1",
                            "--peers=parallel-sap,parallel-sap:mirrored"],
         ("mesh", "kind", "peer", "threads")),
        ("plane-benchmark", ["--stock=0", "--sizes=" + ("1000" if quick else "1000,30000"),
                             "--seconds=" + seconds, "--rounds=1"], ("variant", "bodies", "threads")),
    ]
    return runs


def timeOf(program, row):
    """The least of all frames is what others on the machine disturb least; but where frames differ all count."""
    scene = row.get("scene", "")
    if scene in ("crowd-and-cube", "trembling") or scene.startswith("pile-") or row.get("setting") == "others-move":
        return "mean_ms"
    return "min_ms" if "min_ms" in row else "median_ms"


def measure(project, library, quick, core=None, runs=None):
    """Milliseconds a cell, by its name. `core`: the processors to keep to; `runs`: others than measurements()."""
    times = {}
    environment = dict(os.environ, LD_LIBRARY_PATH=library + ":" + os.environ.get("LD_LIBRARY_PATH", ""),
                       OMP_WAIT_POLICY="active")
    for program, arguments, keys in runs or measurements(quick):
        with tempfile.TemporaryDirectory() as directory:
            table = os.path.join(directory, "table.csv")
            command = [os.path.join(project.programs, program)] + arguments + ["--csv=" + table]
            if core is not None:
                command = ["taskset", "-c", core] + command
            subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
            with open(table) as file:
                for row in csv.DictReader(file):
                    if row.get("status", "ok") != "ok":
                        continue
                    name = " ".join([program.split("-")[0]] + ["%s=%s" % (key, row[key]) for key in keys])
                    times[name] = float(row[timeOf(program, row)])
    return times
