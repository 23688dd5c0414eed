"""The equations of motion as a function of JAX, with their exact derivatives by the state.

`f = equations(model.system())` can be mapped, compiled and differentiated, forwards and backwards: its values and Jacobians are called
from compiled programs. Derivatives by time, and second ones by the state, are refused.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import odyn
from jax.custom_derivatives import SymbolicZero

# States are doubles.
jax.config.update("jax_enable_x64", True)


def equations(system: odyn.System) -> Callable[[jax.Array, jax.Array], jax.Array]:
    """f(t, x) of a system."""

    def call(function, shape, t, x):
        return jax.pure_callback(function, jax.ShapeDtypeStruct(shape, "float64"), t, x, vmap_method="sequential")

    @jax.custom_jvp
    def f(t, x):
        return call(system.f, x.shape, t, x)

    def derivative(values, changes):
        (t, x), (dt, dx) = values, changes
        if not isinstance(dt, SymbolicZero):
            raise TypeError("the derivative of the equations by time is not known")
        return f(t, x), call(system.jac, 2 * x.shape, t, x) @ (jnp.zeros_like(x) if isinstance(dx, SymbolicZero) else dx)

    f.defjvp(derivative, symbolic_zeros=True)
    return f


def advanced(f: Callable[[jax.Array, jax.Array], jax.Array], x: jax.Array, t_end: float, steps: int) -> jax.Array:
    """The state at the end, by classical Runge-Kutta steps."""
    h = t_end / steps

    def step(x, t):
        a = f(t, x)
        b = f(t + h / 2, x + h / 2 * a)
        c = f(t + h / 2, x + h / 2 * b)
        d = f(t + h, x + h * c)
        return x + h / 6 * (a + 2 * b + 2 * c + d), None

    return jax.lax.scan(step, x, h * jnp.arange(steps))[0]
