#!/usr/bin/env python3
"""The conda recipe, without conda.

conda.py check SOURCE VERSION CACHE
    The recipe is YAML, of the project's VERSION, names files that are there, and its build script sets what is in the
    CMakeCache.txt of a build.
conda.py build SOURCE FOLDER CACHE
    Does what a build of the recipe does: ODE of the version it names, built into a prefix, stands in for libode; the
    build script runs with the variables that conda sets; the recipe's tests run on what it installed. Skipped where
    that ODE's source is not to be had.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

SKIPPED = 77
try:
    import yaml
except ImportError:
    print("skipped: no PyYAML (Debian: python3-yaml)")
    sys.exit(SKIPPED)

HERE = pathlib.Path(__file__).resolve().parent
NOT_IN_REPOSITORY = shutil.ignore_patterns(".git", ".cache", ".carry", "__pycache__")


def copy_tree(source, target):
    """What is in the repository, for rattler-build takes what git does not ignore."""

    def left_out(folder, names):
        builds = {name for name in names if name.startswith("build")} if pathlib.Path(folder) == source else set()
        return builds | set(NOT_IN_REPOSITORY(folder, names))

    shutil.copytree(source, target, ignore=left_out, symlinks=True)


def read_recipe(source):
    recipe = yaml.safe_load((source / "space/cmake/conda/recipe.yaml").read_text())

    def filled(value):
        return re.sub(r"\$\{\{ *(\w+) *\}\}", lambda name: recipe["context"][name[1]], value)

    return recipe, filled


def check(source, version, cache):
    recipe, filled = read_recipe(source)
    assert filled(recipe["package"]["version"]) == version, f"the recipe is of another version than {version}"
    tree, ode = recipe["source"]
    assert (source / "space/cmake/conda" / tree["path"]).resolve() == source, "the recipe builds another tree"
    assert ode["url"].startswith("https://") and re.fullmatch("[0-9a-f]{64}", ode["sha256"]), ode
    assert f"libode {recipe['context']['ode_version']}" in map(filled, recipe["requirements"]["host"])
    script = source / recipe["build"]["script"]
    named = [script, source / "LICENSE"]
    named += [source / name for test in recipe["tests"] for name in test.get("files", {}).get("source", [])]
    for path in named:
        assert path.exists(), f"there is no {path}"
    assert os.access(script, os.X_OK), f"{script} cannot be run"
    known = set(re.findall(r"^([\w-]+):\w+=", cache.read_text(), re.MULTILINE))
    wanted = set(re.findall(r" -D(\w+)=", script.read_text()))
    assert len(wanted) > 5 and wanted <= known | {"CMAKE_INSTALL_LIBDIR"}, f"not settings: {wanted - known}"


def run(command, **options):
    done = subprocess.run(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options)
    if done.returncode != 0:
        print(done.stdout)
        sys.exit(f"{command} ended with status {done.returncode}")
    return done.stdout


def find_ode(source, version, cache):
    """ODE's source tree, fetched as a configuration of the project fetches it."""
    said = run(["cmake", f"-DSOURCE={source}", f"-DVERSION={version}", f"-DODE_PARALLEL_SAP_ODE_CACHE={cache}", "-P", HERE / "conda_ode.cmake"])
    found = re.search("^ode source tree: (.+)$", said, re.MULTILINE)
    if not found:
        print(said + f"skipped: the source of ODE {version} is not to be had")
        sys.exit(SKIPPED)
    return pathlib.Path(found[1])


def install_ode(ode, folder, prefix):
    """As conda-forge's recipe of libode does, but with the libccd that comes with ODE."""
    run(["cmake", "-S", ode, "-B", folder / "ode", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_INSTALL_PREFIX={prefix}",
         "-DCMAKE_INSTALL_LIBDIR=lib", "-DODE_WITH_LIBCCD=ON", "-DODE_WITH_LIBCCD_BOX_CYL=OFF", "-DODE_WITH_DEMOS=OFF",
         "-DODE_WITH_TESTS=OFF", "-DCMAKE_POLICY_VERSION_MINIMUM=3.5"])
    run(["cmake", "--build", folder / "ode", "--parallel", str(os.cpu_count())])
    run(["cmake", "--install", folder / "ode"])


