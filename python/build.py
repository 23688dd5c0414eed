#!/usr/bin/env python3
"""Builds the wheel: `pip install maturin && python python/build.py`. It is in `python/dist` then.

The program `odyn` and the libraries of elements are built by cargo and put into the package (`odyn/bin`, not kept in the
repository), then maturin builds the rest and packs all. `--profile dev` shares the build of `cargo build`.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LIBRARIES = ["joints", "forces", "controls", "compressor"]


def run(*command: str | Path, **options: object) -> str:
    """Runs a command in the folder of the repository; gives what it prints on standard output, if that is asked for."""
    done = subprocess.run([str(part) for part in command], cwd=HERE.parent, check=True, text=True, **options)  # type: ignore[call-overload]
    return str(done.stdout)


def built(profile: str) -> list[Path]:
    """The program and the libraries, built."""
    # All default members: others would have other features, and be built again.
    run("cargo", "build", "--locked", "--profile", profile)
    metadata = run("cargo", "metadata", "--format-version", "1", "--no-deps", "--locked", stdout=subprocess.PIPE)
    folder = Path(json.loads(metadata)["target_directory"]) / ("debug" if profile == "dev" else profile)
    windows, mac = sys.platform == "win32", sys.platform == "darwin"
    before, behind = ("", ".dll") if windows else ("lib", ".dylib" if mac else ".so")
    return [folder / ("odyn.exe" if windows else "odyn"), *(folder / f"{before}odyn_{name}{behind}" for name in LIBRARIES)]


def main() -> None:
    """Does all of it."""
    parser = argparse.ArgumentParser(description="Builds the wheel of O-DYN.")
    parser.add_argument("--profile", default="release", help="profile of cargo (default: release)")
    parser.add_argument("--out", type=Path, default=HERE / "dist", help="folder of the wheel (default: python/dist)")
    arguments = parser.parse_args()
    inside = HERE / "odyn" / "bin"
    shutil.rmtree(inside, ignore_errors=True)
    inside.mkdir()
    for file in built(arguments.profile):
        shutil.copy2(file, inside)
        if shutil.which("strip") and sys.platform == "linux":
            run("strip", "--strip-unneeded", inside / file.name)
    # The oldest interpreter that is supported names what the compiled part may use, whichever runs this.
    os.environ.setdefault("PYO3_PYTHON", sys.executable)
    build = ["build", "--locked", "--profile", arguments.profile, "--out", arguments.out.resolve()]
    run(sys.executable, "-m", "maturin", *build, "--manifest-path", HERE / "Cargo.toml")


if __name__ == "__main__":
    main()
