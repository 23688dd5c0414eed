"""The equations of motion for integrators of others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from . import _odyn

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import ArrayLike, NDArray


class System:
    """x' = f(t, x), in SI units: s, m, rad, kg.

    x has positions, velocities, states of elements, and last the work done by whatever has no potential, in the coordinates that
    a run of the scene takes. Joints that are rows hold by their accelerations: what an integrator lets drift, `project` brings back.
    Angles that count turns are followed from call to call: from one call to the next, none may turn by half a turn.
    """

    def __init__(self, inner: _odyn.System) -> None:
        import numpy

        self._inner = inner
        self._array = numpy.asarray
        self.t_span: tuple[float, float] = (inner.span[0], inner.span[1])
        """Start and end of the scene, s."""
        self.x0: NDArray[float64] = numpy.array(inner.start)
        """The state at the start."""
        self.groups: tuple[str, ...] = tuple(inner.groups)
        """What each entry of the state is: `position` (m or rad), `parameter`, `velocity`, `angular_velocity`, `element_state`, `work`."""
        self.units: dict[str, str] = dict(inner.outputs)
        """The units of the outputs."""

    def f(self, t: float, x: ArrayLike) -> NDArray[float64]:
        """The rates of the state at a time, s."""
        return self._array(self._inner.rates(t, self._list(x)))

    def jac(self, t: float, x: ArrayLike) -> NDArray[float64]:
        """The exact derivatives of `f` by x: rows are rates, columns are entries of x.

        Raises
        ------
        ValueError
            There are none, because of the coordinates or an element.
        """
        found = self._inner.jacobian(t, self._list(x))
        if found is None:
            raise ValueError("the equations have no exact derivatives here; leave out `jac`")
        return self._array(found)

    def project(self, t: float, x: ArrayLike) -> NDArray[float64]:
        """The state nearby that meets all joints."""
        return self._array(self._inner.project(t, self._list(x)))

    def outputs(self, t: float, x: ArrayLike) -> dict[str, float]:
        """The outputs of the scene at a state, in their units."""
        return dict(zip(self.units, self._inner.values(t, self._list(x)), strict=True))

    def set_inputs(self, values: Mapping[str, float]) -> None:
        """Gives inputs other values from now on, in their units."""
        for name, value in values.items():
            self._inner.set_input(name, value)

    def _list(self, x: ArrayLike) -> list[float]:
        found: list[float] = self._array(x, dtype=float).tolist()
        return found
