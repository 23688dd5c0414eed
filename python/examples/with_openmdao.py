"""The least shaking force by OpenMDAO: a component with partials by the solver's derivatives."""

from __future__ import annotations

import openmdao.api as om
import shaking


class Compressor(om.ExplicitComponent):
    """The shaking force of the compressor, N."""

    def setup(self) -> None:
        self.model = shaking.compressor()
        self.add_input("mass", shaking.START[0], units="g")
        self.add_input("length", shaking.START[1], units="mm")
        self.add_output("force", units="N")
        self.declare_partials("force", ["mass", "length"])

    def compute(self, inputs, outputs) -> None:
        outputs["force"] = shaking.shaking(self.model, [inputs["mass"][0], inputs["length"][0]])

    def compute_partials(self, inputs, partials) -> None:
        found = shaking.gradient(self.model, [inputs["mass"][0], inputs["length"][0]])
        partials["force", "mass"], partials["force", "length"] = found


def problem(iterations: int = 30) -> om.Problem:
    """The problem, set up."""
    made = om.Problem(reports=False)
    made.model.add_subsystem("compressor", Compressor(), promotes=["*"])
    for name, (low, high) in zip(("mass", "length"), shaking.BOUNDS, strict=True):
        made.model.add_design_var(name, lower=low, upper=high)
    made.model.add_objective("force")
    made.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-8, maxiter=iterations, disp=False)
    made.setup()
    return made


if __name__ == "__main__":
    made = problem()
    made.run_model()
    made.check_partials(method="fd", form="central", step=1e-3, step_calc="rel_avg")
    made.run_driver()
    print(f"{made['mass'][0]:.3f} g, {made['length'][0]:.3f} mm: {made['force'][0]:.4f} N")
