"""Tests pile's pictures by what is in them: look.py <pile> <test>. Exit code 77: a tool is missing."""

import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
OPENING = 0.8  # drawstuff's tangent of half the angle of sight, across the picture

try:
    import numpy
    from matplotlib.image import imread
except ImportError:
    print("Skipped: needs Debian's python3-matplotlib")
    sys.exit(SKIPPED)

program = sys.argv[1]
folder = tempfile.mkdtemp()
picture_file = os.path.join(folder, "picture.png")


def check(holds, text):
    print(("ok: " if holds else "WRONG: ") + text)
    if not holds:
        sys.exit(1)


class Picture:
    """Which pixels show what, by the ratios of the colours: light changes only their sum."""

    def __init__(self, file):
        pixels = imread(file)
        check(pixels.shape == (600, 800, 3), f"the picture is 800 x 600 in colour: {pixels.shape}")
        self.pixels = pixels
        red, green, blue = (pixels[:, :, i] + 1e-6 for i in range(3))
        self.awake = (red > 1.5 * green) & (green > 2 * blue)
        self.asleep = (blue > 1.5 * red) & (red > 1.2 * green)
        self.sky = (blue > 1.6 * green) & (green > 3 * red)
        self.flat_ground = (abs(red - green) < 0.02) & (red > 1.4 * blue)
        self.terrain = (green > 1.005 * red) & (green < 1.1 * red) & (blue < green) & (blue > 0.8 * green)
        self.void = (abs(red - 0.5) < 0.01) & (abs(green - 0.5) < 0.01) & (abs(blue - 0.5) < 0.01)  # no ground, no sky
        self.contacts = (green > 1.8 * red) & (green > 1.8 * blue)
        self.boxes = (red > 1.15 * green) & (red < 1.55 * green) & (blue > 0.55 * green) & (blue < 0.8 * green)

    def share(self, name):
        return getattr(self, name).mean()

    def expect(self, name, least, most):
        share = self.share(name)
        check(least <= share <= most, f"{name}: {share:.4f} of the picture, expected {least} to {most}")


