"""The book's chapter as a notebook, and the worked examples, each where what it needs is installed."""

from __future__ import annotations

import sys

import numpy
import odyn
import pytest
from conftest import PENDULUM, ROOT

sys.path.insert(0, str(ROOT / "python" / "examples"))


def test_the_chapter_of_the_book_runs(monkeypatch):
    preprocessors = pytest.importorskip("nbconvert.preprocessors")
    pytest.importorskip("ipykernel")
    pytest.importorskip("pandas")
    pytest.importorskip("scipy")
    import notebook

    made = notebook.notebook()
    blocks = sum(cell.cell_type == "code" for cell in made.cells)
    assert blocks > 8
    # The warnings of debuggers about frozen modules are no part of it.
    monkeypatch.setenv("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    preprocessors.ExecutePreprocessor(timeout=300, kernel_name="python3").preprocess(
        made, {"metadata": {"path": str(ROOT / "scenes")}}
    )
    shown = [out for cell in made.cells if cell.cell_type == "code" for out in cell.outputs if "data" in out]
    assert any("iframe" in out["data"].get("text/html", "") for out in shown)


def test_derivatives_of_the_shaking_force():
    import shaking

    model = shaking.compressor().set({"simulation.tolerance": 1e-12})
    exact = shaking.gradient(model, shaking.START)
    steps = (0.05, 0.05)
    for k, h in enumerate(steps):
        values = []
        for side in (-2, -1, 1, 2):
            x = list(shaking.START)
            x[k] += side * h
            values.append(shaking.shaking(model, x))
        a, b, c, d = values
        assert exact[k] == pytest.approx((a - 8 * b + 8 * c - d) / (12 * h), rel=1e-6), shaking.KEYS[k]


def test_scipy_finds_less():
    pytest.importorskip("scipy")
    import shaking
    import with_scipy

    found = with_scipy.least(iterations=4)
    assert found.fun < 0.7 * shaking.shaking(shaking.compressor(), shaking.START)


def test_jax_differentiates_through_the_equations():
    jax = pytest.importorskip("jax")
    import with_jax

    system = odyn.load(text=PENDULUM).system()
    f = with_jax.equations(system)

    def end(x):
        return with_jax.advanced(f, x, 0.2, 20)

    x0 = jax.numpy.asarray(system.x0)
    assert (numpy.asarray(f(0.1, x0)) == system.f(0.1, system.x0)).all()
    forward, backward = jax.jit(jax.jacfwd(end))(x0), jax.jit(jax.jacrev(end))(x0)
    assert abs(forward - backward).max() < 1e-12
    for k in range(len(x0)):
        h = 1e-4
        differences = (end(x0.at[k].add(h)) - end(x0.at[k].add(-h))) / (2 * h)
        assert abs(forward[:, k] - differences).max() < 1e-7 * (1 + abs(differences).max())
    many = jax.vmap(f, in_axes=(None, 0))(0.1, jax.numpy.stack([x0, x0 + 0.1]))
    assert (many[1] == system.f(0.1, system.x0 + 0.1)).all()
    with pytest.raises(TypeError, match="by time"):
        jax.grad(lambda t: f(t, x0)[0])(0.1)


def test_optuna_is_told():
    pytest.importorskip("optuna")
    import with_optuna

    study = with_optuna.least(trials=8)
    assert len(study.trials) == 8 and study.best_value < 45


def test_salib_has_indices():
    pytest.importorskip("SALib")
    import with_salib

    found = with_salib.influence(count=8)
    assert found["ST"].shape == (2,) and numpy.isfinite(found["ST"]).all()


def test_openmdao_has_partials():
    pytest.importorskip("openmdao")
    import with_openmdao

    made = with_openmdao.problem()
    made.run_model()
    data = made.check_partials(method="fd", form="central", step=1e-3, step_calc="rel_avg", out_stream=None)
    for (_, name), one in data["compressor"].items():
        forward, differences = numpy.asarray(one["J_fwd"]), numpy.asarray(one["J_fd"])
        assert numpy.abs(forward / differences - 1).max() < 1e-6, (name, forward, differences)
