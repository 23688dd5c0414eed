"""The least shaking force by SciPy: L-BFGS-B with the derivatives of the solver."""

from __future__ import annotations

import shaking
from scipy.optimize import OptimizeResult, minimize


def least(iterations: int = 30) -> OptimizeResult:
    """Mass of the counterweight, g, and length of the rod, mm, that make the compressor shake least."""
    model = shaking.compressor()
    return minimize(
        lambda x: shaking.shaking(model, x),
        shaking.START,
        jac=lambda x: shaking.gradient(model, x),
        bounds=shaking.BOUNDS,
        method="L-BFGS-B",
        options={"maxiter": iterations, "ftol": 1e-10},
    )


if __name__ == "__main__":
    found = least()
    print(f"{found.message}\n{found.x[0]:.3f} g, {found.x[1]:.3f} mm: {found.fun:.4f} N after {found.nfev} evaluations")
