"""Analyses of scenes: what is beside their runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _odyn
from ._progress import Listening, Progress
from ._run import Run
from ._tables import Table, file_of
from ._values import Value, result, text_of

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

    from ._model import Model

Result = dict[str, Any]
"""What the program writes as JSON, with lists of numbers as NumPy arrays; what is not known is NaN."""


class Linear(NamedTuple):
    """z' = A z + B u, y = C z + D u, for small changes. Time in s; z in SI; u and y in the units of their ports."""

    A: NDArray[float64]
    B: NDArray[float64]
    C: NDArray[float64]
    D: NDArray[float64]
    about: Result
    """`time` (s), `at_rest`, names of the `states`, `inputs` and `outputs` with units and values, `notes` that are to be read."""


class Fit(NamedTuple):
    """Numbers of a scene that fit measurements."""

    about: Result
    """What `odyn fit` writes as JSON: `status`, `parameters` with intervals, `correlation`, `columns`, `notes`."""
    values: dict[str, float]
    """The numbers, in their units (`about["parameters"]`)."""
    model: Model
    """The scene with them."""
    text: str | None
    """The text of the scene file with them, without what else is set; `None` where one of them was set, and is not in it."""


def _folder(start: Run | str | PathLike[str] | None) -> Path | None:
    if not isinstance(start, Run):
        return None if start is None else Path(start)
    if start.folder is None:
        raise ValueError("give a run with an `output`: its state at the end is kept there")
    return start.folder


def _one_or_more(names: str | Iterable[str] | None) -> list[str] | None:
    if names is None:
        return None
    return [names] if isinstance(names, str) else list(names)


