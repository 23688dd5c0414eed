"""What runs give."""

from __future__ import annotations

import html
import shutil
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _odyn
from ._errors import Diagnostic, Error, RunWarning, diagnostics_of
from ._values import result

if TYPE_CHECKING:
    import pandas
    import pyarrow
    import xarray
    from numpy import float64
    from numpy.typing import NDArray

    Array = NDArray[float64]


class Report(dict[str, Any]):
    """What `check` and `plan` found: entries as the program gives them with `--json`; as text, what it prints."""

    def __init__(self, text: str, found: str, warned: list[Any]) -> None:
        super().__init__(result(found))
        self.text: str = text
        """What `odyn check` or `odyn plan` prints."""
        self.warnings: tuple[Diagnostic, ...] = diagnostics_of(warned)
        """What the scene is warned of."""

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return self.text


class Channel(NamedTuple):
    """What a column is."""

    name: str
    unit: str
    """Empty for a pure number."""
    quantity: str
    """What is measured, as a word of scene files such as `reaction_force`; may be empty."""
    place: str
    """On which body, at which point, in which frame; may be empty."""
    si_per_unit: float
    """One unit of the column in SI."""
    unique: bool
    """False if rigid bodies do not determine the value: a reaction that redundant joints share."""


class Event(NamedTuple):
    """Something that happened to a contact; SI units."""

    time: float
    """s"""
    element: str
    kind: str
    """`impact`, `closes`, `opens`, `sticks`, `slides`, `creeps`, `releases`, `switches`, `indeterminate` or `ambiguous`."""
    row: str
    rate_before: float
    """m/s for a distance; of impacts."""
    rate_after: float
    impulse: float
    """N s for a distance."""
    energy_lost: float
    """J"""


