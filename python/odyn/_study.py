"""Studies: a scene run with many values. The program of the package does the runs, so that a worker's memory is that of one run."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from . import _odyn as _compiled
from ._elements import file_of
from ._errors import Diagnostic, Error
from ._program import PROGRAM
from ._values import Value, text_of

if TYPE_CHECKING:
    import pandas
    import pyarrow

    from ._model import Model

TABLE = "study.csv"
SERIES = "series.csv"
BUSY = "another study writes it"
"""What the program says of a shard that is being done."""
TITLE = re.compile(r"(.*?)(?: \[([^\]]+)\])?")
QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s].*?)?\s*")


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

    @property
    def series(self) -> Series:
        """What was kept of every run over time.

        Raises
        ------
        FileNotFoundError
            Nothing was: `odyn.study(..., series=...)`.
        """
        return Series(self.folder / SERIES)

    def to_pandas(self) -> pandas.DataFrame:
        """As a frame with the titles of the file; cells without a number are NaN."""
        return _read_csv(self.path)

    def arrow(self) -> pyarrow.Table:
        """An Arrow table: figures, last values, and keys with numbers of one unit are numbers; `""` and what is none are null.

        Each field has its unit in its metadata, and the schema has all of them as JSON under `units`.
        """
        import pyarrow

        names, units = _names(self.columns)
        # A key may have any name, but these two follow each other behind the keys.
        keys = next(k for k in range(1, len(names)) if self.columns[k : k + 2] == ["status", "problem"])
        kinds = {"run": pyarrow.int64(), "steps": pyarrow.int64(), "evaluations": pyarrow.int64()}
        arrays, fields = [], []
        for k, (name, unit) in enumerate(zip(names, units, strict=True)):
            cells = [row[k] for row in self.rows]
            kind = kinds.get(name, pyarrow.float64())
            if keys <= k < keys + 2:
                kind = pyarrow.string()
            elif 0 < k < keys:
                numbers, unit = _quantities(cells)
                kind = pyarrow.float64() if numbers else pyarrow.string()
                cells = numbers or cells
            convert: Callable[[str], Any] = {pyarrow.int64(): int, pyarrow.float64(): float}.get(kind, str)
            arrays.append(pyarrow.array([convert(cell) if cell else None for cell in cells], kind))
            fields.append(_field(name, kind, unit))
        return pyarrow.Table.from_arrays(arrays, schema=_schema(fields))

    def to_parquet(self, path: str | PathLike[str]) -> Path:
        """Writes it as a Parquet file, by pyarrow, with the types, names and units of `arrow`."""
        import pyarrow.parquet

        pyarrow.parquet.write_table(self.arrow(), path)
        return Path(path)

    def __repr__(self) -> str:
        return f"<odyn.Study of {len(self)} runs in {self.folder}>"


class Series:
    """Outputs of all runs of a study over time: a row for each run and sample. Runs that failed have none."""

    def __init__(self, path: Path) -> None:
        self.path: Path = path
        """The file, the same bytes however many jobs and shards there were."""
        if not path.is_file():
            raise FileNotFoundError(f"{path} is not there: `odyn.study(..., series=[...])` keeps outputs over time")
        with path.open(newline="", encoding="utf-8") as file:
            titles = next(csv.reader(file))
        self.columns, units = _names(titles)
        self.units: dict[str, str] = dict(zip(self.columns, units, strict=True))
        """Of the time, `t`, and of the outputs; empty for pure numbers and the number of the run."""

    def to_pandas(self) -> pandas.DataFrame:
        """All of it as a frame; `attrs["units"]` has the units."""
        frame = _read_csv(self.path, names=self.columns, skiprows=1)
        frame.attrs.update(units=self.units)
        return frame

    def arrow(self) -> pyarrow.Table:
        """All of it as an Arrow table; each field has its unit in its metadata."""
        import pyarrow

        with self._batches() as reader:
            return pyarrow.Table.from_batches(list(reader), schema=reader.schema).cast(self._schema())

    def to_parquet(self, path: str | PathLike[str]) -> Path:
        """Writes it as a Parquet file, by pyarrow, piece by piece: it may be larger than the memory.

        Each field has its unit in its metadata, and the schema has all of them as JSON under `units`.
        """
        import pyarrow
        import pyarrow.parquet

        schema = self._schema()
        with self._batches() as reader, pyarrow.parquet.ParquetWriter(path, schema) as writer:
            for batch in reader:
                writer.write_table(pyarrow.Table.from_batches([batch]).cast(schema))
        return Path(path)

    def _schema(self) -> pyarrow.Schema:
        import pyarrow

        kinds = [pyarrow.int64(), *[pyarrow.float64()] * (len(self.columns) - 1)]
        return _schema([_field(name, kind, self.units[name]) for name, kind in zip(self.columns, kinds, strict=True)])

    def _batches(self) -> Any:
        import pyarrow.csv

        schema = self._schema()
        # A block is a row group; pyarrow reads the next one ahead.
        read = pyarrow.csv.ReadOptions(column_names=self.columns, skip_rows=1, block_size=16 << 20)
        convert = pyarrow.csv.ConvertOptions(column_types={field.name: field.type for field in schema})
        return pyarrow.csv.open_csv(self.path, read_options=read, convert_options=convert)

    def __repr__(self) -> str:
        return f"<odyn.Series of {', '.join(self.columns[2:])} in {self.path}>"


def _read_csv(path: Path, **options: Any) -> pandas.DataFrame:
    """A frame with the bits of the file; pandas reads them from version 3 on."""
    import pandas

    if int(pandas.__version__.partition(".")[0]) < 3:
        options["float_precision"] = "round_trip"
    return pandas.read_csv(path, **options)


def _names(titles: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names and units of columns, `x_p [mm]`; where two have one name, both keep their units in it."""
    parts = [found.groups() if (found := TITLE.fullmatch(title)) else (title, None) for title in titles]
    bare = [str(name) for name, _ in parts]
    names = [name if bare.count(name) == 1 else title for name, title in zip(bare, titles, strict=True)]
    return names, [unit or "" for _, unit in parts]


