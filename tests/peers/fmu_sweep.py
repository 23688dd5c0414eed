"""Every scene of a folder that can be exported, as FMUs of all kinds and as C, against `odyn run` (pip install fmpy numpy).

    python tests/peers/fmu_sweep.py ODYN FOLDER [NAME ...]

FMPy must have no finding; co-simulation must give the table of the C program; all must give the results of the run, to the errors of the methods.
"""

import csv
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

odyn, folder, names = sys.argv[1], Path(sys.argv[2]), sys.argv[3:]
# Steps of a fixed size, steps whose sizes follow from a tolerance, somebody else's method: shares of the largest value of a column.
CLOSE = {"C": 2e-4, "variable": 2e-4, "ME": 2e-4}


def table(lines):
    rows = list(csv.reader(lines))
    return [name.split(" [")[0] for name in rows[0]], np.array(rows[1:], dtype=float)


def off(found, expected):
    size = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    return float((np.abs(found - expected) / size).max(initial=0.0))


def call(*words, **more):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)


def judge(scene, work):
    export = ("export", "c", scene, "-o", work / "c", "--method", "dopri5")
    done = call(odyn, *export)
    if done.returncode:
        text = done.stderr or done.stdout
        return "refused: " + text.strip().splitlines()[0][:130]
    # The export itself says where steps of its size are too long.
    is_stiff = "ODY0842" in done.stderr
    run = call(odyn, "run", scene, "-o", work / "run")
    if run.returncode:
        return f"the run ends with {run.returncode}"
    heads, expected = table((work / "run" / "results.csv").read_text().splitlines())
    times = expected[:, 0]
    if len(heads) == 1:
        return "it has no outputs"
    steps = np.diff(times)
    if len(steps) == 0 or not np.allclose(steps, steps[0], rtol=1e-9):
        return "its samples are not equally spaced"
    samples, each = len(steps), max(1, round(2000 / len(steps)))
    assert call("make", "-C", work / "c").returncode == 0
    program = work / "c" / next(path.stem for path in (work / "c").glob("*.h"))
    text = call(program, samples * each, each)
    if text.returncode:
        return f"C: {text.stderr.strip()}"
    names, in_c = table(text.stdout.splitlines())
    places = [heads.index(name) for name in names[1:]]
    found = {"C": off(in_c[:, 1:], expected[:, places])}
    for version in "23":
        for way, options in (("fixed", ["--method", "dopri5"]), ("variable", ["--tolerance", "1e-9"])):
            fmu = work / f"{way}{version}.fmu"
            done = call(odyn, "export", "fmu", scene, "-o", fmu, "--fmi", version, *options)
            assert done.returncode == 0, done.stderr
            problems = validate_fmu(str(fmu))
            assert not problems, problems
            description = read_model_description(str(fmu))
            outputs = [v.name for v in description.modelVariables if v.causality == "output"]
            start, stop = map(float, (description.defaultExperiment.startTime, description.defaultExperiment.stopTime))
            kinds = ("CoSimulation", "ModelExchange") if way == "fixed" else ("CoSimulation",)
            for kind in kinds:
                # The C program's steps are those of co-simulation where they are as long.
                interval = (stop - start) / samples / (each if kind == "CoSimulation" and way == "fixed" else 1)
                result = simulate_fmu(
                    str(fmu), fmi_type=kind, start_time=start, stop_time=stop, output_interval=interval, output=outputs,
                    relative_tolerance=1e-9 if kind == "ModelExchange" else None, record_events=False,
                )
                columns = np.column_stack([result[name] for name in outputs])
                if kind == "CoSimulation" and way == "fixed":
                    columns = columns[::each]
                columns = columns[: samples + 1]
                rows = expected[: len(columns), [heads.index(name) for name in outputs]]
                key = {"fixed": "C", "variable": "variable"}[way] if kind == "CoSimulation" else "ME"
                if key == "ME":
                    # A row at an event is the one behind it: what is held jumps to what the next row of the run has.
                    later = expected[1 : len(columns) + 1, [heads.index(name) for name in outputs]]
                    later = np.vstack([later, rows[len(later) :]])
                    rows = np.where(np.abs(columns - later) < np.abs(columns - rows), later, rows) if "digital" in scene.stem else rows
                    columns, rows = columns[:-1], rows[:-1]
                found[f"{key}{version}"] = off(columns, rows)
    if is_stiff:
        found = {name: value for name, value in found.items() if not name.startswith("C")}
    wrong = [name for name, value in found.items() if not value <= CLOSE[name.rstrip("23")]]
    text = ", ".join(f"{name} {value:.1e}" for name, value in found.items())
    return text + (f"  WRONG: {', '.join(wrong)}" if wrong else "")


wrong = exported = 0
for scene in sorted(folder.glob("*.toml")):
    if names and scene.stem not in names:
        continue
    work = Path(tempfile.mkdtemp())
    try:
        text = judge(scene.resolve(), work)
    except Exception as error:
        text = f"WRONG: {type(error).__name__} {str(error)[:300]}"
    shutil.rmtree(work, ignore_errors=True)
    exported += " 3" in text or "C " in text
    wrong += "WRONG" in text
    print(f"{scene.stem}: {text}", flush=True)
print(f"{exported} exported, {wrong} wrong")
sys.exit(wrong > 0)
