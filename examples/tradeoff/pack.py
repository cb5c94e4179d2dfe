"""Packs the study for a machine that has nothing of it but Python: pack.py DIR PROGRAM...

Each PROGRAM is PRECISION=FILE. Beside those of a precision, in DIR/double and DIR/single, come all libraries that they
need and that are no part of the C library; the scripts, and a `run` that gives them these programs, come to DIR itself."""

import glob
import os
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # this folder is for sources

HERE = os.path.dirname(os.path.abspath(__file__))
OF_THE_C_LIBRARY = r"(lib(c|m|dl|rt|pthread)\.so|ld-linux)"
RUN = """#!/bin/sh
# The study, or what else was packed, on this machine. TRADEOFF_COMMIT is that of the programs.
here=$(cd "$(dirname "$0")" && pwd)
export TRADEOFF_COMMIT="${TRADEOFF_COMMIT:-%s}"
precision=$1
case $precision in
  double | single)
    program=$2
    shift 2
    LD_LIBRARY_PATH="$here/$precision/lib" exec "$here/$precision/$program" "$@" ;;
esac
exec python3 "$here/tradeoff.py" --double "$here/double/tradeoff-point" --single "$here/single/tradeoff-point" "$@"
"""


def libraries_of(program):
    listing = subprocess.run(["ldd", program], stdout=subprocess.PIPE, text=True, check=True).stdout
    lacking = re.findall(r"(\S+) => not found", listing)
    if lacking:
        sys.exit("pack.py: %s needs %s, which is not here" % (program, ", ".join(lacking)))
    return [(name, path) for name, path in re.findall(r"(\S+) => (/\S+)", listing) if not re.match(OF_THE_C_LIBRARY, name)]


def pack(directory, programs):
    os.makedirs(directory, exist_ok=True)
    for path in sorted(glob.glob(os.path.join(HERE, "*.py"))):
        if not path.endswith("_test.py"):
            shutil.copy(path, directory)
    for precision, program in programs:
        libraries = os.path.join(directory, precision, "lib")
        os.makedirs(libraries, exist_ok=True)
        shutil.copy(program, os.path.join(directory, precision))
        for name, path in libraries_of(program):
            shutil.copy(path, os.path.join(libraries, name))


def size_of(directory):
    return sum(os.path.getsize(os.path.join(root, name)) for root, _, names in os.walk(directory) for name in names)


def main():
    if len(sys.argv) < 3 or not all(re.match("(double|single)=.", word) for word in sys.argv[2:]):
        sys.exit(__doc__)
    import table
    directory = sys.argv[1]
    pack(directory, [word.split("=", 1) for word in sys.argv[2:]])
    path = os.path.join(directory, "run")
    with open(path, "w") as file:
        file.write(RUN % table.commit())
    os.chmod(path, 0o755)
    print("%s: %.1f MB. On the other machine: %s --out RESULTS --seconds 540" % (directory, size_of(directory) / 1e6, path))


main()
