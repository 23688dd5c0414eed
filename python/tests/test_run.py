"""Runs: results, units, errors, interruptions."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import numpy
import odyn
import pytest
from conftest import PENDULUM, ROOT


def columns_of(path):
    with path.open() as file:
        names = [name.split("[")[0].strip() for name in file.readline().strip().split(",")]
        return dict(zip(names, numpy.loadtxt(file, delimiter=",", unpack=True), strict=True))


def test_compressor_is_the_reference(compressor):
    run = compressor.run()
    assert run.ok and run.status == "completed"
    with (ROOT / "scenes" / "reference" / "compressor.csv").open() as file:
        lines = [line for line in file if not line.startswith("#")]
    expected = dict(zip(lines[0].strip().split(","), numpy.loadtxt(lines[1:], delimiter=",", unpack=True), strict=True))
    numpy.testing.assert_array_equal(run.t, expected["t"])
    for name in run:
        size = numpy.abs(expected[name]).max()
        assert numpy.abs(run[name] - expected[name]).max() <= 1e-8 * size, name
    assert run.units["x_p"] == "mm" and run.units["t"] == "ms"
    assert run.figures["piston acceleration at 0 deg"] == pytest.approx(1.03, rel=0.02)
    assert run.audit["position_violation"] < 1e-8


def test_arrays_are_the_memory_of_the_solver(compressor):
    run = compressor.run(t_end=10)
    assert run["x_p"].base is not None and not run["x_p"].flags.owndata
    assert run["x_p"].__array_interface__["data"] == (run._inner.columns[3].__array_interface__["data"][0], True)
    with pytest.raises(ValueError, match="read-only"):
        run["x_p"][0] = 1.0
    values = run["x_p"]
    first = float(values[0])
    del run
    assert values[0] == first == 50.5


def test_files_are_those_of_the_program(compressor, program, tmp_path):
    sets = {"rod.length": "50 mm", "simulation.output_step": 1}
    run = compressor.set(sets).run(t_end="40 ms")
    saved = run.save(tmp_path / "saved")
    named = [f"--set={key}={value}" for key, value in sets.items()]
    path = ROOT / "scenes" / "compressor.toml"
    done = program("run", path, *named, "--t-end", "40 ms", "-q", "-o", tmp_path / "program")
    assert done.returncode == 0, done.stderr
    for name in ("results.csv", "channels.json"):
        assert (saved / name).read_bytes() == (tmp_path / "program" / name).read_bytes(), name
    read = columns_of(saved / "results.csv")
    assert all(numpy.array_equal(read[name], run[name]) for name in run)
    compared = program("compare", saved, tmp_path / "program", "--tol", "1e-300")
    assert compared.returncode == 0, compared.stdout + compared.stderr
    written = compressor.set(sets).run(t_end="40 ms", output=tmp_path / "written", motion=True)
    assert (tmp_path / "written" / "results.csv").read_bytes() == (saved / "results.csv").read_bytes()
    assert (written.save(tmp_path / "copied") / "motion.bin").is_file()


def test_values_of_scenes(compressor):
    import fractions

    by_text = compressor.set({"rotor.mass": "50 g"}).run(t_end=5)
    by_number = compressor.set({"rotor.mass": numpy.float64(0.05)}).run(t_end=5)
    by_name = compressor.set(**{"rotor.mass": 0.05}).run(t_end=5)
    assert numpy.array_equal(by_text["x_p"], by_number["x_p"]) and numpy.array_equal(by_text["x_p"], by_name["x_p"])
    moved = compressor.set({"piston.inertia": numpy.array([3.0, 3.5, 4.0])})
    assert moved.overrides == ("piston.inertia=[3.0, 3.5, 4.0]",) and compressor.overrides == ()
    with pytest.raises(ValueError, match="nan is no number"):
        compressor.set({"rod.length": float("nan")})
    with pytest.raises(TypeError, match="no values such as"):
        compressor.set({"rod.length": fractions.Fraction(1, 2)})


def test_errors_say_what_where_and_what_to_do(compressor, tmp_path):
    with pytest.raises(odyn.Error) as caught:
        odyn.load(text=PENDULUM.replace("mass = 2", "masss = 2"))
    error = caught.value
    assert error.code == "ODY0104" and error.place.line == 8 and error.place.column == 1
    missing, unknown = error.diagnostics
    assert missing.message == error.message == "body `rod` has no `mass`"
    assert unknown.code == "ODY0102" and unknown.remedy == "did you mean `mass`?" and unknown.place.line == 10
    assert str(error).startswith("error[ODY0104]") and error.exit_code == 3
    with pytest.raises(odyn.Error) as caught:
        compressor.set({"rotor.mass": "50 mm"})
    assert caught.value.place.file == "command line"
    with pytest.raises(odyn.Error) as caught:
        odyn.load(tmp_path / "nothing.toml")
    assert "nothing.toml" in str(caught.value)
    with pytest.raises(odyn.Error, match="dop853"):
        compressor.run(method="euler")
    with pytest.raises(KeyError, match="known are theta"):
        compressor.run(t_end=1)["x"]


def test_suspect_runs_are_told(compressor):
    with pytest.warns(odyn.RunWarning, match="suspect"):
        run = compressor.run(t_end=20, tolerance=1e-3, audit_tolerance=1e-12)
    assert run.status == "suspect" and not run.ok and run.warnings
    with pytest.raises(odyn.Error, match="suspect"):
        run.raise_if_not_ok()


def test_reports(compressor):
    checked, planned = compressor.check(), compressor.plan()
    assert "mobility" in str(checked) and any("inertia" in one.message for one in checked.warnings)
    assert str(planned) and planned
    run = compressor.run(t_end=20, motion=True)
    page = run._repr_html_()
    assert page.startswith("<iframe srcdoc=") and "Reciprocating compressor" in page
    assert "x_p" in repr(run) and "completed" in str(run)


def test_tables(compressor):
    for name in ("pandas", "pyarrow", "xarray"):
        pytest.importorskip(name)
    run = compressor.run(t_end=10)
    frame = run.to_pandas()
    assert frame.index.name == "t" and frame.attrs["units"]["F_gas"] == "kN"
    assert numpy.array_equal(frame["a_p"], run["a_p"])
    data = run.to_xarray()
    assert data["a_p"].attrs["units"] == "mm/ms^2" and float(data["a_p"].sel(t=5.0)) == run["a_p"][10]
    table = run.arrow()
    assert table.schema.field("a_p").metadata[b"unit"] == b"mm/ms^2"
    assert table.column("a_p").to_numpy().tolist() == run["a_p"].tolist()


def test_progress_is_told_and_its_errors_end_the_run(compressor):
    shares = []
    compressor.run(t_end=200, engine="reference", tolerance=1e-13, progress=shares.append)
    assert shares and shares == sorted(shares) and 0 <= shares[0] and shares[-1] <= 1

    def refuse(_share):
        raise RuntimeError("seen enough")

    with pytest.raises(RuntimeError, match="seen enough"):
        compressor.set({"simulation.t_end": 20000}).run(engine="reference", progress=refuse)


def test_threads_run_side_by_side(compressor):
    expected = compressor.run(t_end=50)
    found = {}

    def work(name):
        found[name] = compressor.run(t_end=50)

    threads = [threading.Thread(target=work, args=(name,)) for name in range(3)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert all(numpy.array_equal(run["a_p"], expected["a_p"]) for run in found.values()) and len(found) == 3


def test_the_lock_is_free_while_a_run_goes_on(compressor):
    long = compressor.set({"simulation.output_step": 10})
    thread = threading.Thread(target=lambda: long.run(t_end=3000, engine="reference"))
    begin = time.perf_counter()
    thread.start()
    ticks = 0
    while thread.is_alive():
        ticks += 1
        time.sleep(0.001)
    elapsed = time.perf_counter() - begin
    assert ticks > 20 and elapsed / ticks < 0.05


INTERRUPTED = """
import os, signal, warnings, odyn, sys
model = odyn.load(sys.argv[1]).set({"simulation.output_step": 10})


