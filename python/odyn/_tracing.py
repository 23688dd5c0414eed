"""Values that are traced: numbers, conditions and vectors that write down what is computed with them."""

from __future__ import annotations

import math
import numbers
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, overload

from ._errors import Diagnostic, Error, Place

_PACKAGE = str(Path(__file__).resolve().parent)

Real = Any
"""A `Number`, or what is a number to Python."""


class TraceError(Error, TypeError):
    """An element in Python that cannot be recorded. `place` is the line of its class, `remedy` what to write there."""


def place_of_caller() -> Place | None:
    """The line outside of this package that is being executed."""
    frame = sys._getframe(1)
    while frame is not None and str(Path(frame.f_code.co_filename).resolve()).startswith(_PACKAGE):
        if frame.f_back is None:
            return None
        frame = frame.f_back
    return Place(frame.f_code.co_filename, frame.f_lineno, 1)


def refuse(code: str, message: str, remedy: str = "") -> NoReturn:
    """Raises a `TraceError` for the line that called into this package."""
    place = place_of_caller()
    lines = [f"error[{code}]: {message}"]
    lines += [f"  --> {place.file}:{place.line}"] if place else []
    lines += [f"  = help: {remedy}"] if remedy else []
    raise TraceError("\n".join(lines), (Diagnostic(code, "error", message, place, remedy),), 4)


def _no_number(used: str, remedy: str) -> NoReturn:
    refuse("ODY0831", f"a traced value has no number yet, and {used} asks for it", remedy)


class Line(NamedTuple):
    """A value: the words before its operands, the operands, the words behind."""

    head: str
    operands: tuple[Number, ...]
    tail: str


class Tape:
    """What was computed, value by value, in the words of files of elements. A value that is computed twice is written once."""

    def __init__(self) -> None:
        self.lines: list[Line] = []
        self.known: list[bool] = []
        """Whether a value depends on parameters only."""
        self.tables: list[str] = []
        self._numbers: dict[str, int] = {}

    def input(self, text: str) -> Number:
        """What the host gives."""
        return self._value(Line(text, (), ""), text.startswith("param "))

    def operation(self, head: str, operands: Sequence[Number], tail: str = "", arithmetic: bool = True) -> Number:
        """An operation with the words before and behind its operands."""
        for operand in operands:
            if operand._tape is not None and operand._tape is not self:
                refuse(
                    "ODY0832",
                    "a value of another element, or of a recording that has ended, is used",
                    "compute it in the function that uses it",
                )
        return self._value(Line(head, tuple(operands), tail), arithmetic and all(map(self.is_known, operands)))

    def is_known(self, value: Number) -> bool:
        """Whether a value depends on parameters only."""
        return value._value is not None or self.known[value._number]

    def table(self, text: str) -> int:
        """The number of a table."""
        if text not in self.tables:
            self.tables.append(text)
        return self.tables.index(text)

    def _value(self, line: Line, known: bool) -> Number:
        text = f"{line.head}|{' '.join(operand._text for operand in line.operands)}|{line.tail}"
        number = self._numbers.setdefault(text, len(self.lines))
        if number == len(self.lines):
            self.lines.append(line)
            self.known.append(known)
        return Number(self, number, None)


