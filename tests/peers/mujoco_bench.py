#!/usr/bin/env python3
"""Runs MuJoCo on A01, A02 (N = 2), A03, A04, A05 and the chain of 10, at several step sizes:

    pip install mujoco
    python3 tests/peers/mujoco_bench.py > mujoco.csv
    odyn bench --peers mujoco.csv

MuJoCo has joint coordinates, so A01, A05 and the chain are plain differential equations; the loops of A02, A03 and A04 are
closed by its `connect` constraints, which are springs as stiff as the step allows. Only the integration is timed, without the
samples.
"""

import math

import mujoco

from common import begin, clock, measure, reference, steps_per_sample

HEAD = """<mujoco><compiler angle="radian" boundmass="0" boundinertia="0"/>
<option gravity="{gravity}" timestep="{step}" integrator="{method}" tolerance="1e-15" iterations="100">
<flag contact="disable"/></option>
<default><equality solref="{stiff} 1" solimp="0.9999 0.9999 0.001"/></default><worldbody>"""


DOWN = "0 -9.81 0"


class Model:
    """The text after `<worldbody>`, and what it does not tell."""

    def __init__(self, text, sites, components=(0, 1), speeds=(), forces=(), gravity=DOWN):
        self.text, self.sites, self.components = text, sites, components
        self.speeds, self.forces, self.gravity = speeds, forces, gravity


def inertial(at, mass, moments):
    return f'<inertial pos="{at}" mass="{mass!r}" diaginertia="{moments[0]!r} {moments[1]!r} {moments[2]!r}"/>'


def hinge(axis):
    return f'<joint type="hinge" axis="{axis}" pos="0 0 0"/>'


def pendulum():
    body = '<body pos="0 0 0">' + hinge("0 0 1") + inertial("-1 0 0", 1.0, [1e-12] * 3)
    return Model(body + '<site name="tip" pos="-1 0 0"/></body></worldbody>', ["tip"])


def chain(n=10):
    length, mass = 1 / n, 1 / n
    across = mass * length**2 / 12
    text = ""
    for k in range(n):
        text += f'<body pos="{length if k else 0!r} 0 0">' + hinge("0 0 1")
        text += inertial(f"{length / 2!r} 0 0", mass, [across / 100, across, across])
    return Model(text + f'<site name="tip" pos="{length!r} 0 0"/>' + "</body>" * n + "</worldbody>", ["tip"])


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
    return Model(text + f"</worldbody><equality>{closures}</equality>", ["tip"], speeds=speeds)


def squeezer():
    # Two bars each from O, A and A again, and the one on B; the ends of the others are connected to it at E.
    f, e = (0.00698655030921248, -0.00043372200410285764), (-0.02096002256836912, 0.0012951690850118895)
    g, h = (-0.03399720391575101, 0.016461971731432715), (-0.03163313457940229, -0.015618868871665975)
    a, b = (-0.06934, -0.00227), (-0.03635, 0.03273)
    text, closures = '<site name="C" pos="0.014 0.072 0"/>', ""

    def angle(first, second):
        return math.atan2(second[1] - first[1], second[0] - first[0])

    def bar(name, at, turned, mass, moment, com, inner=""):
        head = f'<body name="{name}" pos="{at[0]!r} {at[1]!r} 0" euler="0 0 {turned!r}">' + hinge("0 0 1")
        return head + inertial(f"{com[0]!r} {com[1]!r} 0", mass, [moment] * 3) + inner + "</body>"

    def site(name, x, y=0.0):
        return f'<site name="{name}" pos="{x!r} {y!r} 0"/>'

    def pair(names, points, masses, moments, coms, length, tip):
        turned = [angle(points[0], points[1]), angle(points[1], points[2])]
        outer = bar(names[1], (length, 0.0), turned[1] - turned[0], masses[1], moments[1], coms[1])
        return bar(names[0], points[0], turned[0], masses[0], moments[0], coms[0], site(tip, length) + outer)

    text += pair(["K1", "K2"], [(0.0, 0.0), f, e], [0.04325, 0.00365], [2.194e-6, 4.410e-7],
                 [(0.00092, 0.0), (0.0115, 0.0)], 0.007, "F")
    text += pair(["K5", "K4"], [a, g, e], [0.07050, 0.00706], [1.169e-5, 5.667e-7],
                 [(0.02308, 0.00916), (0.00579, 0.0)], 0.04, "G")
    text += pair(["K7", "K6"], [a, h, e], [0.05498, 0.00706], [1.912e-5, 5.667e-7],
                 [(0.01228, -0.00449), (0.00579, 0.0)], 0.04, "H")
    text += bar("K3", b, angle(b, e), 0.02373, 5.255e-6, (0.01874, 0.01043), site("E", 0.035) + site("D", 0.018, 0.020))
    for name, at in (("K2", 0.028), ("K4", 0.020), ("K6", 0.020)):
        closures += f'<connect body1="{name}" body2="K3" anchor="{at!r} 0 0"/>'
    spring = '<tendon><spatial stiffness="4530" springlength="0.07785"><site site="C"/><site site="D"/></spatial></tendon>'
    text += f"</worldbody>{spring}<equality>{closures}</equality>"
    return Model(text, ["F", "E", "G", "H"], forces=[0.033], gravity="0 0 0")


