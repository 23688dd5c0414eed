#!/usr/bin/env python3
"""Runs Exudyn on A01, A02 (N = 2), A03, A04, A05 and the chain of 10, at several step sizes:

    pip install exudyn
    python3 tests/peers/exudyn_bench.py > exudyn.csv
    odyn bench --peers exudyn.csv

Bodies and joints of planar problems are Exudyn's planar ones (`ObjectRigidBody2D`, `ObjectJointRevolute2D`); Bricard's mechanism
and the governor have spatial ones with rotation vectors or Euler parameters. They are integrated by its generalized-alpha method
and its implicit trapezoidal rule of index 2. The trees of one branch (A01, the chain) are also run in joint coordinates
(`ObjectKinematicTree`) with its explicit methods, which is its best setting for them. Bricard's mechanism has one row more than
its rank, which Exudyn refuses: its last joint leaves one of the two rotations free that a revolute joint holds. Exudyn's build
without range checks is used. The time is that of the solver with sensors that store the samples.
"""

import contextlib
import functools
import math
import sys

import numpy

sys.exudynFast = True  # before exudyn is imported
with contextlib.redirect_stdout(sys.stderr):  # standard output is the table
    import exudyn

from exudyn.itemInterface import (
    LoadForceVector,
    LoadTorqueVector,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodeGenericODE2,
    NodeRigidBody2D,
    ObjectConnectorSpringDamper,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectKinematicTree,
    ObjectRigidBody2D,
    SensorBody,
    SensorKinematicTree,
)
from exudyn.rigidBodyUtilities import RigidBodyInertia

from common import PROBLEMS, begin, clock, measure, reference, steps_per_sample

METHODS = {
    "GeneralizedAlpha": exudyn.DynamicSolverType.GeneralizedAlpha,
    "TrapezoidalIndex2": exudyn.DynamicSolverType.TrapezoidalIndex2,
}
EXPLICIT = {
    "RK44": exudyn.DynamicSolverType.RK44,
    "RK67": exudyn.DynamicSolverType.RK67,
}
STEPS = (1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4)
STEPS_OF = {
    "A03": (2.5e-4, 1e-4, 5e-5, 2.5e-5, 1e-5, 5e-6, 2.5e-6, 1e-6),
    "A05": (1e-2, 5e-3, 2.5e-3, 1e-3, 5e-4, 2e-4, 1e-4),
}


class Scene:
    """Rods in the plane; ends are points of bodies."""

    def __init__(self):
        self.container = exudyn.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = self.system.AddObject(ObjectGround(referencePosition=[0, 0, 0]))

    def rod(self, mass, inertia, at, angle=0.0, velocity=(0.0, 0.0, 0.0), gravity=9.81):
        """A planar body; `at` is its centre of mass."""
        node = NodeRigidBody2D(referenceCoordinates=[*at, angle], initialVelocities=list(velocity))
        number = self.system.AddNode(node)
        body = self.system.AddObject(ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=number))
        marker = self.system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[0, 0, 0]))
        self.system.AddLoad(LoadForceVector(markerNumber=marker, loadVector=[0, -gravity * mass, 0]))
        return body

    def box(self, mass, moments, at, axes, kind, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), gravity=(0.0, 0.0, 0.0)):
        """A spatial body; `at` is its centre of mass, `moments` are along the columns of `axes`."""
        tensor = [[moments[0], 0, 0], [0, moments[1], 0], [0, 0, moments[2]]]
        return self.system.CreateRigidBody(
            inertia=RigidBodyInertia(mass=mass, inertiaTensor=numpy.array(tensor)),
            referencePosition=list(at),
            referenceRotationMatrix=numpy.array(axes),
            initialVelocity=list(velocity),
            initialAngularVelocity=list(spin),
            gravity=list(gravity),
            nodeType=kind,
        )

    def spring(self, first, point, second, other, stiffness, damping, length):
        markers = [
            self.system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=list(at)))
            for body, at in ((first, point), (second, other))
        ]
        self.system.AddObject(
            ObjectConnectorSpringDamper(markerNumbers=markers, referenceLength=length, stiffness=stiffness, damping=damping)
        )

    def joint(self, first, point, second, other):
        markers = [
            self.system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[*at, 0]))
            for body, at in ((first, point), (second, other))
        ]
        self.system.AddObject(ObjectJointRevolute2D(markerNumbers=markers))

    def sensor(self, body, at):
        return self.system.AddSensor(
            SensorBody(
                bodyNumber=body,
                localPosition=[*at, 0][:3],
                storeInternal=True,
                outputVariableType=exudyn.OutputVariableType.Position,
            )
        )


