"""The compressor with a counterweight: how much it shakes, and how that changes with two of its measures.

The others here minimise it: `with_scipy.py`, `with_optuna.py`, `with_salib.py`, `with_openmdao.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy
import odyn

KEYS = ("counterweight.mass", "rod.length")
"""What is varied: in g, and in mm."""
BOUNDS = ((0.0, 40.0), (36.0, 60.0))
START = (5.0, 42.0)
FROM = 100.0
"""ms: when the start has died away."""
FORCES = ("Fx_ground_on_block", "Fy_ground_on_block")
NEWTONS = 1000.0
"""In one unit of force of the scene, kN."""


def compressor(scene: str | Path | None = None) -> odyn.Model:
    """The scene, with a counterweight of `counterweight.mass` on the rotor, 15 mm from its axis and opposite to the crank."""
    path = Path(scene or Path(__file__).parents[2] / "scenes" / "compressor.toml")
    text = path.read_text(encoding="utf-8")
    text = text.replace("[parameters]\n", '[parameters]\ncounterweight.mass = "5 g"\n', 1)
    rotor = "angular_velocity = [0, 0, 0.32]\n"
    assert rotor in text
    point = 'point_masses = [{ mass = "counterweight.mass", position = [-15, 0, 0] }]\n'
    return odyn.load(text=text.replace(rotor, rotor + point, 1))


def with_values(model: odyn.Model, values: object) -> odyn.Model:
    """The compressor with a mass in g and a length in mm."""
    mass, length = numpy.asarray(values, dtype=float).tolist()
    return model.set({"counterweight.mass": f"{mass!r} g", "rod.length": f"{length!r} mm"})


def _forces(run: odyn.Run) -> numpy.ndarray:
    late = run.t >= FROM
    return NEWTONS * numpy.array([run[name][late] for name in FORCES])


def shaking(model: odyn.Model, values: object) -> float:
    """The root mean square of the force that shakes the ground, without its mean, N."""
    run = with_values(model, values).run(progress=False).raise_if_not_ok()
    forces = _forces(run)
    rest = forces - forces.mean(axis=1, keepdims=True)
    return float(numpy.sqrt((rest**2).sum(axis=0).mean()))


def gradient(model: odyn.Model, values: object) -> numpy.ndarray:
    """Its derivatives, N/g and N/mm, by those of the forces."""
    here = with_values(model, values)
    run = here.run(progress=False).raise_if_not_ok()
    forces = _forces(run)
    rest = forces - forces.mean(axis=1, keepdims=True)
    size = numpy.sqrt((rest**2).sum(axis=0).mean())
    found = here.sensitivity(FORCES, KEYS, progress=False)
    late = found["times"] >= FROM
    per_unit = {one["key"]: {"kg": 1e-3, "g": 1.0, "mm": 1.0, "m": 1e-3}[one["unit"]] for one in found["parameters"]}
    slopes = {(one["output"], one["parameter"]): one["derivative"][late] for one in found["outputs"]}
    changes = numpy.array([[NEWTONS * per_unit[key] * slopes[name, key] for name in FORCES] for key in KEYS])
    # The mean of what has no mean: that of the changes drops out.
    return (rest * changes).sum(axis=1).mean(axis=1) / size


if __name__ == "__main__":
    machine = compressor(*sys.argv[1:])
    print(f"it shakes with {shaking(machine, START):.3f} N; changes: {gradient(machine, START)} N/g, N/mm")
