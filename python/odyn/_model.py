"""Scenes, with what can be done with them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _odyn
from ._analyses import Analyses
from ._elements import Element, file_of, recorded
from ._progress import Listening, Progress, in_notebook
from ._run import Report, Run
from ._simulation import Simulation
from ._system import System
from ._values import Value, settings

if TYPE_CHECKING:
    from os import PathLike


def load(
    scene: str | PathLike[str] | None = None,
    *,
    text: str | None = None,
    folder: str | PathLike[str] | None = None,
    plugins: Iterable[str | PathLike[str]] = (),
    elements: Iterable[Element | type] = (),
) -> Model:
    """Reads a scene.

    Parameters
    ----------
    scene
        The scene file.
    text
        The text of a scene, in place of a file. What it names is looked for in `folder`.
    plugins
        Libraries of elements, or folders to look for them in, besides those that came with the package.
    elements
        Elements written in Python, which the scene then uses by their names, whether it lists libraries or not.

    Raises
    ------
    odyn.Error
        A file that cannot be read, or everything that is wrong with the scene.
    """
    if (scene is None) == (text is None):
        raise TypeError("give a scene file, or `text=`")
    texts = tuple(element.text for element in recorded(elements))
    more = [*(Path(one) for one in plugins), *map(file_of, texts)]
    if scene is not None:
        return Model(_odyn.Model(Path(scene), None, more), None, texts)
    if folder is not None:
        return Model(_odyn.Model(Path(folder) / "scene.toml", text, more), None, texts)
    # A file for what reads scenes itself.
    place = tempfile.TemporaryDirectory(prefix="odyn-")
    path = Path(place.name) / "scene.toml"
    path.write_text(text or "", encoding="utf-8")
    return Model(_odyn.Model(path, None, more), place, texts)


class Model(Analyses):
    """A scene with what is set of it. It does not change: `set` gives another one.

    Whatever is computed is computed from the scene as it was loaded. Calls give up the lock of the interpreter, so that threads
    compute side by side.
    """

    def __init__(
        self,
        inner: _odyn.Model,
        place: tempfile.TemporaryDirectory[str] | None = None,
        elements: tuple[str, ...] = (),
    ) -> None:
        self._inner = inner
        self._place = place
        self._elements = elements

    def _with(self, texts: list[str]) -> Model:
        return Model(self._inner.set(texts), self._place, self._elements) if texts else self

    def set(self, changes: Mapping[str, Value] | None = None, /, **parameters: Value) -> Model:
        """The scene with other values: parameters, settings, keys of bodies and elements, as behind `odyn run --set`.

        Values are texts such as `"50 mm"`, or numbers in the unit of the scene, or lists of these. Later ones count.

        Raises
        ------
        odyn.Error
            A key that the scene does not have, a value of another dimension.
        """
        return self._with(settings({**(changes or {}), **parameters}, {}))

    @property
    def path(self) -> Path:
        """The scene file."""
        return Path(self._inner.path)

    @property
    def text(self) -> str:
        """The text of the scene as it was loaded."""
        return self._inner.text

    @property
    def overrides(self) -> tuple[str, ...]:
        """What is set of it, as `KEY=VALUE`."""
        return tuple(self._inner.overrides)

    def check(self) -> Report:
        """Mobility, redundant rows, reactions that are not unique; with the warnings of the scene."""
        return Report(*self._inner.check())

    def plan(self) -> Report:
        """How the scene is computed: coordinates, rows, what is skipped, operations."""
        return Report(*self._inner.plan())

    def run(
        self,
        t_end: Value | None = None,
        *,
        method: str | None = None,
        tolerance: float | None = None,
        fixed_step: Value | None = None,
        output_step: Value | None = None,
        engine: str | None = None,
        formulation: str | None = None,
        islands: str | None = None,
        audit_tolerance: float | str | None = None,
        motion: bool | None = None,
        output: str | PathLike[str] | None = None,
        start: Run | str | PathLike[str] | None = None,
        jobs: int = 0,
        progress: Progress = None,
    ) -> Run:
        """Integrates the scene.

        Ctrl-C ends the run after its step, and gives what there is up to there; once more raises `KeyboardInterrupt`. A run
        that is not to be taken as it is (`run.ok` is false) is also told as a `RunWarning`.

        Parameters
        ----------
        t_end, fixed_step, output_step
            A number in the scene's unit of time, or a text with its own; the scene's where left out.
        method, tolerance, engine, formulation, islands
            As in `[simulation]` of the scene.
        audit_tolerance
            Largest constraint violation and energy error that the audit lets pass, or `"none"`.
        motion
            Whether the report moves, for which poses are kept in files; where left out, in notebooks.
        output
            A folder that the results are written into as they come.
        start
            A run with an `output`, or a folder of results, from whose end this run goes on.
        jobs
            Threads for islands that run apart; 0: as many as there are processors.
        progress
            Whether a bar is shown; where left out, on terminals and in notebooks. Or what is called with the share done, 0 to 1.

        Raises
        ------
        odyn.Error
            The scene cannot be run: what is wrong, where, and what to do.
        """
        named = {
            "t_end": t_end,
            "method": method,
            "tolerance": tolerance,
            "fixed_step": fixed_step,
            "output_step": output_step,
            "engine": engine,
            "formulation": formulation,
            "islands": islands,
        }
        moves = in_notebook() if motion is None else motion
        inner = self._with(settings({}, {**named, "motion": True if moves else None}))._inner
        if audit_tolerance is not None:
            if isinstance(audit_tolerance, str) and audit_tolerance != "none":
                raise ValueError("`audit_tolerance` is a number or 'none'")
            inner = inner.audited(None if isinstance(audit_tolerance, str) else float(audit_tolerance))
        temporary = tempfile.TemporaryDirectory(prefix="odyn-") if moves and output is None else None
        folder = Path(temporary.name) if temporary else Path(output) if output is not None else None
        begin = start.folder if isinstance(start, Run) else Path(start) if start is not None else None
        if isinstance(start, Run) and begin is None:
            raise ValueError("a run goes on from one with an `output`: its state at the end is kept there")
        with Listening(progress) as listen:
            run = Run(inner.run(folder, begin, jobs, listen), folder, temporary)
        run._warn()
        return run

    def simulation(self) -> Simulation:
        """The scene at its start, to be stepped from outside."""
        return Simulation(_odyn.Simulation(self._inner))

    def system(self) -> System:
        """The equations of motion as a function of time and state, for integrators such as those of SciPy.

        Raises
        ------
        odyn.Error
            They are none, because of contacts, friction that sticks, or elements with a memory.
        """
        # Implicit methods want derivatives: with one of them these are prepared.
        return System(_odyn.System(self._with(settings({}, {"method": "radau5"}))._inner))

    def __reduce__(self) -> tuple[Any, ...]:
        path = None if self._place else self.path
        # Elements go along as they are; their files are of this process.
        own = set(map(file_of, self._elements))
        plugins = [one for one in self._inner.plugins if one not in own]
        return (_model_of, (path, self.text, plugins, list(self.overrides), self._elements))

    def __repr__(self) -> str:
        changes = f" with {', '.join(self.overrides)}" if self.overrides else ""
        return f"<odyn.Model {self.path.name}{changes}>"


def _model_of(
    path: Path | None, text: str, plugins: list[Path], overrides: list[str], elements: tuple[str, ...] = ()
) -> Model:
    """A model that was pickled: by its text, whatever has become of its file, or where that is not."""
    plugins = [*plugins, *map(file_of, elements)]
    if path is None:
        model = load(text=text, plugins=plugins)
    elif path.is_file() and path.read_text(encoding="utf-8") == text:
        model = load(path, plugins=plugins)
    else:
        model = load(text=text, folder=path.parent, plugins=plugins)
    model._elements = elements
    return model._with(overrides)
