"""Progress of what takes long."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

Progress = bool | Callable[[float], object] | None
"""`True`: a bar on standard error; `None`: the same where somebody sees it; or what is called with the share done, 0 to 1."""

_PATIENCE = 0.3
_WIDTH = 40


class _Bar:
    """A bar on standard error, once the work has taken a while."""

    def __init__(self) -> None:
        self._begin = time.monotonic()
        self._shown = False

    def __call__(self, share: float) -> None:
        if time.monotonic() - self._begin < _PATIENCE:
            return
        self._shown = True
        done = round(_WIDTH * min(max(share, 0.0), 1.0))
        print(f"\r|{'#' * done}{'.' * (_WIDTH - done)}| {100 * share:3.0f} %", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._shown:
            print(f"\r{' ' * (_WIDTH + 8)}\r", end="", file=sys.stderr, flush=True)


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    return "ipykernel" in sys.modules and "IPython" in sys.modules


class Listening:
    """Gives what is to be called with the share done, and takes the bar away at the end."""

    def __init__(self, progress: Progress) -> None:
        self._bar: _Bar | None = None
        seen = sys.stderr is not None and (sys.stderr.isatty() or in_notebook())
        if callable(progress):
            self._call: Callable[[float], object] | None = progress
        elif progress or (progress is None and seen):
            self._call = self._bar = _Bar()
        else:
            self._call = None

    def __enter__(self) -> Callable[[float], object] | None:
        return self._call

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.close()
