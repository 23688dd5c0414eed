"""Functions of traced values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ._tracing import NUMPY, Number, Real, Vec, binary, number, operation, refuse, tape_of, unary, where


def sqrt(x: Real) -> Number:
    """Square root; its derivative at zero is infinite."""
    return unary("sqrt", x, math.sqrt)


def sin(x: Real) -> Number:
    """Sine of an angle in rad."""
    return unary("sin", x, math.sin)


def cos(x: Real) -> Number:
    """Cosine of an angle in rad."""
    return unary("cos", x, math.cos)


def tan(x: Real) -> Number:
    """Tangent of an angle in rad."""
    return sin(x) / cos(x)


def atan2(y: Real, x: Real) -> Number:
    """Angle of the point (x, y) in rad, in (-pi, pi]. Over more than half a turn: `at.angle`."""
    return binary("atan2", y, x, math.atan2)


def asin(x: Real) -> Number:
    """Angle in [-pi/2, pi/2] with this sine, rad; its derivative at -1 and 1 is infinite."""
    x = number(x)
    return atan2(x, sqrt((1.0 - x) * (x + 1.0)))


def acos(x: Real) -> Number:
    """Angle in [0, pi] with this cosine, rad; its derivative at -1 and 1 is infinite."""
    x = number(x)
    return atan2(sqrt((1.0 - x) * (x + 1.0)), x)


def atan(x: Real) -> Number:
    """Angle in (-pi/2, pi/2) with this tangent, rad."""
    return atan2(x, 1.0)


def exp(x: Real) -> Number:
    """e to the power of x."""
    return unary("exp", x, math.exp)


def log(x: Real) -> Number:
    """Natural logarithm."""
    return unary("ln", x, math.log)


def tanh(x: Real) -> Number:
    """Hyperbolic tangent, the usual smooth sign."""
    return unary("tanh", x, math.tanh)


def hypot(x: Real, y: Real) -> Number:
    """Length of two legs; it has no derivative where both are zero."""
    x, y = number(x), number(y)
    return sqrt(x * x + y * y)


def minimum(x: Real, y: Real) -> Number:
    """The smaller of two."""
    x, y = number(x), number(y)
    found: Number = where(x < y, x, y)
    return found


def maximum(x: Real, y: Real) -> Number:
    """The larger of two."""
    x, y = number(x), number(y)
    found: Number = where(x < y, y, x)
    return found


def clip(x: Real, low: Real, high: Real) -> Number:
    """Kept between two bounds."""
    return minimum(maximum(x, low), high)


def table(
    x: Real, points: Sequence[Sequence[float]], *, interpolation: str = "monotone", periodic: bool = False
) -> Number:
    """A function of x through points `[argument, value]`, which are known when the element is defined.

    Parameters
    ----------
    interpolation
        `monotone`, `linear`, `spline` or `steps`, as in scenes. Joints need `spline`: their equations are differentiated twice.
    periodic
        Whether the points are one period; otherwise the end values are held.
    """
    x = number(x)
    if x._value is not None:
        refuse("ODY0832", "`odyn.table` of a number that is known when the element is defined", "write the value")
    pairs = ", ".join(f"[{float(a)!r}, {float(b)!r}]" for a, b in points)
    words = f'interpolation = "{interpolation}", periodic = {"true" if periodic else "false"}'
    k = tape_of([x]).table(f"{{ points = [{pairs}], {words} }}")
    return operation(f"table {k}", [x], arithmetic=False)


def length(v: Any) -> Number:
    """The length of a vector; it has no derivative where it is zero."""
    v = Vec.of(v)
    return sqrt(v.dot(v))


def dot(a: Any, b: Any) -> Number:
    """The scalar product of two vectors."""
    return Vec.of(a).dot(b)


def cross(a: Any, b: Any) -> Vec:
    """The vector product of two vectors."""
    return Vec.of(a).cross(b)


NUMPY.update(
    {
        "add": lambda a, b: number(a) + number(b),
        "subtract": lambda a, b: number(a) - number(b),
        "multiply": lambda a, b: number(a) * number(b),
        "divide": lambda a, b: number(a) / number(b),
        "power": lambda a, b: number(a) ** number(b),
        "less": lambda a, b: number(a) < number(b),
        "greater": lambda a, b: number(a) > number(b),
        "less_equal": lambda a, b: number(a) <= number(b),
        "greater_equal": lambda a, b: number(a) >= number(b),
        "negative": lambda a: -a,
        "absolute": abs,
        "sin": sin,
        "cos": cos,
        "tan": tan,
        "arcsin": asin,
        "arccos": acos,
        "arctan": atan,
        "arctan2": atan2,
        "sqrt": sqrt,
        "exp": exp,
        "log": log,
        "tanh": tanh,
        "hypot": hypot,
        "minimum": minimum,
        "maximum": maximum,
    }
)