def pendulum():
    scene = Scene()
    bob = scene.rod(1.0, 0.0, (-1.0, 0.0))
    scene.joint(scene.ground, (0, 0), bob, (1, 0))
    return scene, [scene.sensor(bob, (0, 0))]


def chain(n=10):
    scene = Scene()
    half, mass = 0.5 / n, 1 / n
    before, end = scene.ground, (0, 0)
    for k in range(n):
        rod = scene.rod(mass, mass * (2 * half) ** 2 / 12, ((2 * k + 1) * half, 0.0))
        scene.joint(before, end, rod, (-half, 0))
        before, end = rod, (half, 0)
    return scene, [scene.sensor(before, end)]


def four_bars(n=2):
    scene = Scene()
    # y of a link is along it.
    links = [scene.rod(1.0, 1 / 12, (float(k), 0.5), 0.0, (0.5, 0.0, -1.0)) for k in range(n + 1)]
    couplers = [scene.rod(1.0, 1 / 12, (k + 0.5, 1.0), 0.0, (1.0, 0.0, 0.0)) for k in range(n)]
    for k, link in enumerate(links):
        scene.joint(scene.ground, (k, 0), link, (0, -0.5))
    for k, coupler in enumerate(couplers):
        scene.joint(links[k], (0, 0.5), coupler, (-0.5, 0))
        scene.joint(coupler, (0.5, 0), links[k + 1], (0, 0.5))
    return scene, [scene.sensor(links[0], (0, 0.5))]


def squeezer():
    scene = Scene()
    f, e = (0.00698655030921248, -0.00043372200410285764), (-0.02096002256836912, 0.0012951690850118895)
    g, h = (-0.03399720391575101, 0.016461971731432715), (-0.03163313457940229, -0.015618868871665975)
    o, a, b = (0.0, 0.0), (-0.06934, -0.00227), (-0.03635, 0.03273)

    class Bar:
        """From one point to another: x along it, `com` from the first."""

        def __init__(self, first, second, mass, moment, com):
            angle = math.atan2(second[1] - first[1], second[0] - first[0])
            cos, sin = math.cos(angle), math.sin(angle)
            at = (first[0] + cos * com[0] - sin * com[1], first[1] + sin * com[0] + cos * com[1])
            self.body, self.com = scene.rod(mass, moment, at, angle, gravity=0.0), com

        def at(self, x, y=0.0):
            return (x - self.com[0], y - self.com[1])

    k1, k2 = Bar(o, f, 0.04325, 2.194e-6, (0.00092, 0.0)), Bar(f, e, 0.00365, 4.410e-7, (0.0115, 0.0))
    k3 = Bar(b, e, 0.02373, 5.255e-6, (0.01874, 0.01043))
    k5, k4 = Bar(a, g, 0.07050, 1.169e-5, (0.02308, 0.00916)), Bar(g, e, 0.00706, 5.667e-7, (0.00579, 0.0))
    k7, k6 = Bar(a, h, 0.05498, 1.912e-5, (0.01228, -0.00449)), Bar(h, e, 0.00706, 5.667e-7, (0.00579, 0.0))
    for point, bar in ((o, k1), (b, k3), (a, k5), (a, k7)):
        scene.joint(scene.ground, point, bar.body, bar.at(0.0))
    for inner, outer, length in ((k1, k2, 0.007), (k5, k4, 0.04), (k7, k6, 0.04)):
        scene.joint(inner.body, inner.at(length), outer.body, outer.at(0.0))
    for bar, length in ((k2, 0.028), (k4, 0.020), (k6, 0.020)):
        scene.joint(k3.body, k3.at(0.035), bar.body, bar.at(length))
    scene.spring(scene.ground, (0.014, 0.072, 0.0), k3.body, (*k3.at(0.018, 0.020), 0.0), 4530.0, 0.0, 0.07785)
    crank = scene.system.AddMarker(MarkerBodyRigid(bodyNumber=k1.body, localPosition=[0, 0, 0]))
    scene.system.AddLoad(LoadTorqueVector(markerNumber=crank, loadVector=[0, 0, 0.033]))
    points = ((k1, 0.007), (k3, 0.035), (k5, 0.04), (k7, 0.04))
    return scene, [scene.sensor(bar.body, bar.at(x)) for bar, x in points]


