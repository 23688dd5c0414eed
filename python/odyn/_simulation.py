"""Scenes that are stepped from outside."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, MutableMapping
from typing import TYPE_CHECKING, Any

from . import _odyn
from ._errors import Error, UnknownName

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray


class Saved:
    """A simulation at one of its times: everything that its future depends on. It can be pickled."""

    def __init__(self, inner: _odyn.Saved) -> None:
        self._inner = inner

    def __reduce__(self) -> tuple[Any, ...]:
        return (_saved_of, (self._inner.content(),))


def _saved_of(content: bytes) -> Saved:
    return Saved(_odyn.Saved.of_content(content))


def _value(known: Container[str], name: str, value_of: Callable[[str], float]) -> float:
    try:
        return value_of(name)
    except Error as error:
        if name in known:
            raise
        raise UnknownName(*error.args) from None


class Inputs(MutableMapping[str, float]):
    """The inputs of a simulation by name, in the units of their `[[input]]`."""

    def __init__(self, inner: _odyn.Simulation) -> None:
        self._inner = inner

    def __getitem__(self, name: str) -> float:
        return _value(self, name, self._inner.input)

    def __contains__(self, name: object) -> bool:
        return name in self._inner.inputs

    def __setitem__(self, name: str, value: float) -> None:
        self._inner.set_input(name, value)

    def __delitem__(self, name: str) -> None:
        raise TypeError("an input keeps a value")

    def __iter__(self) -> Iterator[str]:
        return iter(self._inner.inputs)

    def __len__(self) -> int:
        return len(self._inner.inputs)


class Outputs(Mapping[str, float]):
    """The outputs of a simulation by name at its time, in their units."""

    def __init__(self, inner: _odyn.Simulation) -> None:
        self._inner = inner

    def __getitem__(self, name: str) -> float:
        return _value(self, name, self._inner.output)

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def __iter__(self) -> Iterator[str]:
        return (name for name, _ in self._inner.outputs)

    def __len__(self) -> int:
        return len(self._inner.outputs)


class Simulation:
    """A scene in motion: advanced as far as is wanted, given new values of its inputs, asked for its outputs, saved, restored.

    Times, inputs and outputs are in the units of the scene. An input stays as it is until it is given another value; a step ends
    at every time that is advanced to, so that a change is exact.
    """

    def __init__(self, inner: _odyn.Simulation) -> None:
        self._inner = inner
        self.inputs: Inputs = Inputs(inner)
        """What the scene takes from outside; setting one changes it from this time on."""
        self.outputs: Outputs = Outputs(inner)
        """What the scene gives, at this time."""

    @property
    def t(self) -> float:
        """The time."""
        return self._inner.time

    @property
    def end(self) -> float:
        """The end of the scene."""
        return self._inner.end

    @property
    def units(self) -> dict[str, str]:
        """The units of the outputs."""
        return dict(self._inner.outputs)

    def advance(self, t: float) -> Simulation:
        """Goes on to a time.

        Raises
        ------
        odyn.Error
            A time that has passed or is beyond the end; a motion that cannot go on: the simulation then is at the last time
            that is good.
        KeyboardInterrupt
            Ctrl-C: the simulation then is at its last step, from where it can be advanced.
        """
        self._inner.advance(t)
        return self

    def save(self) -> Saved:
        """Everything that the future depends on. Going on from there gives the same digits, also in another process."""
        return Saved(self._inner.save())

    def restore(self, saved: Saved) -> Simulation:
        """Back to what was saved of this simulation, or of another one of the same scene. Samples behind it are dropped."""
        self._inner.restore(saved._inner)
        return self

    def samples(self) -> dict[str, NDArray[float64]]:
        """The samples taken so far at the times that the scene asks for: `t`, and the outputs by name."""
        import numpy

        times, columns = self._inner.samples()
        arrays = (numpy.asarray(column) for column in columns)
        return {"t": numpy.asarray(times), **dict(zip(self.outputs, arrays, strict=True))}

    def __repr__(self) -> str:
        return f"<odyn.Simulation at {self.t:g} of {self.end:g}>"
