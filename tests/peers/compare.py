#!/usr/bin/env python3
"""Measures our program, MuJoCo, Exudyn and the mechanisms by hand, one after the other on this machine, and draws the curves anew:

    pip install -r tests/peers/requirements.txt
    python3 tests/peers/compare.py            # tables and drawings in results/bench
    python3 tests/peers/compare.py --draw     # docs/book/src/work-precision.svg as well

Takes some minutes; the machine should do nothing else.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results"
SCENES = ("A01", "A02_N2", "A03", "A04", "A05", "chain_N10", "compressor")


def run(command, output=None):
    print("+", *command, file=sys.stderr)
    with open(output, "w") if output else open("/dev/stdout", "w") as out:
        subprocess.run(command, cwd=ROOT, stdout=out, check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draw", action="store_true", help="write the drawing of README and book anew")
    draw = parser.parse_args().draw
    RESULTS.mkdir(exist_ok=True)
    run(["cargo", "build", "--release"])
    limit = ["cargo", "run", "--release", "--quiet", "-p", "odyn-tests", "--example", "limit"]
    run(limit, RESULTS / "limit.csv")
    for name in ("mujoco", "exudyn"):
        run([sys.executable, f"tests/peers/{name}_bench.py"], RESULTS / f"{name}.csv")
    scenes = [f"scenes/benchmarks/{name}.toml" for name in SCENES]
    peers = [word for name in ("mujoco", "exudyn", "limit") for word in ("--peers", f"results/{name}.csv")]
    run(["target/release/odyn", "bench", *scenes, "--methods", "dop853,radau5,auto", *peers, "-o", "results/bench"])
    if draw:
        shutil.copy(RESULTS / "bench" / "A03.svg", ROOT / "docs" / "book" / "src" / "work-precision.svg")


if __name__ == "__main__":
    main()