UNIT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def bricard(kind):
    scene = Scene()
    points = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    along, across = 1 / 600, 1.01 / 12
    before, rods = scene.ground, []
    for k in range(5):
        middle = [0.5 * (p + q) for p, q in zip(points[k], points[k + 1])]
        moments = [along if p != q else across for p, q in zip(points[k], points[k + 1])]
        rod = scene.box(1.0, moments, middle, UNIT, kind, gravity=(0.0, -9.81, 0.0))
        scene.system.CreateRevoluteJoint(itemNumbers=[before, rod], position=list(points[k]), axis=list(axes[k]))
        before = rod
        rods.append(rod)
    # About x it turns; y is left free, since all rows would be one more than their rank.
    scene.system.CreateGenericJoint(
        itemNumbers=[scene.ground, before], position=list(points[5]), constrainedAxes=[1, 1, 1, 0, 0, 1], useGlobalFrame=True
    )
    return scene, [scene.sensor(rods[1], (0, -0.5, 0))]


def governor(kind):
    scene = Scene()
    down, spin = (0.0, 0.0, -9.81), (0.0, 0.0, 2 * math.pi)
    box, tip, alpha, off = 0.3, 5.0, math.radians(30), 0.05
    axial, across = box * 0.01**2 / 6, box * (1 + 0.01**2) / 12
    com = 0.5 * tip / (box + tip)
    rod = across + box * com**2 + tip * (0.5 - com) ** 2
    shaft = scene.box(box, [across, across, axial], (0, 0, 0.5), UNIT, kind, spin=spin, gravity=down)
    slider = scene.box(3.0, [0.005] * 3, (0, 0, 0.5), UNIT, kind, spin=spin, gravity=down)
    scene.system.CreateRevoluteJoint(itemNumbers=[scene.ground, shaft], position=[0, 0, 0], axis=[0, 0, 1])
    scene.system.CreatePrismaticJoint(itemNumbers=[shaft, slider], position=[0, 0, 0.5], axis=[0, 0, 1])
    cos, sin = math.cos(alpha), math.sin(alpha)
    for side in (1.0, -1.0):
        # Columns: along the rod outwards and down, across, and the third of the right hand.
        frame = [[side * cos, 0.0, side * sin], [0.0, side, 0.0], [-sin, 0.0, cos]]
        at = [side * (off + (0.5 + com) * cos), 0.0, 1.0 - (0.5 + com) * sin]
        speed = [0.0, spin[2] * at[0], 0.0]
        body = scene.box(box + tip, [axial, rod, rod], at, frame, kind, velocity=speed, spin=spin, gravity=down)
        scene.system.CreateRevoluteJoint(itemNumbers=[shaft, body], position=[side * off, 0, 1.0], axis=[0, 1, 0])
        scene.spring(slider, (side * off, 0.0, 0.0), body, (-com, 0.0, 0.0), 8e5, 4e4, 0.5)
    return scene, [scene.sensor(slider, (0, 0, 0))]


