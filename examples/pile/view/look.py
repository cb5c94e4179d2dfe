"""Tests pile's pictures by what is in them: look.py <pile> <test>. Exit code 77: a tool is missing."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

SKIPPED = 77

try:
    import numpy
    from matplotlib.image import imread
except ImportError:
    print("Skipped: needs Debian's python3-matplotlib")
    sys.exit(SKIPPED)

program = sys.argv[1]
HERE = os.path.dirname(os.path.abspath(__file__))


def check(holds, text):
    print(("ok: " if holds else "WRONG: ") + text)
    if not holds:
        sys.exit(1)


class Picture:
    """Which pixels show what, by the ratios of the colours: light changes only their sum."""

    def __init__(self, file):
        self.pixels = imread(file)
        check(self.pixels.shape == (600, 800, 3), f"the picture is 800 x 600 in colour: {self.pixels.shape}")
        red, green, blue = (self.pixels[:, :, i] + 1e-6 for i in range(3))
        self.awake = (red > 1.5 * green) & (green > 2 * blue)
        self.asleep = (blue > 1.5 * red) & (red > 1.2 * green)
        self.sky = (blue > 1.6 * green) & (green > 3 * red)
        self.terrain = (green > 1.005 * red) & (green < 1.1 * red) & (blue < green) & (blue > 0.8 * green)
        self.contacts = (green > 1.8 * red) & (green > 1.8 * blue)
        self.boxes = (red > 1.15 * green) & (red < 1.55 * green) & (blue > 0.55 * green) & (blue < 0.8 * green)

    def expect(self, **shares):
        for name, (least, most) in shares.items():
            share = getattr(self, name).mean()
            check(least <= share <= most, f"{name}: {share:.4f} of the picture, expected {least} to {most}")


def snapshot(file, *options):
    """Without a display."""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    result = subprocess.run([program, "--snapshot", file, *options], env=environment, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)
    if "finds no OpenGL" in result.stdout:
        print("Skipped: no OpenGL here (Debian: libgl1-mesa-dri draws without a GPU)")
        sys.exit(SKIPPED)
    check(result.returncode == 0, f"the exit code is {result.returncode}")
    return Picture(file)


def test_scenes(file):
    """Awake bodies are in the middle of each scene's picture, as many as they should be."""
    for scene in ("--scene cubes --bodies 500", "--scene balls --bodies 200", "--scene skittles --bodies 30",
                  "--scene torus --bodies 60", "--scene alphabet"):
        picture = snapshot(file, "--steps", "1", *scene.split())
        picture.expect(awake=(0.02, 0.5), asleep=(0, 0.001))
        rows, columns = numpy.nonzero(picture.awake)
        check(abs(columns.mean() - 400) < 60 and abs(rows.mean() - 300) < 60, f"{scene}: bodies are in the middle")
        check(rows.min() > 0 and rows.max() < 599 and columns.min() > 0 and columns.max() < 799, "none is cut off")
    picture = snapshot(file, "--scene", "torus", "--bodies", "12", "--steps", "3000")
    picture.expect(awake=(0, 0.001), asleep=(0.02, 0.5))


def test_readme(file):
    """The picture in the README is what the command beside it draws (on other systems: nearly)."""
    with open(os.path.join(HERE, "..", "..", "README.md")) as readme:
        options = re.search(r"`pile (--scene cubes .*) --snapshot cubes\.png` draws", readme.read()).group(1)
    picture = snapshot(file, *options.split())
    shown = Picture(os.path.join(HERE, "..", "pictures", "cubes.png"))
    for name in "awake", "asleep", "terrain", "sky":
        share = getattr(shown, name).mean()
        picture.expect(**{name: (0.7 * share, 1.4 * share)})


def test_window(file):
    """The keys that the README names, and the title; --steps close the window."""
    for tool, package in (("Xvfb", "xvfb"), ("xvfb-run", "xvfb"), ("xauth", "xauth"), ("xdotool", "xdotool")):
        if not shutil.which(tool):
            print(f"Skipped: needs Debian's {package}")
            sys.exit(SKIPPED)
    if "PILE_LOOK_INSIDE" not in os.environ:
        os.environ["PILE_LOOK_INSIDE"] = "1"
        os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", "-noreset -screen 0 1024x768x24", sys.executable, *sys.argv])

    def find(*more):
        return subprocess.run(["xdotool", "search", "--name", "^pile: step", *more], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True).stdout

    def wait_for(process, pattern):
        end = time.monotonic() + 60
        while not re.search(pattern, find("getwindowname")):
            check(time.monotonic() < end and process.poll() is None, f"the window's title becomes '{pattern}'")
            time.sleep(0.1)

    def press(key):
        subprocess.run(["xdotool", "key", "--window", find().split()[0], key], stderr=subprocess.DEVNULL)

    pictures = {}
    for key in "p", "a", "t":
        process = subprocess.Popen([program, "--view", "--scene", "torus", "--bodies", "12", "--steps", "300", "--snapshot", file])
        wait_for(process, r"step \d+, [0-9.]+ ms, broad phase [0-9.]+; \d+ of 12 asleep")
        press(key)
        check(process.wait(timeout=60) == 0, "the window closes after --steps")
        pictures[key] = Picture(file)
    pictures["p"].expect(awake=(0.03, 0.6), contacts=(0, 0), boxes=(0, 0.002))  # a key without a meaning
    pictures["a"].expect(boxes=(0.02, 0.6))
    pictures["t"].expect(contacts=(0.0001, 0.02))
    process = subprocess.Popen([program, "--view", "--scene", "torus", "--bodies", "3"])
    wait_for(process, r"step \d\d,")
    press("ctrl+p")
    time.sleep(1)
    paused = find("getwindowname")
    time.sleep(1)
    check(find("getwindowname") == paused, "Ctrl-P pauses")
    press("ctrl+x")
    check(process.wait(timeout=60) == 0, "Ctrl-X ends the program with exit code 0")


with tempfile.TemporaryDirectory() as folder:
    globals()["test_" + sys.argv[2]](os.path.join(folder, "picture.png"))