class Number:
    """A number of an element: a parameter, an input such as a coordinate or a velocity, or what is computed from these.

    It is computed with like a float; `odyn.sin`, `odyn.where` and so on take it. What it is, only a run knows: `if`, `float()` and
    functions of `math` raise a `TraceError`.
    """

    __slots__ = ("_number", "_tape", "_text", "_value")

    # numpy leaves arithmetic with it to it.
    __array_priority__ = 1000

    def __init__(self, tape: Tape | None, number: int, value: float | None) -> None:
        self._tape = tape
        self._number = number
        self._value = value
        self._text = f"v{number}" if value is None else repr(value)

    def __add__(self, other: Real) -> Number:
        return binary("add", self, other, lambda a, b: a + b)

    def __radd__(self, other: Real) -> Number:
        return binary("add", other, self, lambda a, b: a + b)

    def __sub__(self, other: Real) -> Number:
        return binary("sub", self, other, lambda a, b: a - b)

    def __rsub__(self, other: Real) -> Number:
        return binary("sub", other, self, lambda a, b: a - b)

    @overload
    def __mul__(self, other: Vec) -> Vec: ...

    @overload
    def __mul__(self, other: Real) -> Number: ...

    def __mul__(self, other: Real) -> Number | Vec:
        if isinstance(other, Vec):
            return other * self
        return binary("mul", self, other, lambda a, b: a * b)

    def __rmul__(self, other: Real) -> Number:
        return binary("mul", other, self, lambda a, b: a * b)

    def __truediv__(self, other: Real) -> Number:
        return binary("div", self, other, lambda a, b: a / b)

    def __rtruediv__(self, other: Real) -> Number:
        return binary("div", other, self, lambda a, b: a / b)

    def __neg__(self) -> Number:
        return unary("neg", self, lambda a: -a)

    def __pos__(self) -> Number:
        return self

    def __abs__(self) -> Number:
        found: Number = where(self < 0.0, -self, self)
        return found

    def __pow__(self, exponent: Real) -> Number:
        exponent = number(exponent)
        value = exponent._value
        if value is None:
            if not tape_of([exponent]).is_known(exponent):
                refuse(
                    "ODY0832",
                    "an exponent depends on parameters only, and this one on the motion",
                    "odyn.exp(b * odyn.log(a)) for a ** b with a > 0",
                )
            return operation("powf", [self, exponent])
        if self._value is not None:
            return number(self._value**value)
        if value.is_integer() and abs(value) < 2**31:
            return operation("powi", [self], str(int(value)))
        return operation("powf", [self, exponent])

    def __rpow__(self, base: Real) -> Number:
        base = number(base)
        if base._value is None or base._value <= 0:
            refuse("ODY0832", "the base of a power with a traced exponent must be a positive number")
        return unary("exp", self * math.log(base._value), math.exp)

    def __lt__(self, other: Real) -> Condition:
        return _less(self, number(other))

    def __gt__(self, other: Real) -> Condition:
        return _less(number(other), self)

    def __le__(self, other: Real) -> Condition:
        return ~_less(number(other), self)

    def __ge__(self, other: Real) -> Condition:
        return ~_less(self, number(other))

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Number) and None not in (self._value, other._value):
            return self._value == other._value
        _no_number("`==`", "compare with `<` or `>` in `odyn.where`; that two measured values are equal happens at no instant")

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = object.__hash__

    def __bool__(self) -> bool:
        return bool(self._known("`if`, `and`, `or`, `not` or `while`", "odyn.where(x > 0, a, b) chooses between values"))

    def __float__(self) -> float:
        return self._known(
            "`float()` or a function of `math`", "use that of odyn: odyn.sin(x), odyn.sqrt(x), odyn.atan2(y, x), odyn.exp(x)"
        )

    def __int__(self) -> int:
        return int(self._known("`int()`", "what is whole, such as a number of teeth, may be a parameter and a factor, not a count"))

    def __index__(self) -> int:
        self._known("an index or `range()`", "the number of terms must be known when the element is defined")
        raise TypeError("a float is no index")

    def __round__(self, digits: int = 0) -> float:
        return round(self._known("`round()`", "steps are tables: odyn.table(x, points, interpolation='steps')"), digits)

    def __mod__(self, other: Real) -> NoReturn:
        _no_number("`%`", "what repeats is a table: odyn.table(x, points, periodic=True), or a sine")

    def __floordiv__(self, other: Real) -> NoReturn:
        _no_number("`//`", "steps are tables: odyn.table(x, points, interpolation='steps')")

    def __array_ufunc__(self, function: Any, method: str, *inputs: Any, **options: Any) -> Any:
        known = NUMPY.get(function.__name__) if method == "__call__" and not options else None
        if known is None:
            _no_number(f"`numpy.{function.__name__}`", "use the functions of odyn, and Python's operators")
        return known(*inputs)

    def _known(self, used: str, remedy: str) -> float:
        if self._value is None:
            _no_number(used, remedy)
        return self._value

    def __repr__(self) -> str:
        if self._tape is None or self._value is not None:
            return f"<odyn.Number {self._value}>"
        line = self._tape.lines[self._number]
        words = " ".join([line.head, *(operand._text for operand in line.operands), line.tail]).strip()
        return f"<odyn.Number {self._text} = {words}>"


NUMPY: dict[str, Callable[..., Any]] = {}
"""What stands for functions of numpy, by their names."""


class Condition:
    """A comparison of traced values, for `odyn.where`. `&`, `|` and `~` stand for and, or and not."""

    __slots__ = ("_choose", "_value")

    def __init__(self, choose: Callable[[Number, Number], Number], value: bool | None) -> None:
        self._choose = choose
        self._value = value

    def __and__(self, other: Condition | bool) -> Condition:
        other = condition(other)
        both = None if None in (self._value, other._value) else bool(self._value and other._value)
        return Condition(lambda x, y: self._choose(other._choose(x, y), y), both)

    def __or__(self, other: Condition | bool) -> Condition:
        other = condition(other)
        either = None if None in (self._value, other._value) else bool(self._value or other._value)
        return Condition(lambda x, y: self._choose(x, other._choose(x, y)), either)

    def __invert__(self) -> Condition:
        return Condition(lambda x, y: self._choose(y, x), None if self._value is None else not self._value)

    def __bool__(self) -> bool:
        if self._value is None:
            _no_number(
                "`if`, `and`, `or`, `not`, `while`, `min`, `max` or a chain `a < b < c`",
                "odyn.where(x > 0, a, b) chooses between values, odyn.minimum and odyn.maximum take the smaller and the larger "
                "one; conditions are joined by `&` and `|`: (0 < x) & (x < 1)",
            )
        return self._value

    def __repr__(self) -> str:
        return f"<odyn.Condition {'traced' if self._value is None else self._value}>"


