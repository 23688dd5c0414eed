#!/usr/bin/env python3
"""Runs MuJoCo on A01, A02 (N = 2), A04 and the chain of 10, at several step sizes:

    pip install mujoco
    python3 bench/peers/mujoco_bench.py > mujoco.csv
    odyn bench --peers mujoco.csv

MuJoCo has joint coordinates, so A01 and the chain are plain differential equations; the loops of A02 and A04 are closed by its
`connect` constraints, which are springs as stiff as the step allows. Only the integration is timed, without the samples.
"""

import mujoco

from common import clock, measure, reference, steps_per_sample, write

HEAD = """<mujoco><compiler angle="radian" boundmass="0" boundinertia="0"/>
<option gravity="0 -9.81 0" timestep="{step}" integrator="{method}" tolerance="1e-15" iterations="100">
<flag contact="disable"/></option>
<default><equality solref="{stiff} 1" solimp="0.9999 0.9999 0.001"/></default><worldbody>"""


def inertial(at, mass, moments):
    return f'<inertial pos="{at}" mass="{mass!r}" diaginertia="{moments[0]!r} {moments[1]!r} {moments[2]!r}"/>'


def hinge(axis):
    return f'<joint type="hinge" axis="{axis}" pos="0 0 0"/>'


def pendulum():
    body = '<body pos="0 0 0">' + hinge("0 0 1") + inertial("-1 0 0", 1.0, [1e-12] * 3)
    return body + '<site name="tip" pos="-1 0 0"/></body></worldbody>', [], ["tip"], 2


def chain(n=10):
    length, mass = 1 / n, 1 / n
    across = mass * length**2 / 12
    text = ""
    for k in range(n):
        text += f'<body pos="{length if k else 0!r} 0 0">' + hinge("0 0 1")
        text += inertial(f"{length / 2!r} 0 0", mass, [across / 100, across, across])
    return text + f'<site name="tip" pos="{length!r} 0 0"/>' + "</body>" * n + "</worldbody>", [], ["tip"], 2


def four_bars(n=2):
    # Links are joined to the ground, couplers to the link at their left; their right ends are connected.
    rod, text, closures = [1 / 1200, 1 / 12, 1 / 12], "", ""
    upright = [rod[1], rod[0], rod[2]]
    for k in range(n + 1):
        text += f'<body name="link{k}" pos="{k} 0 0">' + hinge("0 0 1") + inertial("0 0.5 0", 1.0, upright)
        if k == 0:
            text += '<site name="tip" pos="0 1 0"/>'
        if k < n:
            text += f'<body name="coupler{k + 1}" pos="0 1 0">' + hinge("0 0 1") + inertial("0.5 0 0", 1.0, rod) + "</body>"
            closures += f'<connect body1="coupler{k + 1}" body2="link{k + 1}" anchor="1 0 0"/>'
        text += "</body>"
    # Links turn at -1 rad/s, couplers not at all.
    speeds = [-1.0 if k % 2 == 0 else 1.0 for k in range(2 * n + 1)]
    return text + f"</worldbody><equality>{closures}</equality>", speeds, ["tip"], 2


def bricard():
    points = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
    axes = ["0 1 0", "0 0 1", "1 0 0", "0 1 0", "0 0 1", "1 0 0"]
    along, across = 1 / 600, 1.01 / 12
    text, before = "", (0, 0, 0)
    for k in range(5):
        way = [b - a for a, b in zip(points[k], points[k + 1])]
        pos = [b - a for a, b in zip(before, points[k])]
        text += f'<body name="rod{k + 1}" pos="{pos[0]} {pos[1]} {pos[2]}">' + hinge(axes[k])
        moments = [along if component else across for component in way]
        text += inertial(" ".join(repr(component / 2) for component in way), 1.0, moments)
        if k == 1:
            text += '<site name="tip" pos="0 -1 0"/>'
        before = points[k]
    # A revolute joint along x at P6: two points of its axis stay where they are.
    closures = "".join(f'<connect body1="rod5" anchor="{x} 1 0"/>' for x in (0, 0.5))
    return text + "</body>" * 5 + f"</worldbody><equality>{closures}</equality>", [], ["tip"], 3


STEPS = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
MODELS = {"A01": pendulum, "A02_N2": four_bars, "A04": bricard, "chain_N10": chain}


def runner(problem, method, step):
    body, speeds, sites, components = MODELS[problem]()
    count = steps_per_sample(problem, step)
    times, _ = reference(problem, step)
    exact = (times[1] - times[0]) / count
    head = HEAD.format(step=repr(exact), method=method, stiff=repr(2.001 * exact))
    model = mujoco.MjModel.from_xml_string(head + body + "</mujoco>")

    def run():
        data = mujoco.MjData(model)
        for k, speed in enumerate(speeds):
            data.qvel[k] = speed
        samples, seconds = [], 0.0
        for sample in range(len(times)):
            if sample > 0:
                start = clock()
                mujoco.mj_step(model, data, count)
                seconds += clock() - start
            mujoco.mj_kinematics(model, data)
            samples.append([x for site in sites for x in data.site(site).xpos[:components]])
        return samples, seconds, count * (len(times) - 1)

    return run


def main():
    rows = []
    for problem in MODELS:
        for method in ("RK4", "implicitfast"):
            for step in STEPS:
                try:
                    run = runner(problem, method, step)
                except ValueError as reason:
                    message = str(reason)

                    def run(message=message):
                        raise RuntimeError(message)

                rows.append(measure(problem, "mujoco", method, step, run))
    write(rows, f"MuJoCo {mujoco.__version__}")


if __name__ == "__main__":
    main()
