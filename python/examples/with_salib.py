"""Which of the two measures the shaking force depends on: first and total order indices by Saltelli's method with SALib."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy
import shaking
from SALib.analyze import sobol as indices
from SALib.sample import sobol as points


def influence(count: int = 64, jobs: int = 2) -> dict[str, numpy.ndarray]:
    """`S1` and `ST` by key; `count` is a power of two, of which 4 times as many runs are made."""
    model = shaking.compressor()
    problem = {"num_vars": 2, "names": list(shaking.KEYS), "bounds": [list(one) for one in shaking.BOUNDS]}
    samples = points.sample(problem, count, calc_second_order=False, seed=1)
    # Runs give up the lock of the interpreter: threads are enough.
    with ThreadPoolExecutor(jobs) as pool:
        values = numpy.array(list(pool.map(lambda x: shaking.shaking(model, x), samples)))
    return indices.analyze(problem, values, calc_second_order=False, seed=1)


if __name__ == "__main__":
    found = influence()
    for key, first, total in zip(shaking.KEYS, found["S1"], found["ST"], strict=True):
        print(f"{key}: by itself {first:.3f}, in all {total:.3f} of the variance")