class Once:
    \"\"\"Presses Ctrl-C as soon as something is done.\"\"\"

    pressed = False

    def __call__(self, share):
        if share > 0 and not self.pressed:
            self.pressed = True
            os.kill(os.getpid(), signal.SIGINT)


with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    run = model.run(t_end=9e5, engine="reference", progress=Once())
assert run.status == "stopped_early", run.status
assert 0 < len(run.t) < 9e4 and run["x_p"][0] == 50.5 and run.t[-1] < 9e5
assert [one.category for one in caught] == [odyn.RunWarning]
print("ended with", len(run.t))
try:
    model.set({"simulation.t_end": 9e5}).loads("piston", progress=Once())
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_ends_a_run_with_what_is_there():
    path = ROOT / "scenes" / "compressor.toml"
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, path], capture_output=True, text=True, timeout=120, check=False)
    assert "ended with" in done.stdout and "interrupted" in done.stdout, done.stdout + done.stderr


def test_import_is_quick_and_light():
    code = "import sys, odyn; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_texts_and_their_folder(tmp_path):
    (tmp_path / "curve.csv").write_text("t,z\n0,0\n1,1\n2,0\n")
    run = odyn.load(text=PENDULUM).run()
    assert run.ok and run["angle"][0] == 0.0
    placed = odyn.load(text=PENDULUM, folder=tmp_path)
    assert placed.path == tmp_path / "scene.toml"
    assert numpy.array_equal(placed.run()["angle"], run["angle"])
    with pytest.raises(TypeError, match="scene file"):
        odyn.load()


