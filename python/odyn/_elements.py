"""Joints, forces and control elements written as classes in Python."""

from __future__ import annotations

import hashlib
import json
import re
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._recorder import Recorder
from ._specs import Spec
from ._tracing import refuse

ENDING = ".odyn-element"
CONTRACT = "1.2.0"
"""The version of the contract of elements whose words are written here."""

class Element:
    """A joint, force or control element, recorded. `odyn.load(scene, elements=[Rod])` lets a scene use it, `save` lets all."""

    def __init__(self, kind: str, name: str, package: str, text: str, specs: Mapping[str, Spec], own: type) -> None:
        self.kind: str = kind
        """`joint`, `force` or `control`."""
        self.name: str = name
        """The word in scenes: `type = "rod"`."""
        self._package = package
        self._body = text
        self._specs = specs
        self.own: type = own
        """The class as it was written."""
        self.__doc__ = own.__doc__

    @property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """What scenes give: unit, default, range and text of each."""
        return {name: dict(spec.fields) for name, spec in self._specs.items() if spec.kind == "param"}

    @property
    def text(self) -> str:
        """The file that `save` writes, with the standard package, version and text."""
        return _file([self], self._package, "0.1.0", "")

    def save(
        self, path: str | PathLike[str], *, package: str | None = None, version: str = "0.1.0", about: str = ""
    ) -> Path:
        """Writes it as a file of elements, `*.odyn-element`: see `odyn.save`."""
        return save(path, [self], package=package, version=version, about=about)

    def __repr__(self) -> str:
        return f"<odyn {self.kind} {self.name!r}: {', '.join(self.parameters) or 'no parameters'}>"


class _OfElement(type):
    """What `Recorded` says to type checkers."""

    if TYPE_CHECKING:
        kind: str
        name: str
        parameters: dict[str, dict[str, Any]]
        text: str

        def save(
            cls, path: str | PathLike[str], *, package: str | None = None, version: str = "0.1.0", about: str = ""
        ) -> Path:
            """As `Element.save`."""


class Recorded(metaclass=_OfElement):
    """Tells type checkers that a class has become an `Element`: mypy takes no notice of what decorators make of classes.

        @odyn.joint(frames=["i", "j"])
        class Rod(odyn.Recorded):
            ...

        Rod.save("rod.odyn-element")

    Nothing else depends on it.
    """


def recorded(elements: Iterable[Element | type]) -> list[Element]:
    """Elements; to type checkers a class that was made one by a decorator is still a class."""
    found = list(elements)
    for one in found:
        if not isinstance(one, Element):
            raise TypeError(f"{one!r} is no element: decorate its class with @odyn.joint, @odyn.force or @odyn.control")
    return [one for one in found if isinstance(one, Element)]


_FOLDER: list[tempfile.TemporaryDirectory[str]] = []


def file_of(text: str) -> Path:
    """A file of this process with the text of an element; the host reads elements from files."""
    if not _FOLDER:
        _FOLDER.append(tempfile.TemporaryDirectory(prefix="odyn-elements-"))
    name = re.search(r'^package = "([A-Za-z0-9_-]+)"$', text, re.MULTILINE)
    folder = Path(_FOLDER[0].name) / hashlib.sha256(text.encode()).hexdigest()[:16]
    path = folder / f"{name.group(1) if name else 'element'}{ENDING}"
    if not path.is_file():
        folder.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
    return path


def save(
    path: str | PathLike[str],
    elements: Iterable[Element | type],
    *,
    package: str | None = None,
    version: str = "0.1.0",
    about: str = "",
) -> Path:
    """Writes elements as one file, which scenes load like any library, also where there is no Python.

    A scene finds it by its name in `[plugins] libraries`, or by its path; `odyn elements`, `odyn plugin check` and pins by version
    and SHA-256 take it as they take libraries.

    Parameters
    ----------
    path
        A file that ends with `.odyn-element`, or a folder, in which it is called after the package.
    package
        The name before the slash in `rod/rod`; if left out, that of the file.
    version
        Three numbers: `1.2.0`.
    about
        One sentence for `odyn plugin list`.
    """
    place = Path(path)
    all_elements = recorded(elements)
    if place.is_dir():
        place = place / f"{package or all_elements[0]._package}{ENDING}"
    if not place.name.endswith(ENDING):
        raise ValueError(f"a file of elements ends with `{ENDING}`: {place.name.partition('.')[0]}{ENDING}")
    name = package or place.name.removesuffix(ENDING)
    place.write_text(_file(all_elements, name, version, about), encoding="utf-8", newline="\n")
    return place


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def _value(value: Any) -> str:
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return repr(float(value))


def _inline(fields: Mapping[str, Any]) -> str:
    return f"{{ {', '.join(f'{key} = {_value(value)}' for key, value in fields.items() if value != '')} }}"