def variables_of_conda(prefix):
    """What conda's compilers and rattler-build set, as far as a build could trip over it."""
    kept = {name: os.environ[name] for name in ("PATH", "HOME", "CC", "CXX") if name in os.environ}
    flags = f"-march=nocona -mtune=haswell -ftree-vectorize -fPIC -fstack-protector-strong -O2 -pipe -isystem {prefix}/include"
    if os.uname().machine != "x86_64":
        flags = flags.replace("-march=nocona -mtune=haswell ", "")
    modes = "".join(f" -DCMAKE_FIND_ROOT_PATH_MODE_{kind}=ONLY" for kind in ("LIBRARY", "INCLUDE"))
    return kept | {
        "PREFIX": str(prefix), "CPU_COUNT": str(os.cpu_count()), "PKG_CONFIG_PATH": f"{prefix}/lib/pkgconfig",
        "CFLAGS": flags, "CXXFLAGS": f"-fvisibility-inlines-hidden -fmessage-length=0 {flags}",
        "CPPFLAGS": f"-DNDEBUG -D_FORTIFY_SOURCE=2 -O2 -isystem {prefix}/include",
        "LDFLAGS": f"-Wl,-O2 -Wl,--sort-common -Wl,--as-needed -Wl,--disable-new-dtags -Wl,-rpath,{prefix}/lib -L{prefix}/lib",
        "CMAKE_ARGS": f"-DCMAKE_FIND_ROOT_PATH={prefix};/{modes} -DCMAKE_FIND_ROOT_PATH_MODE_PROGRAM=NEVER "
                      f"-DCMAKE_INSTALL_PREFIX={prefix} -DCMAKE_INSTALL_LIBDIR=lib"}


def run_tests(recipe, source, folder, variables):
    contents, use = recipe["tests"]
    prefix = pathlib.Path(variables["PREFIX"])
    names = contents["package_contents"]
    paths = [f"include/{name}" for name in names["include"]] + [f"lib/lib{name}.so" for name in names["lib"]]
    for path in paths + names["files"]:
        assert (prefix / path).exists(), f"not installed: {path}"
    place = folder / "test"
    for name in use["files"]["source"]:
        target = place / name
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source / name, target) if name.endswith("/") else shutil.copy(source / name, target)
    for line in use["script"]:
        run(["bash", "-ec", line], cwd=place, env=variables)
        print(f"{line}: works")


def build(source, folder, cache):
    if not shutil.which("ninja"):
        print("skipped: no ninja (Debian: ninja-build)")
        sys.exit(SKIPPED)
    recipe, _ = read_recipe(source)
    ode = find_ode(source, recipe["context"]["ode_version"], cache)
    shutil.rmtree(folder, ignore_errors=True)
    prefix, tree = folder / "prefix", folder / "work"
    copy_tree(source, tree)
    shutil.copytree(ode, tree / "ode", ignore=shutil.ignore_patterns(".git"))
    install_ode(ode, folder, prefix)
    variables = variables_of_conda(prefix)
    run([tree / recipe["build"]["script"]], cwd=tree, env=variables)
    for name in recipe["about"]["license_file"]:
        assert (tree / name).exists(), f"there is no {name}"
    found = run(["ldd", prefix / "lib/libode-parallel-sap.so"])
    assert re.search(f"libode\\.so[.0-9]* => {re.escape(str(prefix))}/lib/", found), f"linked with another libode:\n{found}"
    run_tests(recipe, source, folder, variables)


if __name__ == "__main__":
    paths = [pathlib.Path(argument).resolve() for argument in sys.argv[2:]]
    if sys.argv[1] == "check":
        check(paths[0], sys.argv[3], paths[2])
    else:
        build(*paths)
