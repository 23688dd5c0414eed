"""Errors and warnings: what is wrong, where, and what to do about it."""

from __future__ import annotations

from typing import NamedTuple


class Place(NamedTuple):
    """A place in a scene, as an editor counts it."""

    file: str
    """The file as it was named; `command line` for what was set."""
    line: int
    """From 1."""
    column: int
    """In characters, from 1."""

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


class Diagnostic(NamedTuple):
    """One message. `odyn explain CODE` says more about its code."""

    code: str
    """Stable, such as `ODY0102`."""
    severity: str
    """`error`, `warning` or `note`."""
    message: str
    """One sentence."""
    place: Place | None
    """Where the culprit is written."""
    remedy: str
    """What to do, one line each; may be empty."""

    def __str__(self) -> str:
        place = f" ({self.place})" if self.place else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{self.severity}[{self.code}]: {self.message}{place}{remedy}"


class Error(Exception):
    """Why there is no result. Its text is what the program `odyn` prints.

    What it says of its first error is in `code`, `message`, `place` and `remedy`; `diagnostics` has everything that was found.
    """

    def __init__(self, text: str, diagnostics: tuple[Diagnostic, ...] = (), exit_code: int = 1) -> None:
        super().__init__(text, diagnostics, exit_code)
        self.diagnostics: tuple[Diagnostic, ...] = diagnostics
        """Everything that was found, in its order."""
        self.exit_code: int = exit_code
        """What the program `odyn` would exit with."""

    @property
    def first(self) -> Diagnostic | None:
        """The first error."""
        errors = [one for one in self.diagnostics if one.severity == "error"]
        return next(iter(errors or self.diagnostics), None)

    @property
    def code(self) -> str:
        """Its code, such as `ODY0102`; empty where there is none."""
        return self.first.code if self.first else ""

    @property
    def message(self) -> str:
        """What is wrong, in one sentence."""
        return self.first.message if self.first else str(self)

    @property
    def place(self) -> Place | None:
        """Where that is written."""
        return self.first.place if self.first else None

    @property
    def remedy(self) -> str:
        """What to do about it, one line each; may be empty."""
        return self.first.remedy if self.first else ""

    def __str__(self) -> str:
        return str(self.args[0])


class UnknownName(Error, KeyError):
    """There is no input or output of this name: as mappings say it, too."""


class RunWarning(UserWarning):
    """A run that is not to be taken as it is: suspect, stopped early, or with a check that failed."""


Parts = tuple[str, str, str, "str | None", "int | None", "int | None", "list[str]"]


def diagnostics_of(all_parts: list[Parts]) -> tuple[Diagnostic, ...]:
    """Diagnostics of what the compiled part gives."""

    def one(parts: Parts) -> Diagnostic:
        code, severity, message, file, line, column, remedy = parts
        place = None if file is None or line is None or column is None else Place(file, line, column)
        return Diagnostic(code, severity, message, place, "\n".join(remedy))

    return tuple(one(parts) for parts in all_parts)


def error_of(text: str, parts: list[Parts], exit_code: int) -> Error:
    """The error of what the compiled part gives."""
    return Error(text, diagnostics_of(parts), exit_code)
