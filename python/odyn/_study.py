"""Studies: a scene run with many values. The program of the package does the runs, so that a worker's memory is that of one run."""

from __future__ import annotations

import csv
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from ._elements import file_of
from ._errors import Diagnostic, Error
from ._program import PROGRAM
from ._values import Value, text_of

if TYPE_CHECKING:
    import pandas

    from ._model import Model

TABLE = "study.csv"


class Client(Protocol):
    """What is needed of a Dask client."""

    def map(self, func: Callable[..., Any], *iterables: Iterable[Any], **kwargs: Any) -> Any: ...
    def gather(self, futures: Any) -> Any: ...


def grid(values: Mapping[str, Iterable[Value]]) -> list[dict[str, Value]]:
    """Every combination of values of several keys, the last key changing fastest."""
    import itertools

    return [dict(zip(values, one, strict=True)) for one in itertools.product(*values.values())]


class Study:
    """The table of a study: a row per run, with values, status, figures, last values of the outputs, audit and work."""

    def __init__(self, folder: Path) -> None:
        self.folder: Path = folder
        """Where its files are."""
        with self.path.open(newline="", encoding="utf-8") as file:
            self.columns, *self.rows = list(csv.reader(file))

    @property
    def path(self) -> Path:
        """The table, the same bytes however many jobs and shards there were."""
        return self.folder / TABLE

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> list[str]:
        """A column as it is written."""
        place = self.columns.index(column)
        return [row[place] for row in self.rows]

    def to_pandas(self) -> pandas.DataFrame:
        """As a frame; cells without a number are NaN."""
        import pandas

        return pandas.read_csv(self.path)

    def to_parquet(self, path: str | PathLike[str]) -> Path:
        """Writes it as a Parquet file, by pyarrow."""
        import pyarrow.csv
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.csv.read_csv(self.path), path)
        return Path(path)

    def __repr__(self) -> str:
        return f"<odyn.Study of {len(self)} runs in {self.folder}>"


def _text(value: Value) -> str:
    text = text_of(value)
    if not text.strip():
        raise ValueError("a value of the points is empty")
    return text


def _points(points: Any) -> tuple[list[str], list[list[str]]]:
    if hasattr(points, "to_dict") and hasattr(points, "columns"):
        points = points.to_dict("list")
    if isinstance(points, Mapping):
        keys = [str(key) for key in points]
        return keys, [[_text(value) for value in row] for row in zip(*points.values(), strict=True)]
    rows: Sequence[Mapping[str, Value]] = list(points)
    keys = list(rows[0]) if rows else []
    if any(list(row) != keys for row in rows):
        raise ValueError("all points have the same keys in the same order")
    return keys, [[_text(value) for value in row.values()] for row in rows]


def _state(table: Path | None) -> tuple[int, int] | None:
    """What tells a table from the one that takes its place."""
    if table is None or not table.is_file():
        return None
    state = table.stat()
    return state.st_ino, state.st_mtime_ns


def _odyn(arguments: Sequence[str], table: Path | None = None) -> None:
    """Runs the program. A row that failed makes it fail, too; the study has not if there is a new table."""
    before = _state(table)
    done = subprocess.run([str(PROGRAM), *arguments], capture_output=True, text=True, check=False)
    if done.returncode == 130:
        raise KeyboardInterrupt
    if done.returncode == 0 or _state(table) not in (None, before):
        return
    text = done.stderr.strip() or f"the program ended with the code {done.returncode}"
    first = text.splitlines()[0]
    code = first.partition("[")[2].partition("]")[0] if first.startswith("error[") else ""
    message = first.partition(": ")[2] if code else first
    raise Error(text, (Diagnostic(code, "error", message, None, ""),), done.returncode)


def _shard(number: int, count: int, arguments: Sequence[str]) -> int:
    """Does one shard; what has been done of it before is not done again."""
    _odyn([*arguments, "--shard", f"{number}/{count}", "--resume", "--jobs", "1"])
    return number


def study(
    model: Model,
    points: Any,
    *,
    output: str | PathLike[str],
    jobs: int = 0,
    resume: bool = False,
    retry_failed: bool = False,
    client: Client | None = None,
    shards: int | None = None,
) -> Study:
    """Runs a scene with many values, one run for each point.

    Parameters
    ----------
    points
        Keys with their values: a list of mappings (`odyn.grid` makes one), a mapping of columns, or a pandas frame.
    output
        Folder of the table and of what is kept on the way.
    jobs
        Runs at the same time; 0: as many as there are processors. The table does not depend on it.
    resume
        Whether runs that were finished, or failed, in this folder are taken as they are.
    retry_failed
        Whether those that failed are done again all the same.
    client
        A Dask client, whose workers do shards of the study; scene, libraries and `output` are in folders that all of them see. A
        shard of a worker that dies is done by another one.
    shards
        How many; 64 where left out, or as many as there are points.

    Raises
    ------
    odyn.Error
        No run can be made. A run that fails is reported in its row, and the others stay.
    """
    keys, rows = _points(points)
    if not rows:
        raise ValueError("a study has one point or more")
    if not model.path.is_file() or model.path.read_text(encoding="utf-8") != model.text:
        raise ValueError(f"studies read the scene file, and `{model.path}` is not what was loaded: load it again")
    folder = Path(output).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    sets = [part for one in model.overrides for part in ("--set", one)]
    own = {file_of(text): text for text in model._elements}
    plugins = [one for one in model._inner.plugins if one not in own]
    for element, text in own.items():
        # Where all workers see it.
        plugins.append(folder / "elements" / element.name)
        plugins[-1].parent.mkdir(exist_ok=True)
        plugins[-1].write_text(text, encoding="utf-8", newline="\n")
    libraries = [part for one in plugins for part in ("--plugin", str(one))]
    with tempfile.TemporaryDirectory(prefix="points-", dir=folder) as place:
        table = Path(place) / "points.csv"
        with table.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([keys, *rows])
        arguments = ["study", str(model.path.absolute()), "--csv", str(table), *sets, *libraries, "-q", "-o", str(folder)]
        if client is None:
            number = ["--jobs", str(jobs)] if jobs else []
            retry = ["--retry-failed"] if resume and retry_failed else []
            _odyn([*arguments, *number, *(["--resume"] if resume else []), *retry], folder / TABLE)
        else:
            count = shards or min(64, len(rows))
            # The same points at another path are the same study.
            futures = client.map(_shard, range(1, count + 1), count=count, arguments=arguments, pure=False, retries=4)
            client.gather(futures)
            _odyn(["study", "merge", str(folder), "-q"], folder / TABLE)
    return Study(folder)
