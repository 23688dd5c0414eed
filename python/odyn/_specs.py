"""What a class of an element declares: parameters, states, signals, values that it reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

from ._tracing import Condition, Number, Real, Tape, Vec, number, refuse

F = TypeVar("F", bound=Callable[..., Any])


class Spec:
    """What a class says of one of its values; instances of it see the value itself."""

    def __init__(self, kind: str, fields: Mapping[str, Any], start: Any = None) -> None:
        self.kind = kind
        self.fields = {key: value for key, value in fields.items() if value is not None}
        self.start = start


def _bounds(above: float | None, min: float | None, below: float | None, max: float | None) -> dict[str, float | None]:
    given = {"above": above, "min": min, "below": below, "max": max}
    return {key: None if bound is None else float(bound) for key, bound in given.items()}


def param(
    unit: str = "",
    *,
    default: float | None = None,
    above: float | None = None,
    min: float | None = None,
    below: float | None = None,
    max: float | None = None,
    doc: str = "",
    example: float | None = None,
) -> Number:
    """A number that scenes give: `length = odyn.param("m", above=0)`.

    Parameters
    ----------
    unit
        The SI unit that the equations have it in, for example `"N/m"`; scenes give any unit of its dimension. Empty: any.
    default
        For scenes that give none, in that unit.
    above, min, below, max
        The range that is allowed, `min` and `max` included.
    doc
        One sentence for users.
    example
        A value that the element takes, for `odyn plugin check`.
    """
    fields = {"kind": "number", "unit": unit, "doc": doc, "default": default, "example": example}
    return cast(Number, Spec("param", {**fields, **_bounds(above, min, below, max)}))


def vector_param(unit: str = "", *, default: Sequence[float] | None = None, doc: str = "") -> Vec:
    """Three numbers that scenes give, as a `Vec`."""
    given = None if default is None else [float(value) for value in default]
    return cast(Vec, Spec("param", {"kind": "vector", "unit": unit, "doc": doc, "default": given}))


class Function:
    """A function of one variable that scenes give: a number, an expression, or points."""

    def __init__(self, tape: Tape, name: str) -> None:
        self._tape = tape
        self._name = name

    def __call__(self, x: Real) -> Number:
        """Its value."""
        return self._tape.operation(f"function {self._name}", [number(x)], arithmetic=False)

    def slope(self, x: Real) -> Number:
        """Its derivative."""
        return self._tape.operation(f"slope {self._name}", [number(x)], arithmetic=False)


class Surface:
    """A function of two variables that scenes give on a grid."""

    def __init__(self, tape: Tape, name: str) -> None:
        self._tape = tape
        self._name = name

    def __call__(self, x: Real, y: Real) -> Number:
        """Its value."""
        return self._tape.operation(f"surface {self._name}", [number(x), number(y)], arithmetic=False)


def function_param(unit: str, *, variable: str = "x", default: float | None = None, doc: str = "") -> Function:
    """A function of one variable that scenes give; `unit` is `"m -> N"`, `variable` its name in expressions."""
    fields = {"kind": "function", "unit": unit, "doc": doc, "variable": variable, "default": default}
    return cast(Function, Spec("param", fields))


def surface_param(unit: str, *, doc: str = "") -> Surface:
    """A function of two variables that scenes give on a grid; `unit` is `"rad/s, 1 -> N m"`."""
    return cast(Surface, Spec("param", {"kind": "surface", "unit": unit, "doc": doc}))


class Choice:
    """One of several words that scenes give: `odyn.where(self.law == "cubic", a, b)`. A run has the chosen equations only."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, number: Number, name: str, choices: Sequence[str]) -> None:
        self._number = number
        self._name = name
        self._choices = list(choices)

    def __eq__(self, word: object) -> Condition:  # type: ignore[override]
        if word not in self._choices:
            refuse("ODY0832", f"`{self._name}` is never {word!r}", f"it is one of {', '.join(self._choices)}")
        place = self._choices.index(str(word))
        return (self._number > place - 0.5) & (self._number < place + 0.5)

    def __ne__(self, word: object) -> Condition:  # type: ignore[override]
        return ~(self == word)


