"""Tables that are given: as files, or as columns that are written to one."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

Table = Any
"""A CSV file; a mapping of names (with units, `crank.angle [deg]`) to columns, with the times as `t`; a pandas frame, whose index
counts as `t` where no column does, and whose `attrs["units"]` count, as those of a run do; a run."""


def _columns(table: Any) -> dict[str, list[float]]:
    from ._run import Run

    if isinstance(table, Run):
        units = {name: f" [{unit}]" if unit else "" for name, unit in table.units.items()}
        return {f"{name}{units[name]}": table[name].tolist() if name != "t" else table.t.tolist() for name in ("t", *table)}
    if hasattr(table, "columns") and hasattr(table, "index"):
        known = getattr(table, "attrs", {}).get("units", {})

        def title(name: str) -> str:
            return f"{name} [{known[name]}]" if known.get(name) else name

        own = {title(str(name)): [float(one) for one in table[name]] for name in table.columns}
        has_times = any(name.split("[")[0].strip() in ("t", "time") for name in own)
        return own if has_times else {title("t"): [float(one) for one in table.index], **own}
    return {str(name): [float(one) for one in values] for name, values in table.items()}


@contextmanager
def file_of(table: Table | None) -> Iterator[Path | None]:
    """The file of a table, for as long as it is needed."""
    if table is None or isinstance(table, (str, PathLike)):
        yield None if table is None else Path(table)
        return
    if not isinstance(table, Mapping) and not hasattr(table, "columns"):
        raise TypeError("give a CSV file, a mapping of columns, a pandas frame or a run")
    columns = _columns(table)
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise ValueError(f"columns have one length, not {sorted(lengths)}")
    with tempfile.TemporaryDirectory(prefix="odyn-") as folder:
        path = Path(folder) / "table.csv"
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            # The shortest text that gives the same number again.
            writer.writerows([repr(value) for value in row] for row in zip(*columns.values(), strict=True))
        yield path
