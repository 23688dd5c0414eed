"""Stepping from outside."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy
import odyn
import pytest
from conftest import PENDULUM, ROOT


def test_stepping_with_inputs_and_back():
    simulation = odyn.load(text=PENDULUM).simulation()
    assert list(simulation.inputs) == ["motor"] and simulation.units == {"angle": "rad", "omega": "rad/s"}
    simulation.advance(0.5)
    saved = simulation.save()
    simulation.inputs["motor"] = 7.0
    simulation.advance(1.0)
    driven = simulation.outputs["omega"]
    simulation.restore(saved)
    assert simulation.t == 0.5 and simulation.inputs["motor"] == 0.5
    simulation.advance(1.0)
    free = simulation.outputs["omega"]
    assert driven > free + 1
    # In another simulation, by way of bytes: the same digits.
    other = odyn.load(text=PENDULUM).simulation().restore(pickle.loads(pickle.dumps(saved)))
    other.inputs["motor"] = 7.0
    assert other.advance(1.0).outputs["omega"] == driven
    samples = other.samples()
    assert samples["t"][-1] == 1.0 and samples["omega"][-1] == driven


def test_free_of_constraints_the_motion_is_known():
    # One joint, no gravity: inertia about the pin is 0.1 + 2 * 0.25.
    simulation = odyn.load(text=PENDULUM).set({"simulation.gravity": [0, 0, 0]}).simulation()
    simulation.advance(1.0)
    assert simulation.outputs["omega"] == pytest.approx(0.5 / 0.6, rel=1e-9)
    simulation.inputs["motor"] = 0
    simulation.advance(2.0)
    assert simulation.outputs["omega"] == pytest.approx(0.5 / 0.6, rel=1e-9)


def test_errors_of_simulations():
    simulation = odyn.load(text=PENDULUM).simulation()
    with pytest.raises(odyn.Error, match="did you mean `motor`"):
        simulation.inputs["motr"] = 1.0
    for names in (simulation.inputs, simulation.outputs):
        assert "motr" not in names and names.get("motr", 7.0) == 7.0
        with pytest.raises(KeyError, match="motr"):
            names["motr"]
    assert "motor" in simulation.inputs and "omega" in simulation.outputs
    with pytest.raises(odyn.Error, match="cannot advance"):
        simulation.advance(5)
    with pytest.raises(odyn.Error):
        simulation.inputs["motor"] = float("inf")
    with pytest.raises(odyn.Error, match="another scene"):
        simulation.restore(odyn.load(text=PENDULUM).set({"rod.mass": 3}).simulation().save())


def test_the_system_is_what_runs_integrate(compressor):
    scipy_integrate = pytest.importorskip("scipy.integrate")
    for model in (compressor.set({"simulation.t_end": 30}), odyn.load(text=PENDULUM)):
        system = model.system()
        run = model.run()
        start, end = system.t_span
        times = numpy.linspace(start, end, 7)
        found = scipy_integrate.solve_ivp(
            system.f, system.t_span, system.x0, "Radau", jac=system.jac, t_eval=times, rtol=1e-9, atol=1e-11
        )
        assert found.success
        unit = 1e-3 if run.units["t"] == "ms" else 1.0
        for k, t in enumerate(times):
            row = int(numpy.argmin(numpy.abs(run.t * unit - t)))
            if abs(run.t[row] * unit - t) > 1e-9:
                continue
            values = system.outputs(t, found.y[:, k])
            for name in ("x_p", "omega", "angle"):
                if name in run:
                    size = numpy.abs(run[name]).max()
                    assert abs(values[name] - run[name][row]) <= 2e-6 * size, (name, t)


def test_jacobians_are_derivatives(compressor):
    for model in (compressor, compressor.set({"simulation.formulation": "cartesian"}), odyn.load(text=PENDULUM)):
        system = model.system()
        x = system.project(0.0, system.x0)
        exact = system.jac(0.0, x)
        for column in range(len(x)):
            h = 1e-6 * max(abs(x[column]), 1e-2)
            up, down = x.copy(), x.copy()
            up[column] += h
            down[column] -= h
            difference = (system.f(0.0, up) - system.f(0.0, down)) / (2 * h)
            scale = numpy.abs(exact).max(axis=1) + 1e-4 * numpy.abs(exact).max()
            assert (numpy.abs(difference - exact[:, column]) <= 1e-5 * scale).all(), (model, column)


def test_systems_refuse_what_has_a_memory():
    scenes = ROOT / "scenes" / "verification"
    with pytest.raises(odyn.Error, match="the contact `floor: gap` closes and opens"):
        odyn.load(scenes / "plane-contact.toml").system()
    with pytest.raises(odyn.Error, match="change between steps only"):
        odyn.load(scenes / "digital-pid.toml").system()
    system = odyn.load(text=PENDULUM).system()
    with pytest.raises(odyn.Error, match="finite numbers"):
        system.f(0.0, [1.0])


INTERRUPTED = """
import os, signal, sys, threading
import odyn

simulation = odyn.load(sys.argv[1]).set({"simulation.t_end": 9e6, "simulation.output_step": 9e5}).simulation()
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    simulation.advance(9e6)
except KeyboardInterrupt:
    t = simulation.t
    print("interrupted", 0 < t < 9e6, abs(simulation.advance(t + 1).t / (t + 1) - 1) < 1e-12)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_ends_an_advance_at_a_step():
    path = ROOT / "scenes" / "compressor.toml"
    done = subprocess.run([sys.executable, "-c", INTERRUPTED, path], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout.splitlines() == ["interrupted True True"], done.stdout + done.stderr