class Analyses:
    """What can be found out about a scene beside running it. Ctrl-C raises `KeyboardInterrupt` as soon as what is under way
    can be ended."""

    _inner: _odyn.Model

    def statics(self, *, starts: int | None = None, progress: Progress = None) -> Result:
        """The equilibrium nearest downhill from where the scene starts; with `starts`, all that are found from so many.

        Gives `stability`, `bodies`, `outputs`, `modes`, `audit`, ...; with `starts`, these in the list `found`, and `failed`.

        Raises
        ------
        odyn.Error
            There is none, with the cause.
        """
        with Listening(progress) as listen:
            return result(_odyn.statics(self._inner, starts, listen))

    def modes(
        self,
        at: float | str = "start",
        *,
        start: Run | str | PathLike[str] | None = None,
        progress: Progress = None,
    ) -> Result:
        """Modes of small motions: `frequency` (Hz), `damping_ratio`, `shape`, energies of each of `modes`, slowest first.

        Parameters
        ----------
        at
            `"start"`, `"equilibrium"` or a time of the run, in the scene's unit.
        start
            A run with an `output`, or a folder of results, whose end is taken as the start.
        """
        with Listening(progress) as listen:
            return result(_odyn.modes(self._inner, at, _folder(start), listen))

    def linearise(
        self,
        inputs: str | Iterable[str] | None = None,
        outputs: str | Iterable[str] | None = None,
        *,
        at: float | str = "start",
        start: Run | str | PathLike[str] | None = None,
        progress: Progress = None,
    ) -> Linear:
        """A linear model in independent coordinates, by exact derivatives; from inputs to outputs by name, all where left out.

        `at` and `start` are as for `modes`.
        """
        import numpy

        names = _one_or_more(inputs), _one_or_more(outputs)
        with Listening(progress) as listen:
            matrices, about = _odyn.linearise(self._inner, *names, at, _folder(start), listen)
        a, b, c, d = (numpy.asarray(one) for one in matrices)
        return Linear(a, b, c, d, result(about))

    def kinematics(
        self,
        drive: str | tuple[str, Value, Value, int] | None = None,
        *,
        progress: Progress = None,
    ) -> Result:
        """Places without forces: `places`, `columns`, their `values`, `extents`, `dead_points`.

        Parameters
        ----------
        drive
            Left out: over time, by the scene's own drivers. An output or `joint.channel`: along the whole motion. With two values and
            a count, such as `("crank.angle", "0 deg", "360 deg", 361)`: over that range.
        """
        name, ends = (drive, None) if drive is None or isinstance(drive, str) else (drive[0], drive[1:])
        texts = None if ends is None else (text_of(ends[0]), text_of(ends[1]), ends[2])
        with Listening(progress) as listen:
            return result(_odyn.kinematics(self._inner, name, texts, listen))

    def inverse(
        self,
        motion: Table,
        *,
        by: str | Iterable[str] | None = None,
        follow: str | Iterable[str] | None = None,
        times: Sequence[float] | None = None,
        progress: Progress = None,
    ) -> Result:
        """The efforts of actuators that cause a motion: `times` (s), `actuators`, their `efforts`, `notes`.

        Parameters
        ----------
        motion
            Quantities over time: a CSV file, or columns by names with units, such as `{"t [s]": ..., "crank.angle [deg]": ...}`.
        by
            Inputs, or quantities along which an effort acts; all inputs where left out, and without any the prescribed quantities.
        follow
            Columns that are taken of the motion; all where left out.
        times
            In the scene's unit; those of the motion where left out.
        """
        moments = None if times is None else [float(time) for time in times]
        with file_of(motion) as path, Listening(progress) as listen:
            if path is None:
                raise TypeError("a motion is wanted")
            return result(_odyn.inverse(self._inner, path, _one_or_more(by), _one_or_more(follow), moments, listen))

    def loads(self, body: str, *, times: Sequence[float] | None = None, progress: Progress = None) -> Result:
        """All loads on a body, in its own axes, SI: `attachments`, and their `wrenches` in each of `cases`.

        At times in the scene's unit; where left out, where a force or moment is largest among the output times.
        """
        moments = None if times is None else [float(time) for time in times]
        with Listening(progress) as listen:
            return result(_odyn.loads(self._inner, body, moments, listen))

    def balance(
        self,
        turn: str,
        *,
        turns: int = 2,
        harmonics: int = 8,
        radius: Value | None = None,
        about: tuple[float, float, float] = (0.0, 0.0, 0.0),
        progress: Progress = None,
    ) -> Result:
        """What shakes the ground in the last whole turns of `joint.channel`, and the counterweight that makes it least; SI.

        Gives `before`, `counterweight` (with the text `set` that adds it to the scene, empty where none is better), `predicted`, and `after` by a run with it.
        `radius` is that of the counterweight; `about` the point of moments, in the scene's unit of length.
        """
        text = None if radius is None else text_of(radius)
        with Listening(progress) as listen:
            return result(_odyn.balance(self._inner, turn, turns, harmonics, text, about, listen))

    def sensitivity(
        self,
        of: str | Iterable[str] = (),
        to: str | Iterable[str] = (),
        *,
        step: float | None = None,
        jobs: int = 0,
        progress: Progress = None,
    ) -> Result:
        """Derivatives of outputs and figures (all where `of` is empty) with respect to numbers of the scene, with their errors.

        Gives `figures` and `outputs`, one entry for each pair, with `derivative`, `error`, `digits` and `unit`.
        """
        wanted, numbers = _one_or_more(of) or [], _one_or_more(to) or []
        with Listening(progress) as listen:
            return result(_odyn.sensitivity(self._inner, wanted, numbers, step, jobs, listen))

    def fit(
        self,
        data: Table | None = None,
        vary: str | Iterable[str] | Mapping[str, tuple[Value, Value] | None] = (),
        *,
        columns: Mapping[str, str] | None = None,
        noise: Mapping[str, float] | None = None,
        figures: Mapping[str, float | tuple[float, float]] | None = None,
        iterations: int | None = None,
        jobs: int = 0,
        progress: Progress = None,
    ) -> Fit:
        """Numbers of the scene that fit measurements.

        Parameters
        ----------
        data
            A table with times and measured columns.
        vary
            Keys of numbers, with their bounds where they have some: `{"rod.length": ("30 mm", "60 mm")}`; `math.inf` and `-math.inf` are none.
        columns
            Measured columns with the outputs that they measure; all by their own names where left out.
        noise
            Standard deviations of columns, in the unit of their outputs; estimated where left out.
        figures
            Measured figures of the scene, with standard deviations where known.
        """
        from ._model import Model

        def bounded(key: str, bounds: tuple[Value, Value] | None) -> str:
            if bounds is None:
                return key
            low, high = ("" if bound == none else text_of(bound) for bound, none in zip(bounds, (-math.inf, math.inf), strict=True))
            return f"{key}={low}:{high}"

        pairs = vary.items() if isinstance(vary, Mapping) else ((key, None) for key in _one_or_more(vary) or [])
        varied = [bounded(key, bounds) for key, bounds in pairs]
        known: list[tuple[str, float, float | None]] = [
            (name, float(one[0]), float(one[1])) if isinstance(one, tuple) else (name, float(one), None)
            for name, one in (figures or {}).items()
        ]
        with file_of(data) as path, Listening(progress) as listen:
            about, text = _odyn.fitted(
                self._inner,
                path,
                varied,
                list((columns or {}).items()),
                list((noise or {}).items()),
                known,
                iterations,
                jobs,
                listen,
            )
        found = result(about)
        values = {one["key"]: float(one["value"]) for one in found["parameters"]}
        place = self._place if isinstance(self, Model) else None
        return Fit(found, values, Model(self._inner.set(found["sets"]), place), text)
