"""Values on their way into scenes and out of reports."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

Value = Any
"""A text such as `"50 mm"`, a number in the unit of the scene, a truth, a sequence or a mapping of these."""


def text_of(value: Value) -> str:
    """A value as it is written behind `--set KEY=`."""
    return value if isinstance(value, str) else _inner(value)


def _inner(value: Value) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{value} is no number of a scene")
        # The shortest text that gives the same number again.
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_inner(one)}" for key, one in value.items()) + " }"
    if hasattr(value, "tolist"):  # arrays and numbers of NumPy
        return _inner(value.tolist())
    if isinstance(value, Sequence):
        return "[" + ", ".join(_inner(one) for one in value) + "]"
    raise TypeError(f"a scene has no values such as {value!r}")


def settings(changes: Mapping[str, Value], named: Mapping[str, Value]) -> list[str]:
    """`KEY=VALUE` texts of changes; settings of `[simulation]` come behind them, where they are given."""
    texts = [f"{key}={text_of(value)}" for key, value in changes.items()]
    return texts + [f"simulation.{key}={text_of(value)}" for key, value in named.items() if value is not None]


def result(text: str) -> dict[str, Any]:
    """JSON of a report with lists of numbers as NumPy arrays; what is no number (`null` among numbers) is NaN there."""
    found = _arrays(json.loads(text))
    assert isinstance(found, dict)
    return found


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _numbers(values: Iterable[object]) -> bool:
    """Whether all are numbers or missing ones, and at least one is a number."""
    values = list(values)
    return any(map(_is_number, values)) and all(value is None or _is_number(value) for value in values)


def _arrays(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _arrays(one) for key, one in value.items()}
    if not isinstance(value, list):
        return value
    import numpy

    if _numbers(value):
        return numpy.array([math.nan if one is None else one for one in value])
    rows = [one for one in value if isinstance(one, list)]
    if rows and len(rows) == len(value) and all(map(_numbers, rows)) and len({len(row) for row in rows}) == 1:
        return numpy.array([[math.nan if one is None else one for one in row] for row in rows])
    return [_arrays(one) for one in value]
