"""Analyses: what the program writes, as dictionaries and arrays."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy
import odyn
import pytest
from conftest import PENDULUM, ROOT

HANGING = PENDULUM.replace("[simulation]\n", "[simulation]\ngravity = [0, -9.81, 0]\n").replace("value = 0.5", "value = 0")
OMEGA2 = 2 * 9.81 * 0.5 / (0.1 + 2 * 0.25)


def test_rest_and_small_motions():
    model = odyn.load(text=HANGING)
    found = model.statics()
    assert found["stability"] in ("undamped", "stable")
    values = {one["name"]: one["value"] for one in found["outputs"]}
    assert abs(abs(values["angle"]) - numpy.pi / 2) < 1e-9
    modes = model.modes(at="equilibrium")
    assert modes["modes"][0]["frequency"] == pytest.approx(numpy.sqrt(OMEGA2) / (2 * numpy.pi), rel=1e-9)
    linear = model.linearise("motor", ["angle"], at="equilibrium")
    assert linear.A.shape == (2, 2) and linear.B.shape == (2, 1) and linear.C.shape == (1, 2) and linear.D.shape == (1, 1)
    gain = (linear.C @ numpy.linalg.solve(-linear.A, linear.B))[0, 0]
    assert abs(gain) == pytest.approx(1 / (OMEGA2 * 0.6), rel=1e-9)
    assert linear.about["at_rest"] and linear.about["inputs"][0]["unit"] == "N m"
    none = model.linearise([], [], at=0.1)
    assert none.B.shape == (2, 0) and none.D.shape == (0, 0)
    with pytest.raises(odyn.Error, match="no state of a scene"):
        model.modes(at="somewhere")
    with pytest.raises(odyn.Error, match="did you mean `angle`"):
        model.linearise(outputs="angel")
    several = model.statics(starts=4)
    assert len(several["found"]) >= 1 and several["starts"] == 4


def test_they_are_those_of_the_program(program, tmp_path):
    path = ROOT / "scenes" / "compressor.toml"
    model = odyn.load(path)
    done = program("linearise", path, "--json", "-q", "-o", tmp_path / "linear")
    expected = json.loads(done.stdout)
    linear = model.linearise()
    assert numpy.array_equal(linear.A, expected["a"]) and numpy.array_equal(linear.C, expected["c"])
    done = program("loads", path, "--body", "conrod", "--json", "-q", "-o", tmp_path / "loads", "--t-end", "20")
    expected = json.loads(done.stdout)
    loads = model.set({"simulation.t_end": 20}).loads("conrod")
    assert [case["time"] for case in loads["cases"]] == [case["time"] for case in expected["cases"]]
    force = expected["cases"][0]["wrenches"][0]["force"]
    assert numpy.array_equal(loads["cases"][0]["wrenches"][0]["force"], force)


def test_efforts_cause_their_motion(tmp_path):
    model = odyn.load(text=HANGING).set({"simulation.t_end": 1})
    times = numpy.linspace(0, 1, 201)
    angle = 0.3 * (1 - numpy.cos(3 * times))
    found = model.inverse({"t [s]": times, "pin.angle [rad]": angle}, by="motor")
    torque = 0.6 * 0.3 * 9 * numpy.cos(3 * times) + 2 * 9.81 * 0.5 * numpy.cos(angle)
    assert numpy.abs(found["efforts"][0] - torque)[2:-2].max() < 2e-3
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"pin.angle [rad]": angle}, index=times)
    assert numpy.array_equal(model.inverse(frame, by="motor")["efforts"], found["efforts"])
    with pytest.raises(ValueError, match="one length"):
        model.inverse({"t": times, "pin.angle": angle[1:]})


def test_places_of_the_compressor(compressor):
    found = compressor.kinematics(("main_bearing.angle", "0 deg", "360 deg", 37))
    assert len(found["places"]) == 37
    place = next(k for k, one in enumerate(found["columns"]) if one["name"] == "x_p")
    assert found["values"][place].max() == pytest.approx(50.5, abs=1e-9)
    assert found["values"][place].min() == pytest.approx(33.5, abs=1e-6)
    with pytest.raises(odyn.Error, match="no value of"):
        compressor.kinematics(("main_bearing.angle", "0 kg", "1 deg", 3))


def test_a_counterweight(compressor):
    found = compressor.balance("main_bearing.angle", radius="15 mm")
    assert found["after"]["force_rms"] < 0.6 * found["before"]["force_rms"]
    assert found["after"]["force_rms"] == pytest.approx(found["predicted"]["force_rms"], rel=0.02)
    key, value = found["counterweight"]["set"].split("=", 1)
    assert compressor.set({key: value}).run(t_end=5).ok


def test_sensitivities_and_fits():
    model = odyn.load(text=PENDULUM).set({"simulation.gravity": [0, 0, 0], "simulation.output_step": 0.1})
    found = model.sensitivity("omega", ["rod.mass"])
    (one,) = found["outputs"]
    # omega = 0.5 t / (0.1 + m / 4)
    expected = -0.5 * found["times"] * 0.25 / 0.6**2
    assert numpy.abs(one["derivative"] - expected).max() < 1e-8 and found["status"] == "certain"
    run = model.set({"rod.mass": 2.5}).run()
    fit = model.fit({"t": run.t, "omega": run["omega"]}, {"rod.mass": (1, 4)}, noise={"omega": 1e-6})
    assert fit.values["rod.mass"] == pytest.approx(2.5, rel=1e-8) and fit.about["status"] == "converged"
    assert numpy.allclose(fit.model.run()["omega"], run["omega"], rtol=1e-9)
    # Runs and their frames have units, which count.
    frame = run.to_pandas()
    frame["omega"] *= 30 / numpy.pi
    frame.index *= 1000
    frame.attrs["units"] = {"t": "ms", "omega": "rpm"}
    for measured in (run, frame):
        again = model.fit(measured, {"rod.mass": (1, 4)}, columns={"omega": "omega"})
        assert again.values["rod.mass"] == pytest.approx(2.5, rel=1e-8)
    # The text has what was fitted, and nothing else that was set.
    assert odyn.load(text=fit.text).run()["omega"][-1] == pytest.approx(run["omega"][-1], rel=1e-8)
    with pytest.raises(odyn.Error, match="nothing"):
        model.fit({"t": run.t, "nothing": run["omega"]}, "rod.mass")
    # A side that is infinite is no bound.
    for bounds in ((1, math.inf), (-math.inf, 4), (-math.inf, math.inf)):
        again = model.fit({"t": run.t, "omega": run["omega"]}, {"rod.mass": bounds}, noise={"omega": 1e-6})
        assert again.values["rod.mass"] == pytest.approx(2.5, rel=1e-8)


def test_files_that_changed_are_refused(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(PENDULUM)
    model = odyn.load(path)
    path.write_text(PENDULUM.replace("mass = 2", "mass = 3"))
    with pytest.raises(odyn.Error, match="has changed since it was loaded"):
        model.sensitivity("omega", "rod.mass")
    assert model.run()["omega"][-1] == odyn.load(text=PENDULUM).run()["omega"][-1]
    with pytest.raises(odyn.Error, match="reads scene files"):
        odyn.load(text=PENDULUM, folder=tmp_path).sensitivity("omega", "rod.mass")


INTERRUPTED = """
import signal
import sys