def test_a_run_goes_on_from_another(compressor, tmp_path):
    first = compressor.run(t_end=20, output=tmp_path / "first")
    second = compressor.run(t_end=40, start=first)
    assert second.t[0] >= 20 and second.t[-1] == 40
    whole = compressor.run(t_end=40)
    assert abs(second["x_p"][-1] - whole["x_p"][-1]) < 1e-7


def test_models_and_errors_go_to_other_processes(compressor, tmp_path):
    import pickle

    changed = compressor.set({"rotor.mass": "50 g"})
    there = pickle.loads(pickle.dumps(changed))
    assert there.overrides == changed.overrides and there.path == changed.path
    assert numpy.array_equal(there.run(t_end=5)["a_p"], changed.run(t_end=5)["a_p"])
    by_text = pickle.loads(pickle.dumps(odyn.load(text=PENDULUM)))
    assert by_text.run().ok
    with pytest.raises(odyn.Error) as caught:
        compressor.set({"rotor.mas": 1}).run()
    error = pickle.loads(pickle.dumps(caught.value))
    assert (str(error), error.diagnostics, error.code) == (str(caught.value), caught.value.diagnostics, caught.value.code)


def test_libraries_of_strangers_are_kept_apart_with_the_same_bits(compressor, tmp_path):
    import shutil

    from odyn._program import PROGRAM

    own = next(PROGRAM.parent.glob("*odyn_joints.*"))
    shutil.copy(own, tmp_path)
    strange = odyn.load(ROOT / "scenes" / "compressor.toml", plugins=[tmp_path]).run(t_end=20)
    assert any(one["package"] == "odyn-joints" for one in strange.summary["libraries"])
    assert numpy.array_equal(strange["a_p"], compressor.run(t_end=20)["a_p"])


def test_the_program_comes_along(program):
    done = program("--version")
    assert done.returncode == 0 and odyn.__version__ in done.stdout
    listed = program("elements", "list")
    assert "revolute" in listed.stdout and "motor-torque" in listed.stdout and "pid" in listed.stdout