def _file(elements: Sequence[Element], package: str, version: str, about: str) -> str:
    if not elements or not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", package):
        raise ValueError("a file has at least one element, and a package of letters, digits, `-` and `_`")
    if not re.fullmatch(r"\d+\.\d+\.\d+(-[0-9A-Za-z.-]+)?", version):
        raise ValueError(f"a version has three numbers, such as 1.2.0, not `{version}`")
    head = f'odyn-element = 1\ncontract = "{CONTRACT}"\nconventions = 1\n'
    head += f"package = {_quoted(package)}\nversion = {_quoted(version)}\nabout = {_quoted(about)}\n"
    return head + "".join(element._body for element in elements)


def _described(kind: str, name: str, own: type, frames: Mapping[str, str], named: Mapping[str, Any]) -> list[str]:
    """The table `[element.description]`."""
    # Not needed to import the package, and slow to load.
    from inspect import cleandoc

    page = cleandoc(own.__doc__ or "").split("\n", 1)
    lines = ["", "[[element]]", "[element.description]", f"name = {_quoted(name)}", f'kind = "{kind}"']
    lines += [f"summary = {_quoted(page[0].rstrip('.') or name)}"]
    if len(page) > 1:
        lines += [f"doc = {_quoted(page[1].strip())}"]
    lines += [f"{key} = {value}" for key, value in named.items() if value]
    if frames:
        lines += ["frames = [", *(f"    {_inline({'name': one, 'doc': doc})}," for one, doc in frames.items()), "]"]
    return lines


def _element(
    kind: str,
    own: type,
    name: str | None,
    frames: Sequence[str] | Mapping[str, str],
    joints: Sequence[str] | Mapping[str, str],
    mobility: int | None,
    turns_freely: bool,
    glyph: str,
    exempt: Mapping[str, str],
    catalog: str = "",
) -> Element:
    word = name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", own.__name__).lower().replace("_", "-")
    if not re.fullmatch(r"[a-z][a-z0-9-]*", word):
        refuse("ODY0832", f"`{word}` cannot be the name of an element: a-z, 0-9 and `-`", "@odyn.joint(name='rod', ...)")
    ends = dict(frames) if isinstance(frames, Mapping) else dict.fromkeys(frames, "")
    others = dict(joints) if isinstance(joints, Mapping) else dict.fromkeys(joints, "")
    recorder = Recorder(kind, own, ends, list(others), mobility)
    rows = recorder.record()
    others_have = {"joint": ["checks", "flexible"], "force": ["coordinates"], "control": ["coordinates", "flexible"]}
    if bad := [key for wrong in others_have[kind] for key in recorder.of(wrong)]:
        refuse("ODY0832", f"`{own.__name__}.{bad[0]}` is not what a {kind} has", "joints have coordinates, the others checks, forces flexible coordinates")

    def named(kind: str) -> str:
        specs = {**recorder.specs, **recorder.functions}
        entries = [_inline({"name": key, **spec.fields}) for key, spec in specs.items() if spec.kind == kind]
        return f"[{', '.join(entries)}]" if entries else ""

    def states() -> str:
        specs = recorder.specs
        own = [(key, specs[key].fields) for key in recorder.of("flexible")]
        bent = [{"name": key, "unit": one["unit"], "doc": one["doc"]} for key, one in own]
        bent += [
            {"name": f"{key}_rate", "unit": f"{one['unit']}/s" if one["unit"] else "1/s", "doc": f"rate of {key}"} for key, one in own
        ]
        plain = [{"name": key, **specs[key].fields} for key in recorder.of("states")]
        return f"[{', '.join(map(_inline, bent + plain))}]" if bent or plain else ""

    joint = kind == "joint"
    fields = {
        "glyph": _quoted(glyph) if glyph else "",
        "angles": str(len(recorder.at._angles) or ""),
        "mobility": "" if mobility is None else str(mobility),
        "turns_freely": "true" if turns_freely else "",
        "rows": f"[{', '.join(map(_quoted, rows))}]" if rows else "",
        "channels": named("coordinates" if joint else "channels"),
        "values": named("channels") if joint else "",
        "checks": named("checks"),
        "states": states(),
        "inputs": named("inputs"),
        "unknowns": named("unknowns"),
        "joints": f"[{', '.join(_inline({'name': one, 'doc': doc}) for one, doc in others.items())}]" if others else "",
        "catalog": _quoted(catalog) if catalog else "",
        "exempt": f"[{', '.join(_value([check, reason]) for check, reason in exempt.items())}]" if exempt else "",
    }
    lines = _described(kind, word, own, ends, fields)
    for key, spec in recorder.specs.items():
        if spec.kind == "param":
            lines += ["", "[[element.description.params]]", f"name = {_quoted(key)}"]
            lines += [f"{field} = {_value(value)}" for field, value in spec.fields.items()]
    lines += ["", "[element.recording]"]
    if recorder.tape.tables:
        lines += ["tables = [", *(f"    {table}," for table in recorder.tape.tables), "]"]
    lines += ["equations = '''", *recorder.lines(), "'''", ""]
    return Element(kind, word, word, "\n".join(lines), recorder.specs, own)


