"""CSV files that grow by a row at a time, and say on what machine and from what sources each row is."""

import csv
import datetime
import os
import subprocess

import study

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def cpu():
    with open("/proc/cpuinfo") as lines:
        names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown CPU"


def commit():
    """Of the sources, with a word if they were changed since; unknown without git, or outside a repository. Where the
    programs were brought from elsewhere, TRADEOFF_COMMIT says it."""
    if os.environ.get("TRADEOFF_COMMIT"):
        return os.environ["TRADEOFF_COMMIT"]
    try:
        described = subprocess.run(["git", "-C", TOP, "describe", "--always", "--exclude=*", "--abbrev=10",
                                    "--dirty=-changed"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    except FileNotFoundError:
        return "unknown"
    return described.stdout.strip() or "unknown"


def all_cores():
    return os.sched_getaffinity(0)


def shares(count):
    """The cores dealt into equal parts; what is left over idles."""
    cores, size = sorted(all_cores()), len(all_cores()) // count
    return [set(cores[i * size:(i + 1) * size]) for i in range(count)]


def machine(cores):
    return dict(cpu=cpu(), cores=str(cores), commit=commit(), date=datetime.date.today().isoformat())


def parsed(row):
    return {name: float(value) if study.is_number(value) and name not in TEXTS else value
            for name, value in row.items()}


def written(row):
    return {name: "%.9g" % value if isinstance(value, float) else value for name, value in row.items()}


TEXTS = ("cores", "commit", "scene")  # though they may look like numbers


class Table:
    """A CSV file that grows by a row at a time. Its points have so many cores each."""

    def __init__(self, path, key_columns, cores):
        self.path, self.key_columns, self.rows, self.columns = path, key_columns, [], None
        self.machine = machine(cores)
        if os.path.exists(path):
            with open(path, newline="") as file:
                reader = csv.DictReader(file)
                # A row that was cut short when the run was interrupted is measured again.
                self.rows = [parsed(row) for row in reader if None not in row.values() and None not in row]
                self.columns = reader.fieldnames
            self.write_all()
        self.known = {study.key(row, key_columns): row for row in self.rows}

    def write_all(self):
        with open(self.path, "w", newline="") as file:
            writer = csv.DictWriter(file, self.columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(written(row) for row in self.rows)

    def missing(self, points):
        return [p for p in points if study.key(p, self.key_columns) not in self.known]

    def of(self, points):
        """The rows of those of these points that were measured, in the order of the points."""
        keys = [study.key(point, self.key_columns) for point in points]
        return [self.known[key] for key in keys if key in self.known]

    def values(self, column):
        return sorted({row[column] for row in self.rows})

    def add(self, row, measured_columns):
        if not self.columns:
            self.columns = [*self.key_columns, "status", *measured_columns, *self.machine]
            self.write_all()
        self.add_observed([name for name in row if name not in self.columns and name.startswith("observed_")])
        unknown = set(row) - set(self.columns)
        if unknown:
            raise SystemExit("tradeoff.py: %s has no column %s: it is of another version" % (self.path, ", ".join(unknown)))
        row = dict({name: "" for name in self.columns}, **row, **self.machine)
        with open(self.path, "a", newline="") as file:
            csv.DictWriter(file, self.columns, lineterminator="\n").writerow(written(row))
        self.rows.append(parsed({name: str(value) for name, value in row.items()}))
        self.known[study.key(row, self.key_columns)] = self.rows[-1]

    def add_observed(self, names):
        """Scenes observe different things: a column that other scenes lack is empty in their rows."""
        if not names:
            return
        end = self.columns.index(next(iter(self.machine)))
        self.columns = [*self.columns[:end], *names, *self.columns[end:]]
        self.write_all()

    def check_machine(self):
        others = {(row["cpu"], row["cores"]) for row in self.rows} - {(self.machine["cpu"], self.machine["cores"])}
        if others:
            raise SystemExit("tradeoff.py: %s has rows of another machine (%s, %s cores). Name another folder by --out." %
                             (self.path, *others.pop()))