def _quantities(cells: Sequence[str]) -> tuple[list[str], str]:
    """The numbers of texts such as `40 mm` and their unit, if all have the same; else nothing, as of expressions such as `2 * l`."""
    found = [QUANTITY.fullmatch(cell) for cell in cells]
    units = {one.group(2) or "" if one else None for one in found}
    if len(units) != 1 or None in units:
        return [], ""
    unit = str(units.pop())
    if unit and not _compiled.is_unit(unit):
        return [], ""
    return [one.group(1) for one in found if one], unit


def _field(name: str, kind: Any, unit: str) -> pyarrow.Field:
    import pyarrow

    return pyarrow.field(name, kind, metadata={"unit": unit} if unit else None)


def _schema(fields: Sequence[pyarrow.Field]) -> pyarrow.Schema:
    import pyarrow

    units = {field.name: field.metadata[b"unit"].decode() for field in fields if field.metadata}
    return pyarrow.schema(fields, metadata={"units": json.dumps(units, ensure_ascii=False)})


def merge(folder: str | PathLike[str]) -> Study:
    """One table of the parts that the shards of a study left in a folder, as `odyn study merge` makes it.

    Raises
    ------
    odyn.Error
        Parts are missing, were changed, or are of several studies.
    """
    place = Path(folder).absolute()
    _odyn(["study", "merge", str(place), "-q"], place / TABLE)
    return Study(place)


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
    """Does one shard; what has been done of it before is not done again.

    The program of a worker that was killed continues its shard, or is about to end: it is waited for.
    """
    while True:
        try:
            _odyn([*arguments, "--shard", f"{number}/{count}", "--resume", "--jobs", "1"])
        except Error as error:
            if BUSY not in str(error):
                raise
            time.sleep(0.2)
        else:
            return number


def study(
    model: Model,
    points: Any,
    *,
    output: str | PathLike[str],
    jobs: int = 0,
    resume: bool = False,
    retry_failed: bool = False,
    series: str | Iterable[str] | None = None,
    every: int | None = None,
    samples: int | None = None,
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
    series
        Outputs that are kept of every run over time, in one table: their names, or `"*"` for all of them.
    every
        Of the series, the first sample and every so-manieth from there are kept; if left out, all.
    samples
        Of the series, so many samples are kept, spread evenly from the first to the last.
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
    kept = [] if series is None else [series] if isinstance(series, str) else list(series)
    if not kept and (every is not None or samples is not None):
        raise ValueError("`every` and `samples` are of a series: name its outputs, `series=[...]`")
    over_time = [f"--series={one}" for one in kept]
    over_time += [f"--{name}={one}" for name, one in (("every", every), ("samples", samples)) if one is not None]
    libraries = [part for one in plugins for part in ("--plugin", str(one))]
    with tempfile.TemporaryDirectory(prefix="points-", dir=folder) as place:
        table = Path(place) / "points.csv"
        with table.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([keys, *rows])
        arguments = ["study", str(model.path.absolute()), "--csv", str(table), *sets, *libraries, *over_time]
        arguments += ["-q", "-o", str(folder)]
        if client is None:
            number = ["--jobs", str(jobs)] if jobs else []
            retry = ["--retry-failed"] if resume and retry_failed else []
            _odyn([*arguments, *number, *(["--resume"] if resume else []), *retry], folder / TABLE)
        else:
            count = shards or min(64, len(rows))
            # The same points at another path are the same study.
            futures = client.map(_shard, range(1, count + 1), count=count, arguments=arguments, pure=False, retries=4)
            client.gather(futures)
            return merge(folder)
    return Study(folder)