import odyn

model = odyn.load(sys.argv[1]).set({"simulation.t_end": 9e5, "simulation.output_step": 100})
calls = {
    "statics": lambda told: model.statics(starts=1_000_000, progress=told),
    "kinematics": lambda told: model.kinematics(("main_bearing.angle", "0 deg", "360 deg", 1_000_000), progress=told),
    "linearise": lambda told: model.linearise(at=8e5, progress=told),
    "modes": lambda told: model.modes(at=8e5, progress=told),
    "balance": lambda told: model.balance("main_bearing.angle", turns=100_000, progress=told),
}
for name, call in calls.items():
    shares = []

    def told(share):
        shares.append(share)
        if len(shares) == 2:
            signal.raise_signal(signal.SIGINT)

    try:
        call(told)
    except KeyboardInterrupt:
        print(name, "interrupted", 0 <= shares[-1] < 1)

    def broken(share):
        raise OSError("no terminal")

    try:
        call(broken)
    except OSError as error:
        print(name, error)
print(len(model.set({"simulation.t_end": 1, "simulation.output_step": 0.5}).run().t))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_ends_an_analysis_on_its_way():
    """Each of these takes hours to its end. What a listener raises ends it, too; afterwards everything still works."""
    path = ROOT / "scenes" / "compressor.toml"
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, path], capture_output=True, text=True, timeout=300, check=False)
    for name in ["statics", "kinematics", "linearise", "modes", "balance"]:
        assert f"{name} interrupted True" in done.stdout, done.stdout + done.stderr
        assert f"{name} no terminal" in done.stdout
    assert done.stdout.splitlines()[-1] == "3" and "panicked" not in done.stderr
