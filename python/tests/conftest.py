"""What the tests share: scenes of the repository, and the program that came with the package."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import odyn
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def compressor() -> odyn.Model:
    return odyn.load(ROOT / "scenes" / "compressor.toml")


@pytest.fixture(scope="session")
def program():
    """Runs the program `odyn` as its script does; gives its exit code, output and errors."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        script = [sys.executable, "-c", "import odyn._program; odyn._program.main()"]
        return subprocess.run([*script, *map(str, arguments)], capture_output=True, text=True, check=False)

    return run


PENDULUM = """
title = "A pendulum that is driven"
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 2
output_step = 0.01
[[body]]
name = "rod"
mass = 2
inertia = [0.1, 0.1, 0.1]
position = [0.5, 0, 0]
[[joint]]
name = "pin"
type = "revolute"
bodies = ["ground", "rod"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[input]]
name = "motor"
unit = "N m"
value = 0.5
[[force]]
name = "drive"
type = "vector-torque"
bodies = ["ground", "rod"]
point = [0, 0, 0]
inputs = { z = "motor" }
[[output]]
name = "angle"
quantity = "coordinate"
of = "pin"
channel = "angle"
[[output]]
name = "omega"
quantity = "coordinate_rate"
of = "pin"
channel = "angle"
"""