def condition(given: Condition | bool) -> Condition:
    """A condition of what may be known already."""
    if isinstance(given, Condition):
        return given
    value = bool(given)
    return Condition(lambda x, y: x if value else y, value)


def number(value: Real) -> Number:
    """A number of what may be one of Python's."""
    if isinstance(value, Number):
        return value
    if isinstance(value, Condition):
        refuse("ODY0832", "a condition is no number", "odyn.where(condition, 1.0, 0.0)")
    if not isinstance(value, numbers.Real) and not (hasattr(value, "dtype") and getattr(value, "shape", None) == ()):
        refuse("ODY0832", f"{value!r} is no number that equations can use")
    found = float(value)
    if not math.isfinite(found):
        refuse("ODY0832", f"{found} is no number that equations can use")
    return Number(None, -1, found)


def tape_of(operands: Sequence[Number]) -> Tape:
    """That of the first that is traced."""
    return next(operand._tape for operand in operands if operand._tape is not None)


def operation(head: str, operands: Sequence[Number], tail: str = "", arithmetic: bool = True) -> Number:
    """An operation on the tape of its operands, one of which is traced."""
    return tape_of(operands).operation(head, operands, tail, arithmetic)


def unary(name: str, x: Real, of_float: Callable[[float], float]) -> Number:
    """An operation of one value; of what is known, its value."""
    x = number(x)
    return operation(name, [x]) if x._value is None else number(of_float(x._value))


def binary(name: str, a: Real, b: Real, of_floats: Callable[[float, float], float]) -> Number:
    """An operation of two values; of what is known, its value."""
    a, b = number(a), number(b)
    if a._value is not None and b._value is not None:
        return number(of_floats(a._value, b._value))
    return operation(name, [a, b])


def _less(a: Number, b: Number) -> Condition:
    if a._value is not None and b._value is not None:
        return condition(a._value < b._value)
    return Condition(lambda x, y: operation("select", [a, b, x, y]), None)


def where(choice: Condition | bool, x: Real, y: Real) -> Any:
    """`x` where the condition holds, otherwise `y`; both numbers, or both vectors.

    Both are computed, so both must be numbers at every instant. The host sees where the choice changes, and ends a step there.
    """
    if isinstance(choice, Number):
        refuse("ODY0832", "`odyn.where` takes a condition, and this is a number", "odyn.where(x > 0.5, a, b)")
    choose = condition(choice)._choose
    if isinstance(x, Vec) or isinstance(y, Vec):
        a, b = Vec.of(x), Vec.of(y)
        return Vec(*(choose(one, other) for one, other in zip(a, b, strict=True)))
    return choose(number(x), number(y))


class Vec:
    """A vector of three numbers, in ground directions unless it is said otherwise."""

    __slots__ = ("x", "y", "z")

    # numpy leaves arithmetic with it to it.
    __array_ufunc__ = None

    def __init__(self, x: Real, y: Real, z: Real) -> None:
        self.x: Number = number(x)
        self.y: Number = number(y)
        self.z: Number = number(z)

    @staticmethod
    def of(given: Any) -> Vec:
        """A vector of what has three numbers."""
        if isinstance(given, Vec):
            return given
        try:
            components = list(given)
        except TypeError:
            components = []
        if len(components) != 3:
            refuse("ODY0832", f"{given!r} is no vector of three numbers", "odyn.Vec(x, y, z)")
        return Vec(*components)

    def __iter__(self) -> Iterator[Number]:
        return iter((self.x, self.y, self.z))

    def __len__(self) -> int:
        return 3

    def __getitem__(self, k: int) -> Number:
        return (self.x, self.y, self.z)[k]

    def __add__(self, other: Any) -> Vec:
        return Vec(*(a + b for a, b in zip(self, Vec.of(other), strict=True)))

    def __radd__(self, other: Any) -> Vec:
        # `sum()` begins with 0.
        return self if isinstance(other, int) and other == 0 else Vec.of(other) + self

    def __sub__(self, other: Any) -> Vec:
        return Vec(*(a - b for a, b in zip(self, Vec.of(other), strict=True)))

    def __rsub__(self, other: Any) -> Vec:
        return Vec.of(other) - self

    def __mul__(self, factor: Real) -> Vec:
        return Vec(*(a * number(factor) for a in self))

    __rmul__ = __mul__

    def __truediv__(self, divisor: Real) -> Vec:
        return Vec(*(a / number(divisor) for a in self))

    def __neg__(self) -> Vec:
        return Vec(*(-a for a in self))

    def dot(self, other: Any) -> Number:
        """The scalar product."""
        other = Vec.of(other)
        found: Number = self.x * other.x + self.y * other.y + self.z * other.z
        return found

    __matmul__ = dot

    def cross(self, other: Any) -> Vec:
        """The vector product."""
        o = Vec.of(other)
        return Vec(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)

    def __repr__(self) -> str:
        return f"<odyn.Vec {self.x!r}, {self.y!r}, {self.z!r}>"
