"""Reads the CSV files of a run; shared by plot.py and table.py."""
import csv
import os


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return None


def cell(column, text):
    # A commit may look like a number: 3e04000.
    value = None if column == "commit" else number(text)
    return value if value is not None else text or None


def read(directory, study):
    """The rows of a study, numbers as floats, empty cells as None; [] if it was not run."""
    path = os.path.join(directory, study + ".csv")
    if not os.path.exists(path):
        return []
    rows = []
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            # Columns added to a file by a later version would shift silently.
            if None in row or None in row.values():
                raise SystemExit("%s: a row with another number of columns" % path)
            rows.append({key: cell(key, value) for key, value in row.items()})
    return rows


def timed(rows, **wanted):
    """Rows that were timed and have these values."""
    return [row for row in rows if row.get("status", "ok") == "ok" and
            any(row.get(name) is not None for name in ("median_ms", "step_ms")) and
            all(row[key] == value for key, value in wanted.items())]


def values(rows, column):
    """The distinct values of a column, in the order in which they come."""
    return list(dict.fromkeys(row[column] for row in rows))


def one(rows, **wanted):
    found = timed(rows, **wanted)
    return found[0] if found else None


# Peers that are other libraries, not ODE's.
LIBRARIES = ("embree", "embree-default", "bullet-dbvt", "fcl-tree")
OURS = "parallel-sap"


def best(rows, peers, **wanted):
    """The quickest of the peers."""
    found = [row for row in timed(rows, **wanted) if row["peer"] in peers]
    return min(found, key=lambda row: row["median_ms"], default=None)


def machine(rows):
    row = rows[0]
    gpu = ", %s (driver %s)" % (row["gpu"], row["driver"]) if row.get("gpu") else ""
    compiler = "; %s %s" % (row["compiler"], row["flags"]) if "compiler" in row else ""
    commits = ", ".join(sorted({row["commit"] or "unknown" for row in rows}))
    return "%s, %d cores%s%s; commit %s, %s" % (row["cpu"], row["cores"], gpu, compiler, commits, max(row["date"] for row in rows))
