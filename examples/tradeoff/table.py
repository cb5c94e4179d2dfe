"""A CSV file that grows by a row at a time. Each row says on what machine and from what sources it is."""

import csv
import datetime
import os
import subprocess

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TEXTS = ("commit", "scene", "cores", "digest", "ignores")  # though they may look like numbers


def cpu():
    with open("/proc/cpuinfo") as lines:
        names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown CPU"


def commit():
    """Of the sources; unknown without git. Where programs were brought from elsewhere, TRADEOFF_COMMIT says it."""
    if os.environ.get("TRADEOFF_COMMIT"):
        return os.environ["TRADEOFF_COMMIT"]
    try:
        described = subprocess.run(["git", "-C", TOP, "describe", "--always", "--exclude=*", "--abbrev=10", "--dirty=-changed"],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    except FileNotFoundError:
        return "unknown"
    return described.stdout.strip() or "unknown"


def parsed(row):
    def value(name, text):
        try:
            return text if name in TEXTS else float(text)
        except ValueError:
            return text
    return {name: value(name, text) for name, text in row.items()}


def written(row):
    return {name: "%.9g" % value if isinstance(value, float) else value for name, value in row.items()}


class Table:
    """`key_columns` name a row; what else it has, the first row decides, and later ones may add."""

    def __init__(self, path, key_columns):
        self.path, self.key_columns, self.rows, self.columns = path, key_columns, [], []
        self.machine = dict(cpu=cpu(), cores=str(len(os.sched_getaffinity(0))), commit=commit(),
                            date=datetime.date.today().isoformat())
        if os.path.exists(path):
            with open(path, newline="") as file:
                reader = csv.DictReader(file)
                # A row that was cut short is measured again.
                self.rows = [parsed(row) for row in reader if None not in row.values() and None not in row]
                self.columns = list(reader.fieldnames or ())

    def key(self, row):
        return tuple("%.9g" % row[c] if isinstance(row[c], (int, float)) else row[c] for c in self.key_columns)

    def add(self, row):
        row = dict(row, **self.machine)
        new = [name for name in row if name not in self.columns]
        self.columns += new
        self.rows.append(parsed({name: str(written(row).get(name, "")) for name in self.columns}))
        if new:
            return self.write()
        with open(self.path, "a", newline="") as file:
            csv.DictWriter(file, self.columns, restval="", lineterminator="\n").writerow(written(row))

    def write(self):
        with open(self.path + ".new", "w", newline="") as file:
            writer = csv.DictWriter(file, self.columns, restval="", lineterminator="\n")
            writer.writeheader()
            writer.writerows(written(row) for row in self.rows)
        os.replace(self.path + ".new", self.path)
