"""Calls the functions of a class once, and takes down what they compute."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from ._motion import Loads, Motion
from ._specs import Choice, Flexible, Function, Spec, Surface
from ._tracing import Number, Real, Tape, Vec, number, refuse

FIXED = ["unilateral", "sticks-with", "slides-with", "sample-period", "start", "remember", "guess"]
"""Results that the motion does not change."""


class Recorder:
    """Calls the functions of a class once, and takes down what they compute."""

    def __init__(self, kind: str, own: type, frames: Mapping[str, str], joints: Sequence[str], mobility: int | None) -> None:
        self.kind = kind
        self.own = own
        self.tape = Tape()
        self.mobility = mobility
        self.results: list[tuple[str, Number, str]] = []
        self.specs: dict[str, Spec] = {}
        self.functions: dict[str, Spec] = {}
        for base in reversed(own.__mro__):
            for key, value in vars(base).items():
                self.specs.pop(key, None)
                self.functions.pop(key, None)
                declared = isinstance(value, Spec) or hasattr(value, "_odyn")
                if declared and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", key):
                    refuse("ODY0832", f"`{own.__name__}.{key}` is no name for scenes", "letters a to z, digits and `_`")
                if isinstance(value, Spec):
                    self.specs[key] = value
                elif isinstance(getattr(value, "_odyn", None), Spec):
                    self.functions[key] = value._odyn
        self.at = Motion(self.tape, list(frames), joints)
        self.element: Any = object.__new__(own)
        for key, spec in self.specs.items():
            self.element.__dict__[key] = self._input(key, spec)

    def of(self, kind: str) -> list[str]:
        """Names of what is declared of a kind."""
        return [key for key, spec in {**self.specs, **self.functions}.items() if spec.kind == kind]

    def _input(self, key: str, spec: Spec) -> Any:
        flexible = self.of("flexible")
        if spec.kind == "flexible":
            # The states begin with all q, then all q'.
            place = flexible.index(key)
            rate = self.tape.input(f"state {len(flexible) + place}")
            return Flexible(self.tape, self.tape.input(f"state {place}")._number, rate)
        if spec.kind == "states":
            return self.tape.input(f"state {2 * len(flexible) + self.of('states').index(key)}")
        if spec.kind != "param":
            word = {"memory": "memory", "unknowns": "unknown", "inputs": "signal"}[spec.kind]
            return self.tape.input(f"{word} {self.of(spec.kind).index(key)}")
        match spec.fields["kind"]:
            case "vector":
                return Vec(*(self.tape.input(f"param {key} {k}") for k in range(3)))
            case "function":
                return Function(self.tape, key)
            case "surface":
                return Surface(self.tape, key)
            case "text":
                return Choice(self.tape.input(f"param {key}"), key, spec.fields["choices"])
            case _:
                return self.tape.input(f"param {key}")

    def result(self, words: str, value: Real, remark: str = "") -> None:
        if isinstance(value, (Vec, tuple, list)):
            refuse("ODY0832", f"`{self.own.__name__}` gives {value!r} where one number is needed")
        value = number(value)
        if words.split(" ")[0] in FIXED and not self.tape.is_known(value):
            refuse("ODY0832", f"`{words}` of `{self.own.__name__}` ({remark or 'one number'}) must depend on parameters only")
        self.results.append((words, value, " ".join(remark.split())))

    def call(self, name: str, *arguments: Any) -> Any:
        """What a function of the class gives; `None` where it has none."""
        function = getattr(self.element, name, None)
        return None if function is None else function(*arguments)

    def named(self, name: str, given: Any, declared: Sequence[str], word: str, before: int = 0) -> None:
        """Values by name, or in the order of their declaration."""
        where = f"`{self.own.__name__}.{name}`"
        if given is None and not declared:
            return
        if given is None:
            refuse("ODY0832", f"{where} is missing, or returns nothing", f"it gives {', '.join(declared)}")
        if not isinstance(given, Mapping):
            values = list(given) if isinstance(given, (Sequence, Vec)) else [given]
            if len(values) != len(declared):
                refuse("ODY0832", f"{where} gives {len(values)} values, {len(declared)} are declared: {', '.join(declared)}")
            given = dict(zip(declared, values, strict=True))
        if set(given) != set(declared):
            differ = sorted(set(given) ^ set(declared))
            refuse("ODY0832", f"{where} and the declared names differ: {', '.join(differ)}")
        for k, key in enumerate(declared, before):
            self.result(f"{word} {k}", given[key], key)

    def rows(self, name: str, word: str, before: list[str]) -> list[str]:
        """Rows of a joint: by name, or numbered."""
        given = self.call(name, self.at)
        if given is None:
            return []
        if not isinstance(given, Mapping):
            values = list(given) if isinstance(given, (Sequence, Vec)) else [given]
            given = {f"row {len(before) + k + 1}": value for k, value in enumerate(values)}
        for k, (row, value) in enumerate(given.items()):
            self.result(f"{word} {len(before) + k}", value, row)
        return [str(row) for row in given]

    def by_row(self, name: str, word: str, rows: list[str], *arguments: Any) -> None:
        """What only some rows have: numbers, or the names of other rows."""
        for row, value in (self.call(name, *arguments) or {}).items():
            for one in [row, value] if isinstance(value, str) else [row]:
                if one not in rows:
                    refuse("ODY0832", f"`{self.own.__name__}.{name}` names the row {one!r}", f"the rows are {', '.join(rows)}")
            self.result(f"{word} {rows.index(row)}", rows.index(value) if isinstance(value, str) else value, row)

    def started(self, kind: str, word: str, before: int = 0) -> None:
        for k, key in enumerate(self.of(kind), before):
            self.start(f"{word} {k}", self.specs[key].start, key)

    def start(self, words: str, start: Any, remark: str) -> None:
        self.result(words, start(self.element) if callable(start) else start, remark)

    def flexible(self) -> None:
        """Generalised forces and values at the start of flexible coordinates."""
        own = self.of("flexible")
        self.named("flexible_forces", self.call("flexible_forces", self.at), own, "flexible-force")
        self.started("flexible", "start")
        for k, key in enumerate(own, len(own)):
            self.start(f"start {k}", self.specs[key].fields["start_rate"], f"rate of {key}")
        if own and self.call("kinetic", self.at) is None:
            refuse("ODY0832", f"`{self.own.__name__}` has flexible coordinates and no `kinetic`", "def kinetic(self, at): ...")

    def record(self) -> list[str]:
        """All results; the names of the rows of a joint."""
        at, rows = self.at, list[str]()
        if self.kind == "joint":
            rows = self.rows("residual", "residual", [])
            rows += self.rows("velocity_residual", "velocity-residual", rows)
            self.by_row("unilateral", "unilateral", rows)
            self.by_row("sticks_with", "sticks-with", rows)
            self.by_row("slides_with", "slides-with", rows)
            self.by_row("limit", "limit", rows, at)
            if not rows:
                refuse("ODY0832", f"`{self.own.__name__}` gives no rows", "def residual(self, at): return [...]")
        elif self.kind == "force":
            loads = Loads(at)
            if not hasattr(self.element, "wrench"):
                refuse("ODY0832", f"`{self.own.__name__}` has no `wrench`", "def wrench(self, at, out): out.force(0, f)")
            self.call("wrench", at, loads)
            for (word, frame), load in sorted(loads._sums.items()):
                for k, component in enumerate(load):
                    self.result(f"{word} {3 * frame + k}", component)
        for kind, word in [("coordinates", "coordinate"), ("channels", "channel"), ("checks", "check")]:
            for k, key in enumerate(self.of(kind)):
                self.result(f"{word} {k}", getattr(self.element, key)(at), key)
        for name, kind, word in [
            ("rates", "states", "rate"),
            ("next_memory", "memory", "next"),
            ("conditions", "unknowns", "condition"),
        ]:
            before = 2 * len(self.of("flexible")) if kind == "states" else 0
            self.named(name, self.call(name, at), self.of(kind), word, before)
        for name in ["potential", "dissipation", "kinetic"]:
            value = self.call(name, at)
            if value is not None:
                self.result(name, value)
        period = self.call("sample_period")
        if period is not None:
            self.result("sample-period", period)
        if self.kind == "force":
            self.flexible()
        self.started("states", "start", 2 * len(self.of("flexible")))
        self.started("memory", "remember")
        self.started("unknowns", "guess")
        if self.mobility is not None:
            self.pose(self.mobility)
        for k, angle in enumerate(at._angles):
            self.result(f"angle {k}", angle)
        return rows

    def pose(self, mobility: int) -> None:
        """Pose of the second frame in the first for joint coordinates."""
        given = self.call("pose", [self.tape.input(f"coordinate {k}") for k in range(mobility)])
        if given is None:
            refuse("ODY0832", f"`{self.own.__name__}` has a mobility and no `pose`", "it returns a position and three rows")
        position, rotation = given
        for k, component in enumerate(Vec.of(position)):
            self.result(f"pose-position {k}", component)
        for row, components in enumerate(rotation):
            for column, component in enumerate(Vec.of(components)):
                self.result(f"pose-rotation {3 * row + column}", component)

    def lines(self) -> list[str]:
        """The equations: values that a result needs, numbered anew, then the results."""
        live = [False] * len(self.tape.lines)
        for _, value, _ in self.results:
            if value._number >= 0:
                live[value._number] = True
        for k in range(len(live) - 1, -1, -1):
            for operand in self.tape.lines[k].operands if live[k] else ():
                if operand._number >= 0:
                    live[operand._number] = True
        names: dict[int, str] = {}

        def text(value: Number) -> str:
            return names.get(value._number, value._text)

        lines = []
        for k, line in enumerate(self.tape.lines):
            if live[k]:
                names[k] = f"v{len(names)}"
                words = [line.head, *map(text, line.operands), line.tail]
                lines.append(f"{names[k]} = {' '.join(word for word in words if word)}")
        for left, value, remark in self.results:
            lines.append(f"{left} = {text(value)}" + (f"  # {remark}" if remark else ""))
        return lines
