#!/usr/bin/env python3
"""conda.py SOURCE VERSION CACHE: the conda recipe, without conda. It is YAML, of the project's VERSION, names files that are there,
and its build script sets what is in the CMakeCache.txt of a build."""
import os
import pathlib
import re
import sys

try:
    import yaml
except ImportError:
    print("skipped: no PyYAML (Debian: python3-yaml)")
    sys.exit(77)

source, version, cache = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2], pathlib.Path(sys.argv[3])
recipe = yaml.safe_load((source / "space/cmake/conda/recipe.yaml").read_text())
filled = lambda value: re.sub(r"\$\{\{ *(\w+) *\}\}", lambda name: recipe["context"][name[1]], value)
assert filled(recipe["package"]["version"]) == version, f"the recipe is of another version than {version}"
tree, ode = recipe["source"]
assert (source / "space/cmake/conda" / tree["path"]).resolve() == source, "the recipe builds another tree"
assert ode["url"].startswith("https://") and re.fullmatch("[0-9a-f]{64}", ode["sha256"]), ode
assert f"libode {recipe['context']['ode_version']}" in map(filled, recipe["requirements"]["host"])
script = source / recipe["build"]["script"]
for path in [script, source / "LICENSE"] + [source / name for test in recipe["tests"] for name in test.get("files", {}).get("source", [])]:
    assert path.exists(), f"there is no {path}"
assert os.access(script, os.X_OK), f"{script} cannot be run"
known = set(re.findall(r"^([\w-]+):\w+=", cache.read_text(), re.MULTILINE))
wanted = set(re.findall(r" -D(\w+)=", script.read_text()))
assert len(wanted) > 5 and wanted <= known | {"CMAKE_INSTALL_LIBDIR"}, f"not settings: {wanted - known}"
