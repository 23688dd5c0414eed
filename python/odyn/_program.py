"""The program `odyn` that came with the package."""

from __future__ import annotations

import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "bin" / ("odyn.exe" if sys.platform == "win32" else "odyn")
"""Where it is; the libraries of elements are beside it."""


def main() -> None:
    """Runs it in place of this process."""
    arguments = [str(PROGRAM), *sys.argv[1:]]
    if sys.platform == "win32":
        import subprocess

        sys.exit(subprocess.run(arguments, check=False).returncode)
    os.execv(arguments[0], arguments)
