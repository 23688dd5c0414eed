"""What the scripts for other programs share: references, the measure of error, the table that `odyn bench --peers` reads."""

import csv
import multiprocessing
import sys
import time
from pathlib import Path

REFERENCES = Path(__file__).resolve().parents[2] / "scenes" / "reference"
# Seconds for all repeats of one setting; a program that does not come back within them is stopped.
LIMIT = 60.0
COLUMNS = ["problem", "solver", "method", "setting", "value", "status", "error", "integrate_s", "steps", "repeats"]

# Problem, its reference, measured columns, end (s).
PROBLEMS = {
    "A01": ("A01.csv", ["x", "y"], 10.0),
    "A02_N2": ("A02_N2.csv", ["B0x", "B0y"], 10.0),
    "A03": ("A03.csv", ["Fx", "Fy", "Ex", "Ey", "Gx", "Gy", "Hx", "Hy"], 0.05),
    "A04": ("A04.csv", ["P3x", "P3y", "P3z"], 10.0),
    "A05": ("A05.csv", ["s"], 10.0),
    "chain_N10": ("chain_N10.csv", ["tip_x", "tip_y"], 1.0),
}


def reference(problem, step):
    """Times and measured coordinates at each of them; of a step longer than their distance, only those that it meets."""
    name, columns, end = PROBLEMS[problem]
    lines = [line for line in (REFERENCES / name).read_text().splitlines() if not line.startswith("#")]
    rows = [row for row in csv.DictReader(lines) if float(row["t"]) <= end + 1e-9]
    rows = rows[:: max(1, round(step / float(rows[1]["t"])))]
    return [float(row["t"]) for row in rows], [[float(row[c]) for c in columns] for row in rows]


def steps_per_sample(problem, step):
    """Whole steps between samples of the reference."""
    times, _ = reference(problem, step)
    return max(1, round((times[1] - times[0]) / step))


def begin(comment):
    """The head of the table, on standard output."""
    print(f"# {comment}")
    csv.DictWriter(sys.stdout, COLUMNS, lineterminator="\n").writeheader()
    sys.stdout.flush()


def measure(problem, solver, method, step, run, repeats=3):
    """Writes a row of the table. `run()` gives the measured coordinates at all times of the reference, the seconds that took,
    and the number of steps. It runs in a process of its own, so that neither a crash nor an endless loop ends the table."""
    row = {"problem": problem, "solver": solver, "method": method, "setting": "step", "value": repr(step)}
    processes = multiprocessing.get_context("fork")
    here, there = processes.Pipe(duplex=False)
    child = processes.Process(target=lambda: there.send(outcome(problem, step, run, repeats)))
    child.start()
    there.close()
    if not here.poll(LIMIT):
        child.kill()
        row["status"] = f"not done after {LIMIT:g} s"
    else:
        try:
            row |= here.recv()
        except EOFError:
            row["status"] = "the process died"
    child.join()
    csv.DictWriter(sys.stdout, COLUMNS, restval="", lineterminator="\n").writerow(row)
    sys.stdout.flush()
    print(row["problem"], row["solver"], row["method"], row["value"], row["status"], row.get("error", ""),
          row.get("integrate_s", ""), file=sys.stderr)


def outcome(problem, step, run, repeats):
    """Status, error and the median of the times."""
    try:
        seconds = []
        for _ in range(repeats):
            samples, spent, steps = run()
            seconds.append(spent)
        _, expected = reference(problem, step)
        assert len(samples) == len(expected), f"{len(samples)} samples instead of {len(expected)}"
        error = max(abs(a - b) for ours, theirs in zip(samples, expected) for a, b in zip(ours, theirs))
        assert error == error, "the motion is not finite"
        time_taken = sorted(seconds)[repeats // 2]
        return {"status": "ok", "error": f"{error:e}", "integrate_s": f"{time_taken:e}", "steps": steps, "repeats": repeats}
    except Exception as reason:  # whatever a program raises is its result
        return {"status": str(reason).splitlines()[0][:200] if str(reason) else type(reason).__name__}


def clock():
    """Seconds."""
    return time.perf_counter()