def choice_param(choices: Sequence[str], *, default: str | None = None, doc: str = "") -> Choice:
    """One of several words that scenes give: `law = odyn.choice_param(["linear", "cubic"])`, `self.law == "cubic"`."""
    words = list(choices)
    if len(words) < 2 or len(set(words)) != len(words) or not all(isinstance(word, str) and word for word in words):
        refuse("ODY0832", f"{choices!r} are not two or more different words", 'odyn.choice_param(["linear", "cubic"])')
    if default is not None and default not in words:
        refuse("ODY0832", f"the default {default!r} is none of the choices", f"one of {', '.join(words)}")
    # Scenes of tests take the first one.
    fields = {"kind": "text", "unit": "", "doc": doc, "default": default, "example": words[0], "choices": words}
    return cast(Choice, Spec("param", fields))


Start = Any
"""A number, or a function of the element that computes one from its parameters."""


def state(unit: str = "", *, start: Start = 0.0, doc: str = "") -> Number:
    """A continuous state x' = f; `rates` gives f. `start` is its value at the start, or `lambda self: self.x0`."""
    return cast(Number, Spec("states", {"unit": unit, "doc": doc}, start))


class Flexible(Number):
    """A flexible coordinate of a force element, a number with a `rate`."""

    __slots__ = ("rate",)

    def __init__(self, tape: Tape, number: int, rate: Number) -> None:
        super().__init__(tape, number, None)
        self.rate: Number = rate
        """q'."""


def flexible(unit: str = "m", *, start: Start = 0.0, start_rate: Start = 0.0, doc: str = "") -> Flexible:
    """A coordinate q of a force element's own mass: a body that bends, a mass that slides along a frame.

    `kinetic(at)` has the energy of that mass, with q as `self.q` and its rate as `self.q.rate`; `flexible_forces(at)` gives the
    generalised force on q, whose power is that force times its rate. The host finds the accelerations.
    """
    fields = {"unit": unit, "doc": doc, "start_rate": start_rate}
    return cast(Flexible, Spec("flexible", fields, start))


def memory(*, start: Start = 0.0) -> Number:
    """A number that changes between steps only; `next_memory` gives it for after a step, or after a sample (`sample_period`)."""
    return cast(Number, Spec("memory", {}, start))


def unknown(unit: str = "", *, guess: Start = 0.0, doc: str = "") -> Number:
    """A number that follows from the others at every instant: `conditions` gives what is zero then. At most eight."""
    return cast(Number, Spec("unknowns", {"unit": unit, "doc": doc}, guess))


def signal(unit: str = "", *, default: float | None = None, doc: str = "") -> Number:
    """A signal that the element takes, connected in the scene under `inputs`; without a default it must be."""
    return cast(Number, Spec("inputs", {"unit": unit, "doc": doc, "default": default}))


def _reported(kind: str, unit: str, doc: str) -> Callable[[F], F]:
    def mark(function: F) -> F:
        text = doc or " ".join((function.__doc__ or "").split())
        function._odyn = Spec(kind, {"unit": unit, "doc": text})  # type: ignore[attr-defined]
        return function

    return mark


def channel(unit: str = "", doc: str = "") -> Callable[[F], F]:
    """Marks a function `f(self, at)` whose value is reported under its name; of a control element, a signal that it gives."""
    return _reported("channels", unit, doc)


def coordinate(unit: str = "", doc: str = "") -> Callable[[F], F]:
    """Marks a function `f(self, at)` of a joint that gives one of its coordinates, such as an angle."""
    return _reported("coordinates", unit, doc)


def check(unit: str = "", doc: str = "") -> Callable[[F], F]:
    """Marks a function `f(self, at)` that gives a margin: where it is negative the run warns. `doc` follows the name: "is overloaded"."""
    return _reported("checks", unit, doc)