class Run(Mapping[str, "Array"]):
    """What a run gave: by the names of its outputs, NumPy arrays in units of the scene.

    Arrays own the memory that the solver wrote, and cannot be written to; `.copy()` gives one that can.
    """

    def __init__(self, inner: _odyn.Run, folder: Path | None, temporary: tempfile.TemporaryDirectory[str] | None) -> None:
        import numpy

        self._inner = inner
        self._folder = folder
        self._temporary = temporary
        self.channels: tuple[Channel, ...] = tuple(Channel(*one) for one in inner.channels)
        """What the columns are, in the order of the scene."""
        # NumPy takes the memory as it is.
        arrays = [numpy.asarray(column) for column in inner.columns]
        self._columns: dict[str, Array] = dict(zip((one.name for one in self.channels), arrays, strict=True))
        self._times: Array = numpy.asarray(inner.times)
        self._summary: dict[str, Any] | None = None

    def __getitem__(self, name: str) -> Array:
        try:
            return self._columns[name]
        except KeyError:
            known = ", ".join(self._columns) or "none: the scene has no [[output]]"
            raise KeyError(f"there is no output `{name}`; known are {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def t(self) -> Array:
        """Times of the samples, in `units["t"]`."""
        return self._times

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, and of the times as `t`."""
        return {"t": self.summary["time_unit"], **{one.name: one.unit for one in self.channels}}

    @property
    def summary(self) -> dict[str, Any]:
        """Everything about the run but its samples: the content of `summary.json`."""
        if self._summary is None:
            self._summary = result(self._inner.summary())
        return self._summary

    @property
    def status(self) -> str:
        """`completed`; `suspect`, where the audit found more than is allowed; `stopped_early`; `failed`."""
        return self._inner.status

    @property
    def reason(self) -> str:
        """Why it ended early, or is suspect; else empty."""
        return self._inner.reason

    @property
    def ok(self) -> bool:
        """Whether the run was completed, the audit passed, and so did all checks of the scene."""
        return self._inner.exit_code == 0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be known about the results, one line each with its code."""
        return tuple(self.summary["warnings"])

    @property
    def audit(self) -> dict[str, Any]:
        """What can be checked without knowing the solution: violations of joints, the energy balance. SI units and shares."""
        found = self.summary["audit"]
        assert isinstance(found, dict)
        return found

    @property
    def figures(self) -> dict[str, float | None]:
        """The figures of the scene, in their units; `None` for one that there is not."""
        return {one["name"]: one["value"] for one in self.summary["figures"]}

    @property
    def checks(self) -> list[dict[str, Any]]:
        """The checks of the scene: what was compared, the largest difference, whether it is allowed."""
        return list(self.summary["checks"])

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened to contacts, in order."""
        return tuple(Event(*one) for one in self._inner.events())

    @property
    def folder(self) -> Path | None:
        """The folder that the run was written into, if any."""
        return self._folder

    def raise_if_not_ok(self) -> Run:
        """Gives the run if it is `ok`.

        Raises
        ------
        odyn.Error
            The run is suspect, was stopped early, or a check failed.
        """
        if self.ok:
            return self
        code = self.summary["code"] or ""
        found = Diagnostic(code, "error", self.verdict, None, "")
        raise Error(f"{self.verdict}", (found,), self._inner.exit_code)

    @property
    def verdict(self) -> str:
        """How it went, in a sentence."""
        words = self.status.replace("_", " ")
        if self.reason:
            return f"{words}: {self.reason}"
        failed = [one["name"] for one in self.checks if not one["passed"]]
        return f"{words}, but checks failed: {', '.join(failed)}" if failed else words

    def _warn(self) -> None:
        if not self.ok:
            warnings.warn(f"the run is not to be taken as it is: {self.verdict}", RunWarning, stacklevel=3)

    def to_pandas(self) -> pandas.DataFrame:
        """A table over the times; `attrs["units"]` has the units."""
        import pandas

        index = pandas.Index(self.t, name="t")
        frame = pandas.DataFrame(self._columns, index=index)
        frame.attrs.update(units=self.units, status=self.status, title=self.summary["title"])
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """A data set over `t`; each variable has its unit, quantity and place in `attrs`."""
        import xarray

        def attributes(one: Channel) -> dict[str, Any]:
            about = {"quantity": one.quantity, "place": one.place}
            return {"units": one.unit, "unique": int(one.unique), **{key: text for key, text in about.items() if text}}

        variables = {one.name: ("t", self._columns[one.name], attributes(one)) for one in self.channels}
        times = ("t", self.t, {"units": self.units["t"]})
        about = {"title": self.summary["title"], "status": self.status, "odyn_version": self.summary["odyn_version"]}
        return xarray.Dataset(variables, coords={"t": times}, attrs=about)

    def arrow(self) -> pyarrow.Table:
        """An Arrow table with `t` first; each field has its unit in its metadata, the table has the summary."""
        import pyarrow

        units = self.units
        names = ["t", *self._columns]
        arrays = [pyarrow.array(values) for values in (self.t, *self._columns.values())]
        fields = [pyarrow.field(name, pyarrow.float64(), metadata={"unit": units[name]}) for name in names]
        about = {"odyn": self._inner.summary()}
        return pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields, metadata=about))

    def save(self, folder: str | Path) -> Path:
        """Writes the results into a folder, as `odyn run -o` does; `odyn report` and `odyn compare` read it.

        Of a run with `motion=True` (or an `output`) that is all files; else table, columns, events and summary.
        """
        folder = Path(folder)
        if self._folder is None:
            self._inner.write(folder)
        elif not folder.is_dir() or not self._folder.samefile(folder):
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copytree(self._folder, folder, dirs_exist_ok=True)
        return folder

    def report(self, *others: Run) -> str:
        """The report as an HTML page that needs no other file: verdict, motion (of runs with `motion=True`), plots, table.

        Other runs are shown on top of this one.
        """
        with tempfile.TemporaryDirectory(prefix="odyn-") as place:
            folders = [
                run._folder or run.save(Path(place) / f"run-{number}") for number, run in enumerate((self, *others), 1)
            ]
            return _odyn.report(folders)

    def __str__(self) -> str:
        return self._inner.text()

    def __repr__(self) -> str:
        names = ", ".join(self._columns)
        return f"<odyn.Run {self.verdict}; {len(self.t)} samples of {names}>"

    def _repr_html_(self) -> str:
        page = html.escape(self.report(), quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:720px;border:0" title="report of the run"></iframe>'