class Tree:
    """Bodies one after the other, turning about z, in joint coordinates."""

    def __init__(self, links, start):
        """`links`: for each its length, mass, moment of inertia and centre of mass, along its x axis."""
        container = exudyn.SystemContainer()
        self.container, self.system, n = container, container.AddSystem(), len(links)
        zero = [0.0] * n
        angles = [start] + [0.0] * (n - 1)
        node = self.system.AddNode(
            NodeGenericODE2(
                numberOfODE2Coordinates=n, referenceCoordinates=zero, initialCoordinates=angles, initialCoordinates_t=zero
            )
        )
        offsets = [[0.0, 0.0, 0.0]] + [[link[0], 0.0, 0.0] for link in links[:-1]]
        self.last, self.end = n - 1, links[-1][0]
        self.tree = self.system.AddObject(
            ObjectKinematicTree(
                nodeNumber=node,
                jointTypes=[exudyn.JointType.RevoluteZ] * n,
                linkParents=list(range(-1, n - 1)),
                jointTransformations=exudyn.Matrix3DList([UNIT] * n),
                jointOffsets=exudyn.Vector3DList(offsets),
                linkInertiasCOM=exudyn.Matrix3DList([[[c * link[2] for c in row] for row in UNIT] for link in links]),
                linkCOMs=exudyn.Vector3DList([[link[3], 0.0, 0.0] for link in links]),
                linkMasses=[link[1] for link in links],
                gravity=[0.0, -9.81, 0.0],
            )
        )

    def sensor(self):
        return self.system.AddSensor(
            SensorKinematicTree(
                objectNumber=self.tree,
                linkNumber=self.last,
                localPosition=[self.end, 0.0, 0.0],
                storeInternal=True,
                outputVariableType=exudyn.OutputVariableType.Position,
            )
        )


def pendulum_tree():
    scene = Tree([(1.0, 1.0, 0.0, 1.0)], math.pi)
    return scene, [scene.sensor()]


def chain_tree(n=10):
    scene = Tree([(1 / n, 1 / n, 1 / n**3 / 12, 0.5 / n)] * n, 0.0)
    return scene, [scene.sensor()]


MODELS = {"A01": pendulum, "A02_N2": four_bars, "A03": squeezer, "chain_N10": chain}
SPATIAL = {"A04": bricard, "A05": governor}
ROTATIONS = {
    "rotation vector": exudyn.NodeType.RotationRotationVector,
    "Euler parameters": exudyn.NodeType.RotationEulerParameters,
}
# Measured components, where they are not x and y.
COMPONENTS = {"A04": (0, 1, 2), "A05": (2,)}
TREES = {"A01": pendulum_tree, "chain_N10": chain_tree}


def runner(problem, model, solver, step):
    count = steps_per_sample(problem, step)
    times, _ = reference(problem, step)
    apart, end = times[1] - times[0], PROBLEMS[problem][2]
    components = COMPONENTS.get(problem, (0, 1))

    def run():
        scene, sensors = model()
        scene.system.Assemble()
        settings = exudyn.SimulationSettings()
        settings.timeIntegration.numberOfSteps = count * (len(times) - 1)
        settings.timeIntegration.endTime = end
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.relativeTolerance = 1e-10
        settings.timeIntegration.newton.absoluteTolerance = 1e-12
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = apart
        settings.show.statistics = False
        start = clock()
        done = scene.system.SolveDynamic(settings, solverType=solver, showHints=False, showCausingItems=False)
        seconds = clock() - start
        assert done is not False, "the solver gave up"
        stored = [scene.system.GetSensorStoredData(sensor) for sensor in sensors]
        samples = [[float(row[1 + k]) for row in rows for k in components] for rows in zip(*stored)]
        return samples, seconds, count * (len(times) - 1)

    return run


def main():
    exudyn.config.printToConsole = False
    begin(f"Exudyn {exudyn.__version__}")
    for problem in PROBLEMS:
        if problem in SPATIAL:
            ways = [
                (f"{name}, {rotation}", functools.partial(SPATIAL[problem], kind), solver)
                for name, solver in METHODS.items()
                for rotation, kind in ROTATIONS.items()
            ]
        else:
            ways = [(name, MODELS[problem], solver) for name, solver in METHODS.items()]
        if problem in TREES:
            ways += [(f"tree {name}", TREES[problem], solver) for name, solver in EXPLICIT.items()]
        for name, model, solver in ways:
            for step in STEPS_OF.get(problem, STEPS):
                measure(problem, "exudyn", name, step, runner(problem, model, solver, step))


if __name__ == "__main__":
    main()
