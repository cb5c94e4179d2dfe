"""Tests which results stale.py finds to be old, on a repository made up for that."""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))


class Stale(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name
        self.git("init", "--quiet")
        self.first = self.change("space/sort/radix.cpp")

    def git(self, *arguments):
        person = ["-c", "user.name=nobody", "-c", "user.email=nobody@localhost"]
        return subprocess.run(["git", "-C", self.root, *person, *arguments], check=True, stdout=subprocess.PIPE,
                              universal_newlines=True).stdout.strip()

    def write(self, path, text):
        path = os.path.join(self.root, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "a") as file:
            file.write(text)
        return path

    def change(self, path, text="more\n"):
        """Commits it and returns the commit, as benchmarks write it."""
        self.write(path, text)
        self.git("add", "--all")
        self.git("commit", "--quiet", "-m", "Change " + path)
        return self.git("describe", "--always", "--abbrev=10")

    def recorded(self, study, *commits):
        return self.write("results/%s.csv" % study, "ms,commit\n" + "".join("1,%s\n" % name for name in commits))

    def run_on(self, *paths):
        result = subprocess.run([sys.executable, os.path.join(HERE, "stale.py"), *paths], stdout=subprocess.PIPE,
                                universal_newlines=True)
        return result.returncode, result.stdout

    def test_results_of_the_last_commit_are_up_to_date(self):
        self.assertEqual(self.run_on(self.recorded("peers", self.first)), (0, "0 older than what they time\n"))

    def test_a_change_of_the_library_makes_older_results_old(self):
        path = self.recorded("peers", self.first)
        self.change("space/update/boxes.cpp")
        status, text = self.run_on(path)
        self.assertEqual(status, 1)
        self.assertIn("results/peers.csv: of %s, 1 changes of space since" % self.first, text)
        self.assertIn("Change space/update/boxes.cpp", text)

    def test_a_change_of_documents_or_of_something_else_does_not(self):
        path = self.recorded("peers", self.first)
        for other in ("space/README.md", "tests/some_test.cpp", "cuda/kernel.cu"):
            self.change(other)
        self.assertEqual(self.run_on(path)[0], 0)

    def test_nor_does_a_change_of_comments(self):
        path = self.recorded("peers", self.first)
        self.change("space/sort/radix.cpp", "  // Says why.\n\n")
        self.assertEqual(self.run_on(path)[0], 0)
        self.change("space/sort/radix.cpp", "/* Says more.\n * And still more. */\n")
        self.assertEqual(self.run_on(path)[0], 0)
        self.change("space/sort/radix.cpp", "int bits = 8;  // and code\n")
        status, text = self.run_on(path)
        self.assertEqual(status, 1)
        self.assertIn("1 changes of space", text)
        with open(os.path.join(self.root, "space/sort/radix.cpp")) as file:
            text = file.read()
        os.remove(os.path.join(self.root, "space/sort/radix.cpp"))
        self.change("space/sort/radix.cpp", text.replace("// and code", "/* other words */"))
        self.assertIn("1 changes of space", self.run_on(path)[1])
        self.git("mv", "space/sort/radix.cpp", "space/sort/digits.cpp")
        self.git("commit", "--quiet", "-m", "Another name")
        self.assertIn("2 changes of space", self.run_on(path)[1])

    def test_a_study_is_as_old_as_what_it_times(self):
        paths = [self.recorded(study, self.first) for study in ("sort", "devices")]
        self.change("cuda/kernel.cu")
        status, text = self.run_on(*paths)
        self.assertEqual(status, 1)
        self.assertIn("results/devices.csv", text)
        self.assertNotIn("results/sort.csv", text)

    def test_the_oldest_row_counts_and_files_changed_beside_do_not(self):
        second = self.change("space/update/boxes.cpp")
        self.assertEqual(self.run_on(self.recorded("peers", second + "-dirty"))[0], 0)
        status, text = self.run_on(self.recorded("small", second, self.first))
        self.assertEqual(status, 1)
        self.assertIn("of " + self.first, text)

    def test_rows_of_other_libraries_do_not_age(self):
        second = self.change("space/update/boxes.cpp")
        rows = "library,ms,commit\node-parallel-sap 1.0,1,%s\n%s,1,%s\n"
        self.assertEqual(self.run_on(self.write("results/peers.csv", rows % (second, "Embree 3", self.first)))[0], 0)
        ours = self.write("results/rest.csv", rows % (second, "ode-parallel-sap 0.9", self.first))
        self.assertEqual(self.run_on(ours)[0], 1)

    def test_where_no_row_names_a_commit_the_file_is_as_old_as_its_own(self):
        path = self.write("results/tuning.csv", "constant,times\na,1\n")
        self.change("results/other.txt")
        self.assertEqual(self.run_on(path)[0], 0)
        self.change("space/update/boxes.cpp")
        self.assertEqual(self.run_on(path)[0], 1)

    def test_a_commit_that_is_not_there_is_said_to_be_unknown(self):
        status, text = self.run_on(self.recorded("peers", "0123456789"))
        self.assertEqual(status, 1)
        self.assertIn("results/peers.csv: unknown commit 0123456789", text)

    def test_a_directory_stands_for_all_its_results(self):
        self.recorded("peers", self.first)
        self.recorded("small", self.first)
        self.change("space/update/boxes.cpp")
        self.assertIn("2 older", self.run_on(os.path.join(self.root, "results"))[1])


if __name__ == "__main__":
    if not shutil.which("git"):
        print("Skipped: needs git")
        sys.exit(77)
    unittest.main()