Frames = Sequence[str] | Mapping[str, str]


def joint(
    *,
    frames: Frames = ("i", "j"),
    name: str | None = None,
    mobility: int | None = None,
    turns_freely: bool = False,
    glyph: str = "",
    exempt: Mapping[str, str] = {},
    catalog: str = "",
) -> Callable[[type], Element]:
    """Makes a joint of a class with a function `residual(self, at)`, which gives what is zero while the joint holds.

        @odyn.joint(frames=["i", "j"])
        class Rod:
            \"\"\"Two points keep their distance.\"\"\"

            length = odyn.param("m", above=0)

            def residual(self, at):
                return {"distance": odyn.length(at[1].position - at[0].position) - self.length}

    The function is called once. What it computes is recorded; Jacobian, acceleration terms and reactions follow from exact
    derivatives, and a run costs what it does with the same joint in Rust. Rows are in m or rad-like units, as a list or by name.

    Further functions, all with `self` and mostly `at`: those marked `odyn.coordinate` and `odyn.channel`; `velocity_residual(at)`;
    `rates(at)` of states, `next_memory(at)`, `sample_period()`; `conditions(at)` on unknowns; `unilateral()` (rows that only push, with
    their coefficients of restitution), `sticks_with()`, `limit(at)`, `slides_with()`, each by rows; `pose(q)` with `mobility`.
    They mean what the contract says of them in Rust.

    Parameters
    ----------
    frames
        Names of the frames it connects, in the order of `bodies` in a scene; with what they mean, as a mapping.
    name
        The word in scenes; if left out, that of the class: `SpringDamper` is `spring-damper`.
    mobility, turns_freely
        Number of joint coordinates of `pose(q)`, which gives the position of frame 1 in frame 0 (m) and the three rows of its rotation;
        and whether frame 1 turns freely on top of that.
    glyph
        How pictures show it, such as `hinge` or `rod`.
    exempt
        Checks of `odyn plugin check` that do not apply, with reasons.
    catalog
        Recommended parameters as a table in CSV: in its first line a title and then parameters with units, `rate [N/mm]`; a scene takes
        a row by the word in its first column, `params = { use = "soft" }`.

    Raises
    ------
    odyn.TraceError
        The class cannot be recorded: ODY0831 (a traced value used as a number), ODY0832.
    """
    return lambda own: _element("joint", own, name, frames, (), mobility, turns_freely, glyph, exempt, catalog)


def force(
    *,
    frames: Frames = ("i", "j"),
    name: str | None = None,
    joints: Frames = (),
    glyph: str = "",
    exempt: Mapping[str, str] = {},
    catalog: str = "",
) -> Callable[[type], Element]:
    """Makes a force element of a class with a function `wrench(self, at, out)`, which gives `out` forces and torques.

        @odyn.force(frames=["i", "j"])
        class Spring:
            \"\"\"A spring that stiffens.\"\"\"

            stiffness = odyn.param("N/m", min=0)
            cubic = odyn.param("N/m^3", default=0)

            def wrench(self, at, out):
                d = at[1].position - at[0].position
                pull = d * (self.stiffness + self.cubic * d.dot(d))
                out.force(0, pull)
                out.force(1, -pull)

    Further functions: those marked `odyn.channel` and `odyn.check`; `potential(at)`, J, and `dissipation(at)`, W; `kinetic(at)`, J, of mass
    that it brings; `rates(at)`, `next_memory(at)`, `sample_period()`, `conditions(at)`; `flexible_forces(at)` of
    coordinates `odyn.flexible`. `joints` names joints whose reactions it takes:
    `at.reaction("slider")`. All else as for `odyn.joint`.

    Raises
    ------
    odyn.TraceError
        The class cannot be recorded.
    """
    return lambda own: _element("force", own, name, frames, joints, None, False, glyph, exempt, catalog)


def control(
    *, frames: Frames = (), name: str | None = None, exempt: Mapping[str, str] = {}, catalog: str = ""
) -> Callable[[type], Element]:
    """Makes a control element of a class: `odyn.signal` in, functions marked `odyn.channel` out, `rates` and `next_memory` in between.

    Raises
    ------
    odyn.TraceError
        The class cannot be recorded.
    """
    return lambda own: _element("control", own, name, frames, (), None, False, "", exempt, catalog)