def governor():
    # Boxes of 0.3 kg with 5 kg at the ends of the rods, which hang from hinges beside the shaft.
    box, tip, alpha, spin, off = 0.3, 5.0, math.radians(30), 2 * math.pi, 0.05
    axial, across = box * 0.01**2 / 6, box * (1 + 0.01**2) / 12
    com = 0.5 * tip / (box + tip)
    rod = across + box * com**2 + tip * (0.5 - com) ** 2
    text = '<body pos="0 0 0">' + hinge("0 0 1") + inertial("0 0 0.5", box, [across, across, axial])
    for k, turned in ((1, 0.0), (2, math.pi)):
        sign = 1 - 2 * (k - 1)
        text += f'<body pos="{sign * off!r} 0 1" euler="0 0 {turned!r}"><body euler="0 {alpha!r} 0">' + hinge("0 1 0")
        text += inertial(f"{0.5 + com!r} 0 0", box + tip, [axial, rod, rod])
        text += f'<site name="middle{k}" pos="0.5 0 0"/></body></body>'
    text += '<body pos="0 0 0.5"><joint type="slide" axis="0 0 1"/>' + inertial("0 0 0", 3.0, [0.005] * 3)
    text += '<site name="slider" pos="0 0 0"/>' + "".join(
        f'<site name="foot{k}" pos="{sign * off!r} 0 0"/>' for k, sign in ((1, 1), (2, -1))
    )
    text += "</body></body></worldbody><tendon>"
    for k in (1, 2):
        text += '<spatial stiffness="8e5" damping="4e4" springlength="0.5">'
        text += f'<site site="foot{k}"/><site site="middle{k}"/></spatial>'
    return Model(text + "</tendon>", ["slider"], (2,), [spin, 0, 0, 0], gravity="0 0 -9.81")


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
    return Model(text + "</body>" * 5 + f"</worldbody><equality>{closures}</equality>", ["tip"], (0, 1, 2))


STEPS = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
# The squeezer takes 0.05 s; the governor's fastest motion decays with 8117 1/s.
STEPS_OF = {
    "A03": (2.5e-4, 1e-4, 5e-5, 2.5e-5, 1e-5, 5e-6, 2.5e-6, 1e-6),
    "A05": (1e-3, 5e-4, 3.125e-4, 2.5e-4, 2e-4, 1e-4),
}
MODELS = {
    "A01": pendulum,
    "A02_N2": four_bars,
    "A03": squeezer,
    "A04": bricard,
    "A05": governor,
    "chain_N10": chain,
}


def runner(problem, method, step):
    scene = MODELS[problem]()
    count = steps_per_sample(problem, step)
    times, _ = reference(problem, step)
    exact = (times[1] - times[0]) / count
    head = HEAD.format(step=repr(exact), method=method, stiff=repr(2.001 * exact), gravity=scene.gravity)
    model = mujoco.MjModel.from_xml_string(head + scene.text + "</mujoco>")

    def run():
        data = mujoco.MjData(model)
        for k, speed in enumerate(scene.speeds):
            data.qvel[k] = speed
        for k, force in enumerate(scene.forces):
            data.qfrc_applied[k] = force
        samples, seconds = [], 0.0
        for sample in range(len(times)):
            if sample > 0:
                start = clock()
                mujoco.mj_step(model, data, count)
                seconds += clock() - start
            mujoco.mj_kinematics(model, data)
            samples.append([data.site(site).xpos[k] for site in scene.sites for k in scene.components])
        return samples, seconds, count * (len(times) - 1)

    return run


def main():
    begin(f"MuJoCo {mujoco.__version__}")
    for problem in MODELS:
        for method in ("RK4", "implicitfast"):
            for step in STEPS_OF.get(problem, STEPS):
                try:
                    run = runner(problem, method, step)
                except ValueError as reason:
                    message = str(reason)

                    def run(message=message):
                        raise RuntimeError(message)

                measure(problem, "mujoco", method, step, run)


if __name__ == "__main__":
    main()