def snapshot(*options):
    """Runs without a display; returns the picture and what was printed."""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    result = subprocess.run([program, "--snapshot", picture_file, *options], env=environment,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(result.stdout)
    if "finds no OpenGL" in result.stdout:
        print("Skipped: no OpenGL here (Debian: libgl1-mesa-dri draws without a GPU)")
        sys.exit(SKIPPED)
    check(result.returncode == 0, f"the exit code is {result.returncode}")
    return Picture(picture_file), result.stdout


def numbers(pattern, text):
    return [float(group.replace(",", "")) for group in re.search(pattern, text).groups()]


def column_and_row(point, output):
    """Where the camera that the output names sees a point of the world."""
    x, y, z, heading, pitch = numbers(
        r"camera at \((\S+), (\S+), (\S+)\) m, heading (\S+), pitch (\S+) degrees", output)
    heading, pitch = math.radians(heading), math.radians(pitch)
    ahead = (math.cos(heading) * math.cos(pitch), math.sin(heading) * math.cos(pitch), math.sin(pitch))
    right = (math.sin(heading), -math.cos(heading), 0)
    up = (-math.cos(heading) * math.sin(pitch), -math.sin(heading) * math.sin(pitch), math.cos(pitch))
    offset = (point[0] - x, point[1] - y, point[2] - z)
    along = [sum(a * b for a, b in zip(axis, offset)) for axis in (ahead, right, up)]
    return (400 * (1 + along[1] / along[0] / OPENING), 300 - 400 * along[2] / along[0] / OPENING,
            along[0])


def test_place():
    """A ball on its way down is drawn where the camera must see it, as large as it must be."""
    for steps in (1, 60):
        picture, output = snapshot("--scene", "balls", "--bodies", "1", "--steps", str(steps), "-notex")
        height = numbers(r"centres between (\S+) and", output)[0]
        column, row, distance = column_and_row((0, 0, height), output)
        rows, columns = numpy.nonzero(picture.awake)
        radius = math.sqrt(len(rows) / math.pi) * OPENING / 400 * distance
        # It starts up to 0.08 spacings (0.1 m) from the axis; 0.15 m are this many pixels.
        slack = 0.15 / distance / OPENING * 400
        check(abs(columns.mean() - column) < slack, f"column {columns.mean():.1f}, expected {column:.1f}")
        check(abs(rows.mean() - row) < slack, f"row {rows.mean():.1f}, expected {row:.1f}")
        check(0.27 < radius < 0.53, f"its radius is {radius:.3f} m, of 0.3 to 0.5")


def test_colours():
    """Awake bodies are orange, those asleep violet, and nothing else is either."""
    options = ("--scene", "torus", "--bodies", "12", "-notex")
    picture, _ = snapshot(*options, "--steps", "1")
    picture.expect("awake", 0.05, 0.6)
    picture.expect("asleep", 0, 0)
    picture.expect("flat_ground", 0.2, 0.9)
    picture.expect("sky", 0.005, 0.3)
    picture, output = snapshot(*options, "--steps", "3000")
    check("12 of 12 bodies asleep" in output, "all bodies are asleep")
    picture.expect("awake", 0, 0)
    picture.expect("asleep", 0.05, 0.6)


def test_terrain():
    """A terrain hides drawstuff's flat ground; the bodies are many small boxes in the middle."""
    picture, _ = snapshot("--scene", "cubes", "--bodies", "500", "--steps", "1", "-notex")
    picture.expect("terrain", 0.2, 0.9)
    picture.expect("awake", 0.05, 0.6)
    rows, columns = numpy.nonzero(picture.awake)
    check(abs(columns.mean() - 400) < 60, f"their middle column is {columns.mean():.0f}")
    check(abs(rows.mean() - 300) < 90, f"their middle row is {rows.mean():.0f}")


def test_coarse():
    """Meshes of 20,000 triangles are drawn in their own size and place."""
    picture, output = snapshot("--scene", "skittles", "--bodies", "1", "--steps", "1", "-notex")
    height = numbers(r"centres between (\S+) and", output)[0]
    column, row, distance = column_and_row((0, 0, height), output)
    rows, columns = numpy.nonzero(picture.awake)
    metre = 400 / OPENING / distance
    length = math.hypot(numpy.ptp(rows), numpy.ptp(columns)) / metre
    check(abs(columns.mean() - column) < 0.5 * metre, f"column {columns.mean():.0f}, expected {column:.0f}")
    check(abs(rows.mean() - row) < 0.5 * metre, f"row {rows.mean():.0f}, expected {row:.0f}")
    check(0.5 < length < 2.2, f"{length:.2f} m from corner to corner, the pin is 1.5 m tall")


def reach(mask):
    """Rows and columns from the first to the last of it, as shares of the picture."""
    rows, columns = numpy.nonzero(mask)
    return rows.min() / 600, (rows.max() + 1) / 600, columns.min() / 800, (columns.max() + 1) / 800


def check_whole(mask, name):
    """It fills the picture in one direction, in the middle of both, and is not cut off."""
    top, bottom, left, right = reach(mask)
    text = f"{name} from {top:.3f} to {bottom:.3f} downwards, from {left:.3f} to {right:.3f} across"
    check(min(top, left) > 0 and max(bottom, right) < 1, text + ": nothing is cut off")
    check(max(bottom - top, right - left) > 0.65, text + ": the picture is full of it")
    check(abs(top + bottom - 1) < 0.16 and abs(left + right - 1) < 0.16, text + ": it is in the middle")


def test_whole():
    """All bodies are in the picture, high in the air or wide on the ground."""
    for options in (("alphabet", "--steps", "1"), ("torus", "--bodies", "60", "--steps", "150"),
                    ("skittles", "--bodies", "30", "--steps", "200"), ("cubes", "--bodies", "100", "--steps", "1")):
        picture, _ = snapshot("--scene", *options, "-notex")
        check_whole(picture.awake | picture.asleep, options[0])
        picture.expect("void", 0, 0.04)


def test_follow():
    """The window's camera keeps all bodies in the picture while they fall and spread."""
    need_window()
    for options in ("alphabet", "--steps", "500"), ("skittles", "--bodies", "30", "--steps", "200"):
        window = Window("--scene", *options, "-notex", "-noshadow", "--snapshot", picture_file)
        check(window.process.wait(timeout=200) == 0, "the window closes after --steps")
        picture = Picture(picture_file)
        check_whole(picture.awake | picture.asleep, options[0])
        picture.expect("void", 0, 0.04)


def test_bowl():
    """All of the bowl is in the picture, its near wall too, and the ball is seen through it."""
    picture, output = snapshot("--scene", "balls", "--bodies", "1", "--steps", "1", "-notex")
    check_whole(picture.terrain, "the bowl")
    height = numbers(r"centres between (\S+) and", output)[0]
    column, row, _ = (round(n) for n in column_and_row((0, 0, height), output))
    red, _, blue = (float(n) for n in picture.pixels[row, column])
    check(blue > 0.15 * red, f"the ball's colour is mixed with the wall's: {blue / red:.3f}")
    # The rim nearest to the camera, of a bowl 8 m wide and 12 m deep with 40 sides.
    x, y = numbers(r"camera at \((\S+), (\S+), ", output)
    across = 8 * math.cos(math.pi / 40) / math.hypot(x, y)
    column, row, _ = (round(n) for n in column_and_row((across * x, across * y, 12), output))
    above, below = (float(picture.pixels[row + d, column - 20:column + 21].mean()) for d in (-6, 6))
    check(abs(above - below) > 0.005, f"the wall begins below row {row}: {above:.3f} above, {below:.3f} below")


def test_legible():
    """Where there are very many bodies, those in the middle are still large enough to be made out."""
    for scene, size in ("skittles", 0.5), ("cubes", 0.8):  # the side of a cube of a body's volume
        picture, output = snapshot("--scene", scene, "--steps", "1", "-notex")
        lowest, highest = numbers(r"centres between (\S+) and (\S+) m", output)
        _, _, distance = column_and_row((0, 0, (lowest + highest) / 2), output)
        check(400 / OPENING / distance * size > 5.5, f"a body in the middle is {400 / OPENING / distance * size:.1f} pixels wide")
        picture.expect("awake", 0.2, 0.9)


def test_readme():
    """The picture in the README is what the command beside it draws (on other systems: nearly)."""
    here = os.path.dirname(os.path.abspath(__file__))
    with open(os.path.join(here, "..", "..", "README.md")) as file:
        options = re.search(r"`pile (--scene cubes .*) --snapshot cubes\.png` draws", file.read()).group(1)
    picture, _ = snapshot(*options.split())
    shown = Picture(os.path.join(here, "..", "pictures", "cubes.png"))
    for name in "awake", "asleep", "terrain", "sky":
        picture.expect(name, 0.7 * shown.share(name), 1.4 * shown.share(name))
    for ours, theirs in zip(reach(picture.awake), reach(shown.awake)):
        check(abs(ours - theirs) < 0.1, f"awake bodies begin or end at {ours:.2f}, in the README's at {theirs:.2f}")


def test_flags():
    """-notex leaves out the textures."""
    plain, _ = snapshot("--scene", "torus", "--bodies", "12", "--steps", "1", "-notex")
    textured, _ = snapshot("--scene", "torus", "--bodies", "12", "--steps", "1")
    ground = plain.flat_ground
    pixels = plain.pixels[ground]  # among them drawstuff's few yellow pyramids
    alike = (abs(pixels - numpy.median(pixels, axis=0)) < 0.01).all(axis=1).mean()
    check(alike > 0.99, f"the ground has one colour without textures: {100 * alike:.1f} % of it")
    check(textured.pixels[ground].std(axis=0).max() > 0.02, "and many with them")


def test_interrupt():
    """Ctrl-C ends the run with the picture that was asked for."""
    process = subprocess.Popen([program, "--scene", "torus", "--bodies", "12", "--steps", "1000000", "-notex", "--snapshot",
                                picture_file], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    text = ""
    for text in process.stdout:
        if "steps of" in text:
            break
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    rest = process.communicate(timeout=60)[0]
    if "finds no OpenGL" in text + rest:
        print("Skipped: no OpenGL here (Debian: libgl1-mesa-dri draws without a GPU)")
        sys.exit(SKIPPED)
    check(process.returncode == 130, f"the exit code is {process.returncode}")
    check("Interrupted after" in rest, "the table says so")
    # On a fast machine they are asleep by then.
    picture = Picture(picture_file)
    bodies = picture.share("awake") + picture.share("asleep")
    check(0.05 < bodies < 0.6, f"bodies: {bodies:.4f} of the picture, expected 0.05 to 0.6")


class Window:
    """pile --view under an X server of our own."""

    def __init__(self, *options):
        self.process = subprocess.Popen([program, "--view", *options], stdout=subprocess.DEVNULL)
        self.name = ""

    def key(self, *keys):
        found = subprocess.run(["xdotool", "search", "--name", "^pile: step"], stdout=subprocess.PIPE,
                               text=True)
        subprocess.run(["xdotool", "key", "--window", found.stdout.split()[0], *keys],
                       stderr=subprocess.DEVNULL)  # the window may be gone before the key is let go

    def wait_for(self, pattern):
        end = time.monotonic() + 60
        while time.monotonic() < end and self.process.poll() is None:
            name = subprocess.run(["xdotool", "search", "--name", "^pile: step", "getwindowname"],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
            if re.search(pattern, name):
                return name
            time.sleep(0.1)
        self.process.kill()
        check(False, f"the window's title becomes '{pattern}'")

    def close(self):
        self.key("ctrl+x")
        check(self.process.wait(timeout=60) == 0, "Ctrl-X ends the program with exit code 0")


def need_window():
    for tool, package in (("Xvfb", "xvfb"), ("xvfb-run", "xvfb"), ("xauth", "xauth"), ("xdotool", "xdotool")):
        if not shutil.which(tool):
            print(f"Skipped: needs Debian's {package}")
            sys.exit(SKIPPED)
    if "PILE_LOOK_INSIDE" not in os.environ:
        os.environ["PILE_LOOK_INSIDE"] = "1"
        os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", "-noreset -screen 0 1024x768x24", sys.executable, *sys.argv])


def test_window():
    """The keys that drawstuff's users know, and the times in the title."""
    need_window()
    part = r" [0-9.]+"
    title = (rf"step \d+, [0-9.]+ ms: broad phase{part} \(update{part}, synchronise{part}, "
             rf"extract{part}, filter{part}, report{part}\), narrow phase{part}, joints{part}, "
             rf"solver{part}; \d+ of 12 asleep")
    shares = {}
    for key in ("p", "a", "t", "o"):
        window = Window("--scene", "torus", "--bodies", "12", "--dt", "0.01", "--steps", "150", "-notex",
                        "-noshadow", "--snapshot", picture_file)
        window.wait_for(title)
        window.key(key)
        check(window.process.wait(timeout=60) == 0, "the window closes after --steps")
        shares[key] = Picture(picture_file)
    shares["p"].expect("awake", 0.05, 0.6)  # a key without a meaning
    shares["p"].expect("contacts", 0, 0)
    shares["p"].expect("boxes", 0, 0.002)
    shares["a"].expect("boxes", 0.02, 0.6)
    shares["t"].expect("contacts", 0.0001, 0.02)
    shares["o"].expect("awake", 0, 0)


def test_shove():
    """Space wakes all and throws them upwards; the run may end with more energy than it began with."""
    need_window()
    window = Window("--scene", "torus", "--bodies", "3", "--dt", "0.01", "-notex", "--snapshot",
                    picture_file)
    window.wait_for("; 3 of 3 asleep")
    window.key("space")
    window.wait_for("; 0 of 3 asleep")
    window.close()
    Picture(picture_file).expect("awake", 0.002, 0.6)


def test_pause():
    """-pause holds the first step back; Ctrl-O makes one, Ctrl-P lets it go on; Ctrl-C ends it, paused or not."""
    need_window()
    window = Window("--scene", "torus", "--bodies", "3", "-pause")
    window.wait_for("^pile: step 0,")
    time.sleep(0.5)
    window.wait_for("^pile: step 0,")
    window.key("ctrl+o")
    window.wait_for("^pile: step 1,")
    window.key("ctrl+p")
    window.wait_for(r"^pile: step \d\d,")
    window.key("ctrl+p")
    time.sleep(0.5)
    window.process.send_signal(signal.SIGINT)
    check(window.process.wait(timeout=60) == 130, "Ctrl-C ends the program while it pauses, with exit code 130")


def test_keys():
    """drawstuff's own: textures, the camera."""
    need_window()

    def picture(act):
        window = Window("--scene", "torus", "--bodies", "3", "-pause", "-notex", "-noshadow", "--snapshot", picture_file)
        window.wait_for("^pile: step 0,")
        act(window)
        window.close()
        return Picture(picture_file)

    def drag(_):
        subprocess.run(["xdotool", "mousemove", "300", "300", "mousedown", "1", "mousemove_relative", "--sync", "60", "0",
                        "mouseup", "1"], check=True)
        time.sleep(0.3)

    plain = picture(lambda window: None)
    for name, act in ("Ctrl-T", lambda window: window.key("ctrl+t")), ("dragging", drag):
        changed = (abs(picture(act).pixels - plain.pixels).sum(axis=2) > 0.1).mean()
        check(changed > 0.005, f"{name} changes {changed:.3f} of the picture")


def main():
    try:
        globals()["test_" + sys.argv[2]]()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


main()
