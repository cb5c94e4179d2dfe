"""Tests what pile writes and does, option by option: effects.py <pile>."""

import csv
import os
import pty
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from xml.etree import ElementTree

program = sys.argv.pop(1)
README = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "README.md")

STAGES = ("update_ms", "synchronise_ms", "extract_ms", "filter_ms", "report_ms")
PARTS = ("broad_ms", "narrow_ms", "joints_ms", "solver_ms")
SMALL = ("--scene", "balls", "--bodies", "60", "--steps", "120")


class Folder(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "pile.csv")

    def run_pile(self, *options, code=0, **how):
        result = subprocess.run([program, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **how)
        self.assertEqual(result.returncode, code, result.stdout)
        return result.stdout

    def rows(self, *options):
        self.run_pile(*options, "--csv", self.file)
        with open(self.file, newline="") as file:
            return list(csv.DictReader(file))

    def motion(self, *options):
        return [(row["pairs"], row["contacts"], row["energy"]) for row in self.rows(*options)]


def readme_columns():
    with open(README) as file:
        text = re.search(r"^CSV columns:.*?\n\n", file.read(), re.M | re.S).group()
    text = text.replace("`update_ms` to `report_ms`", " ".join("`%s`" % stage for stage in STAGES))
    return re.findall(r"`([a-z_]+)`", text)


class Files(Folder):
    def test_the_csv_file_has_the_columns_that_the_readme_names(self):
        rows = self.rows(*SMALL)
        self.assertEqual(list(rows[0]), readme_columns())
        self.assertEqual([row["frame"] for row in rows], [str(i + 1) for i in range(120)])
        self.assertAlmostEqual(float(rows[-1]["time_s"]), 1.2)
        for row in rows:
            self.assertNotIn("", row.values())
            self.assertAlmostEqual(float(row["step_ms"]), sum(float(row[part]) for part in PARTS), delta=0.001 * float(row["step_ms"]))
            self.assertEqual(row["geoms"], "61")
            self.assertGreater(float(row["solver_ms"]), 0)
        self.assertGreater(max(int(row["pairs"]) for row in rows), 60)
        self.assertGreater(max(int(row["contacts"]) for row in rows), 10)
        self.assertGreater(max(float(row["deepest_m"]) for row in rows), 0.001)
        self.assertGreater(max(float(row["fastest_m_s"]) for row in rows), 3)

    def test_only_our_space_has_stages(self):
        for row in self.rows(*SMALL, "--space", "hash"):
            self.assertEqual({row[stage] for stage in STAGES}, {""})
            self.assertGreater(float(row["broad_ms"]), 0)

    def test_a_file_that_ends_too_soon_is_an_error(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

        output = self.run_pile(*SMALL, "--csv", self.file, code=1, preexec_fn=limit, restore_signals=False)
        self.assertIn("pile: cannot write all of the file " + self.file, output)


class Options(Folder):
    def test_a_seed_makes_one_pile_and_another_seed_another(self):
        first = self.motion(*SMALL, "--seed", "1")
        self.assertEqual(self.motion(*SMALL), first)
        self.assertNotEqual(self.motion(*SMALL, "--seed", "2"), first)

    def test_the_time_step_is_taken(self):
        rows = self.rows(*SMALL, "--dt", "0.005")
        self.assertAlmostEqual(float(rows[-1]["time_s"]), 0.6)
        # In free fall a body gains 9.81 m/s a second: fewer than at 10 ms, by half.
        self.assertAlmostEqual(float(rows[9]["fastest_m_s"]), 9.81 * 0.05, delta=0.02)

    def test_more_iterations_change_the_solution(self):
        self.assertNotEqual(self.motion(*SMALL, "--iterations", "5"), self.motion(*SMALL, "--iterations", "50"))

    def test_no_pair_keeps_more_contacts_than_asked_for(self):
        contacts = {}
        for most in 1, 3:
            rows = self.rows("--scene", "torus", "--bodies", "8", "--steps", "200", "--contacts", str(most))
            for row in rows:
                self.assertLessEqual(int(row["contacts"]), most * int(row["pairs"]))
            contacts[most] = sum(int(row["contacts"]) for row in rows)
        self.assertGreater(contacts[3], 1.5 * contacts[1])
        self.assertGreater(contacts[1], 100)

    def test_pairs_of_sleepers_have_no_contacts(self):
        rows = self.rows("--scene", "alphabet", "--bodies", "3", "--steps", "1500")
        asleep = [row for row in rows if row["asleep"] == "3"]
        self.assertGreater(len(asleep), 10)
        for row in asleep[1:]:  # the last one falls asleep at the end of a step
            self.assertEqual(row["contacts"], "0")
            self.assertNotEqual(row["pairs"], "0")

    def test_pairs_of_the_ground_with_itself_are_left_out_on_demand(self):
        cubes = ("--bodies", "200", "--steps", "100")
        stock, skipped = self.rows(*cubes), self.rows(*cubes, "--skip-static")
        self.assertEqual([row["energy"] for row in stock], [row["energy"] for row in skipped])
        self.assertGreater(sum(int(row["contacts"]) for row in stock), 100)
        fewer = {int(row["pairs"]) - int(other["pairs"]) for row, other in zip(stock, skipped)}
        self.assertEqual(len(fewer), 1)
        self.assertGreater(fewer.pop(), 240)  # each tile has neighbours

    def test_pairs_of_sleepers_are_left_out_on_demand(self):
        letters = ("--scene", "alphabet", "--bodies", "3", "--steps", "1500")
        stock, skipped = self.rows(*letters), self.rows(*letters, "--skip-asleep")
        self.assertEqual([row["energy"] for row in stock], [row["energy"] for row in skipped])
        self.assertEqual(stock[0]["pairs"], skipped[0]["pairs"])
        self.assertEqual(stock[-1]["asleep"], "3")
        self.assertNotEqual(stock[-1]["pairs"], "0")
        self.assertEqual(skipped[-1]["pairs"], "0")

    def test_a_tolerance_adds_pairs_and_no_contact(self):
        balls = ("--scene", "balls", "--bodies", "300", "--steps", "100", "--settle", "120")
        stock, more = self.rows(*balls), self.rows(*balls, "--tolerance", "0.2")
        for column in "energy", "contacts":
            self.assertEqual([row[column] for row in stock], [row[column] for row in more])
        pairs, with_more = (sum(int(row["pairs"]) for row in rows) for rows in (stock, more))
        self.assertGreater(with_more, 1.02 * pairs)

    def test_more_erp_pushes_out_faster_and_more_cfm_gives_more(self):
        def depth(*options):
            rows = self.rows("--scene", "balls", "--bodies", "60", "--steps", "100", "--settle", "250", "--sleep", "off", *options)
            return sum(float(row["deepest_m"]) for row in rows[50:])

        stock = depth()
        self.assertGreater(depth("--erp", "0.01"), 1.2 * stock)
        self.assertGreater(depth("--cfm", "0.01"), 1.2 * stock)
        self.assertEqual(depth("--erp", "0.2", "--cfm", "1e-5", "--density", "1"), stock)

    def test_bodies_have_the_density_asked_for(self):
        light, heavy = self.rows(*SMALL), self.rows(*SMALL, "--density", "1000")
        self.assertAlmostEqual(float(heavy[0]["energy"]) / float(light[0]["energy"]), 1000, delta=1e-6)
        self.assertNotEqual(float(heavy[-1]["energy"]) / 1000, float(light[-1]["energy"]))  # CFM counts
        # In the air masses do not matter, nor to the letter what they are multiplied by.
        self.assertEqual(heavy[5]["fastest_m_s"], light[5]["fastest_m_s"])

    def test_threads_are_those_asked_for_or_those_there_are(self):
        one = sorted(os.sched_getaffinity(0))[:1]
        options = ("--scene", "balls", "--bodies", "10000", "--steps", "1", "--method", "sweep", "--backend", "cpu")
        for asked, wanted, settings in (("1", "1", {}), ("3", "3", {}),
                                        ("0", "1", {"preexec_fn": lambda: os.sched_setaffinity(0, one)})):
            said = self.run_pile(*options, "--threads", asked, **settings)
            self.assertRegex(said, r"broad phase .* %s\n" % wanted)
            self.assertIn("dParallelSAPSpace (sweep, cpu)\n", said)
            self.assertIn("\n1 step of ", said)
            self.assertEqual(len(re.findall("thread", said)), 1, said)  # the table's column

    def test_a_back_end_is_used_or_an_error(self):
        result = subprocess.run([program, "--bodies", "3000", "--steps", "5", "--backend", "cuda"], text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if result.returncode == 2:
            self.assertIn("the back end cuda is not to be had here", result.stdout)
        else:
            self.assertEqual(result.returncode, 0, result.stdout)
            self.assertRegex(result.stdout, r"dParallelSAPSpace \(.*, cuda,")

    def test_parallel_stepping_has_threads_of_its_own(self):
        def threads(*options):
            # dSimpleSpace has none, and its step lasts long enough to look.
            with Running("--bodies", "6000", "--space", "simple", *options) as pile:
                pile.wait_until(lambda: pile.work() > 0.5)
                with open("/proc/%d/status" % pile.process.pid) as file:
                    return int(re.search(r"Threads:\s*(\d+)", file.read()).group(1))

        self.assertEqual(threads("--stepping", "parallel", "--threads", "3"), 3 + threads())

    def test_the_narrow_phase_is_parallel_unless_the_space_or_the_user_says_otherwise(self):
        loop, bulk = "Narrow phase: dCollide in a loop", "Narrow phase: dParallelSAPSpaceCollideContacts."
        for options, said in ((), bulk), (("--narrow", "parallel"), bulk), (("--narrow", "serial"), loop + "."), (
                ("--space", "hash"), loop + ", as ODE's own spaces have no other."):
            self.assertIn(said + "\n", self.run_pile(*SMALL, *options))

    def test_a_parallel_narrow_phase_reports_no_pairs(self):
        self.assertGreater(sum(float(row["report_ms"]) for row in self.rows(*SMALL, "--narrow", "serial")), 0)
        self.assertEqual({row["report_ms"] for row in self.rows(*SMALL)}, {"0"})

    def test_the_pile_has_settled_before_what_is_shown(self):
        rows = self.rows("--scene", "balls", "--bodies", "60", "--steps", "20", "--settle", "120")
        self.assertEqual(len(rows), 20)
        self.assertGreater(int(rows[0]["contacts"]), 30)
        self.assertEqual(self.rows("--scene", "balls", "--bodies", "60", "--steps", "20")[0]["contacts"], "0")

    def test_what_is_shown_begins_with_one_pile_for_all_spaces(self):
        settled = ("--scene", "balls", "--bodies", "60", "--steps", "1", "--settle", "150")
        first = {kind: self.rows(*settled, "--space", kind)[0] for kind in ("parallel", "hash", "sap", "simple")}
        self.assertGreater(int(first["parallel"]["contacts"]), 30)
        for column in "pairs", "contacts", "deepest_m":
            self.assertEqual(len({row[column] for row in first.values()}), 1, column)

    def test_the_orders_of_creation_are_of_the_same_pile(self):
        settled = ("--scene", "balls", "--bodies", "60", "--steps", "5", "--settle", "120")
        place, other = (self.rows(*settled, "--creation-order", name) for name in ("place", "random"))
        for column in "pairs", "contacts", "deepest_m", "asleep":
            self.assertEqual(place[0][column], other[0][column])
        self.assertGreater(int(place[0]["contacts"]), 30)
        self.assertAlmostEqual(float(place[0]["energy"]) / float(other[0]["energy"]), 1, delta=0.001)
        self.assertNotEqual(place[4]["energy"], other[4]["energy"])

    def test_contacts_in_random_order_are_the_same_contacts(self):
        settled = ("--scene", "balls", "--bodies", "60", "--steps", "2", "--settle", "120")
        first, other = self.rows(*settled), self.rows(*settled, "--contact-order", "random")
        self.assertEqual([first[0][name] for name in ("contacts", "deepest_m")], [other[0][name] for name in ("contacts", "deepest_m")])
        self.assertNotEqual(first[1]["energy"], other[1]["energy"])

    def test_each_reducer_keeps_contacts_of_its_own(self):
        tori = ("--scene", "torus", "--bodies", "8", "--steps", "5", "--settle", "150", "--contacts", "3")
        piles = {name: self.rows(*tori, "--reduce", name) for name in ("farthest", "deepest", "spread")}
        self.assertEqual(len({rows[-1]["energy"] for rows in piles.values()}), 3)
        self.assertEqual(len({rows[0]["contacts"] for rows in piles.values()}), 1)
        self.assertGreater(int(piles["deepest"][0]["contacts"]), 10)
        for name in piles:  # in the loop as on threads
            self.assertEqual(piles[name][-1]["energy"], self.rows(*tori, "--reduce", name, "--narrow", "serial")[-1]["energy"])

    def test_nobody_sleeps_who_may_not(self):
        letters = ("--scene", "alphabet", "--bodies", "3", "--steps", "1500")
        self.assertEqual(self.rows(*letters)[-1]["asleep"], "3")
        self.assertEqual({row["asleep"] for row in self.rows(*letters, "--sleep", "off")}, {"0"})


class Output(Folder):
    def part(self, output, name):
        found = re.search(r"^ +%s +([0-9.]+) +([0-9.]+) %%(?: +\d+)?$" % name, output, re.M)
        self.assertIsNotNone(found, name + " is not in the table:\n" + output)
        return float(found.group(1)), float(found.group(2))

    def threads(self, output):
        return [int(number) for number in re.findall(r"^  \w.* %% +(\d+)$".replace("%%", "%"), output, re.M)]

    def test_the_table_has_the_parts_of_a_step(self):
        output = self.run_pile(*SMALL, "--threads", "1")
        parts = [self.part(output, name) for name in ("broad phase", "narrow phase", "contact joints", "solver")]
        step, whole = self.part(output, "step")
        self.assertEqual(whole, 100)
        self.assertAlmostEqual(sum(ms for ms, _ in parts), step, delta=0.003)
        self.assertAlmostEqual(sum(share for _, share in parts), 100, delta=0.3)
        stages = [self.part(output, name)[0] for name in ("update AABBs", "synchronise", "extract pairs", "filter", "report")]
        self.assertLessEqual(sum(stages), parts[0][0] + 0.003)
        self.assertRegex(output, r"A mean step: 61 geoms, \d+ pairs, \d+ contacts\. 1\.20 s simulated in [0-9.]+ s\.")
        self.assertNotRegex(self.run_pile(*SMALL, "--space", "hash"), "update|extract")

    def test_the_table_has_the_threads_of_each_part(self):
        many = ("--scene", "balls", "--bodies", "10000", "--steps", "3", "--settle", "90", "--backend", "cpu", "--method", "sweep")
        self.assertEqual(self.threads(self.run_pile(*many, "--threads", "1")), [1, 1, 1, 1])
        self.assertEqual(self.threads(self.run_pile(*many, "--threads", "3")), [3, 3, 1, 1])
        self.assertEqual(self.threads(self.run_pile(*many, "--threads", "3", "--narrow", "serial")), [3, 1, 1, 1])
        few = (*SMALL, "--threads", "2", "--narrow", "serial", "--stepping", "parallel")
        self.assertEqual(self.threads(self.run_pile(*few)), [1, 1, 1, 2])
        self.assertEqual(self.threads(self.run_pile(*SMALL, "--space", "hash")), [1, 1, 1, 1])

    def test_the_lines_below_are_those_of_the_last_frame(self):
        last = self.rows(*SMALL)[-1]
        output = self.run_pile(*SMALL)
        self.assertIn("At the end: %s of 60 bodies asleep, 0 fell out" % last["asleep"], output)
        self.assertIn("Fastest body %.2f m/s" % float(last["fastest_m_s"]), output)
        self.assertIn("Deepest contact %.1f mm" % (1000 * float(last["deepest_m"])), output)
        self.assertRegex(output, r"energy \d+\.\d % of the start's")
        self.assertRegex(output, r"centres between [0-9.]+ and [0-9.]+ m")

    def test_a_bar_is_drawn_on_a_terminal_only(self):
        self.assertNotIn("\r", self.run_pile(*SMALL))
        ours, theirs = pty.openpty()
        with Running(*SMALL[:-1], "100000", stderr=theirs) as pile:
            os.close(theirs)
            shown = b""
            while b"asleep" not in shown:
                shown += os.read(ours, 1000)
            self.assertRegex(shown, rb"\r\[#*\.*\] step \d+ of 100000, \d+ asleep")
            pile.process.kill()
        os.close(ours)


class Pictures(Folder):
    """The picture of times; what is in that of the pile is tested by view/look.py."""

    def bars(self, file):
        svg = ElementTree.parse(file).getroot()
        space = "{http://www.w3.org/2000/svg}"
        self.assertEqual(svg.tag, space + "svg")
        for element in svg:
            self.assertIn(element.tag, (space + "text", space + "rect", space + "line"))
        bars = {bar.get("id"): (float(bar.get("x")), float(bar.get("width"))) for bar in svg.iter(space + "rect") if bar.get("id")}
        lines = [float(line.get("x1")) for line in svg.iter(space + "line")]
        return bars, lines, [text.text for text in svg.iter(space + "text")], float(svg.get("width"))

    def shares(self, output):
        return {name.replace(" ", "-"): (float(ms), float(share)) for name, ms, share in
                re.findall(r"^  (\w[\w ]+?) +([0-9.]+) +([0-9.]+) % +\d+$", output, re.M)}

    def test_the_bars_are_as_long_as_the_shares(self):
        output = self.run_pile(*SMALL, "--picture-of-times", self.file)
        self.assertIn("Picture " + self.file + ": where the time of a step went", output)
        bars, lines, _, width = self.bars(self.file)
        shares = self.shares(output)
        self.assertEqual(list(bars), ["broad-phase", "narrow-phase", "contact-joints", "solver"])
        self.assertEqual(list(bars), list(shares))
        self.assertAlmostEqual(sum(length for _, length in bars.values()), 600, delta=0.01)
        for name, (start, length) in bars.items():
            self.assertAlmostEqual(length / 6, shares[name][1], delta=0.051)
            self.assertLess(start + length, width)
        self.assertEqual(lines, [])  # such a step is over long before a display's next frame

    def test_ways_to_step_the_same_pile_are_compared_in_words_and_in_the_picture(self):
        output = self.run_pile(*SMALL, "--compare", "3", "--picture-of-times", self.file)
        rows = re.findall(r"^  (\w[\w ]+?) +([0-9.]+) +([0-9.]+)  ([0-9.]+)$", output[output.index("The same pile, 3 steps more"):], re.M)
        self.assertEqual([row[0] for row in rows], ["dHashSpace", "the one line changed", "parallel contacts"])
        bars, _, texts, width = self.bars(self.file)
        slowest, stock = max(float(row[1]) for row in rows), float(rows[0][1])
        for name, step, broad_phase, times in rows:
            self.assertLess(0, float(broad_phase))
            self.assertLess(float(broad_phase), float(step))
            self.assertAlmostEqual(float(times), stock / float(step), delta=0.02 * float(times) + 0.005)
            self.assertAlmostEqual(bars[name.replace(" ", "-")][1] / 600, float(step) / slowest, delta=0.02)
            self.assertTrue(any(times + " times faster" in text for text in texts))

    def test_a_line_is_drawn_where_the_next_frame_is_due(self):
        # Such a step takes several frames of a display on any machine.
        output = self.run_pile("--scene", "balls", "--bodies", "10000", "--steps", "2", "--space", "simple", "--picture-of-times", self.file)
        bars, lines, texts, _ = self.bars(self.file)
        step = sum(ms for ms, _ in self.shares(output).values())
        start = bars["solver"][0]
        self.assertEqual(len(lines), 1)
        self.assertAlmostEqual((lines[0] - start) / 600, 1000 / 60 / step, delta=0.001)
        self.assertTrue(any("16.7 ms" in text for text in texts))

    def test_pictures_has_both_or_says_why_not(self):
        folder = os.path.join(os.path.dirname(self.file), "some", "where")
        output = self.run_pile(*SMALL, "--pictures", folder)
        self.bars(os.path.join(folder, "times.svg"))
        if "No picture of the pile: " in output:
            self.assertRegex(output, r"No picture of the pile: --(view|snapshot) .*(not in this build|no OpenGL)")
            self.assertEqual(os.listdir(folder), ["times.svg"])
        else:
            with open(os.path.join(folder, "pile.png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")

    def test_a_machine_without_opengl_has_the_other_one(self):
        # EGL finds no driver where its list of vendors is empty.
        folder = os.path.dirname(self.file)
        blind = dict(os.environ, __EGL_VENDOR_LIBRARY_FILENAMES=os.devnull)
        output = self.run_pile(*SMALL, "--pictures", folder, env=blind)
        self.assertRegex(output, r"No picture of the pile: .*(not in this build|no OpenGL)")
        self.assertEqual(os.listdir(folder), ["times.svg"])

    def test_a_picture_that_cannot_be_written_is_an_error(self):
        output = self.run_pile(*SMALL, "--picture-of-times", "/dev/full", code=1)
        self.assertIn("pile: cannot write all of the file /dev/full", output)


class Running:
    """A pile at work."""

    def __init__(self, *options, **how):
        self.process = subprocess.Popen([program, *options], stdout=subprocess.PIPE, text=True, **how)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def wait_until(self, condition):
        while not condition():
            if self.process.poll() is not None:
                raise AssertionError("it ended with %d" % self.process.returncode)
            time.sleep(0.01)

    def work(self):
        """Seconds of processor time so far: far more than what comes before the first step."""
        with open("/proc/%d/stat" % self.process.pid) as file:
            return int(file.read().rsplit(")", 1)[1].split()[11]) / os.sysconf("SC_CLK_TCK")

    def end(self, number):
        """Sends the signal; returns the exit code and what was printed since."""
        self.process.send_signal(number)
        output, _ = self.process.communicate(timeout=60)
        return self.process.returncode, output


class Interrupts(Folder):
    def interrupt(self, number):
        """Once the file has begun to grow, which it does by whole blocks."""
        with Running("--scene", "balls", "--bodies", "60", "--steps", "1000000", "--csv", self.file) as pile:
            pile.wait_until(lambda: os.path.exists(self.file) and os.path.getsize(self.file) > 5000)
            code, output = pile.end(number)
        with open(self.file) as file:
            return code, output, file.read()

    def test_the_table_is_printed_and_the_file_ends_with_a_whole_row(self):
        for number, code in (signal.SIGINT, 130), (signal.SIGTERM, 143):
            exit_code, output, text = self.interrupt(number)
            os.remove(self.file)
            self.assertRegex(output, r"\n +solver +[0-9.]+ +[0-9.]+ % +1\n")
            self.assertEqual(exit_code, code)
            rows = text.splitlines()
            steps = int(re.search(r"Interrupted after (\d+) steps?", output).group(1))
            self.assertEqual(rows[-1].split(",")[0], str(steps))
            self.assertEqual({row.count(",") for row in rows}, {18})
            self.assertEqual(len(rows), steps + 1)
            self.assertEqual(text[-1], "\n")

    def test_a_second_one_ends_the_program_at_once(self):
        # A step of dSimpleSpace with so many takes far longer than this test.
        with Running("--scene", "balls", "--bodies", "60000", "--space", "simple") as pile:
            pile.wait_until(lambda: pile.work() > 1)
            pile.process.send_signal(signal.SIGINT)
            time.sleep(0.2)
            self.assertIsNone(pile.process.poll())
            self.assertEqual(pile.end(signal.SIGINT)[0], -signal.SIGINT)

    def test_one_that_was_ignored_stays_so(self):
        with Running(*SMALL, "--csv", self.file, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
                     restore_signals=False) as pile:
            pile.process.stdout.readline()
            code, output = pile.end(signal.SIGINT)
        self.assertEqual((code, output.count("Interrupted")), (0, 0))


unittest.main(verbosity=2)
