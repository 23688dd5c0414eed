#!/usr/bin/env python3
"""Runs Exudyn on the planar problems A01, A02 (N = 2) and the chain of 10, at several step sizes:

    pip install exudyn
    python3 tests/peers/exudyn_bench.py > exudyn.csv
    odyn bench --peers exudyn.csv

Bodies and joints are Exudyn's planar ones (`ObjectRigidBody2D`, `ObjectJointRevolute2D`), integrated by its generalized-alpha
method and its implicit trapezoidal rule of index 2. The trees (A01, the chain) are also run in joint coordinates
(`ObjectKinematicTree`) with its explicit methods, which is its best setting for them. Exudyn's build without range checks is
used. The time is that of the solver with a sensor that stores the samples.
"""

import contextlib
import math
import sys

sys.exudynFast = True  # before exudyn is imported
with contextlib.redirect_stdout(sys.stderr):  # standard output is the table
    import exudyn

from exudyn.itemInterface import (
    LoadForceVector,
    MarkerBodyPosition,
    NodeGenericODE2,
    NodeRigidBody2D,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectKinematicTree,
    ObjectRigidBody2D,
    SensorBody,
    SensorKinematicTree,
)

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


class Scene:
    """Rods in the plane; ends are points of bodies."""

    def __init__(self):
        self.container = exudyn.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = self.system.AddObject(ObjectGround(referencePosition=[0, 0, 0]))

    def rod(self, mass, inertia, at, angle=0.0, velocity=(0.0, 0.0, 0.0)):
        node = NodeRigidBody2D(referenceCoordinates=[*at, angle], initialVelocities=list(velocity))
        number = self.system.AddNode(node)
        body = self.system.AddObject(ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=number))
        marker = self.system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[0, 0, 0]))
        self.system.AddLoad(LoadForceVector(markerNumber=marker, loadVector=[0, -9.81 * mass, 0]))
        return body

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
                localPosition=[*at, 0],
                storeInternal=True,
                outputVariableType=exudyn.OutputVariableType.Position,
            )
        )


def pendulum():
    scene = Scene()
    bob = scene.rod(1.0, 0.0, (-1.0, 0.0))
    scene.joint(scene.ground, (0, 0), bob, (1, 0))
    return scene, scene.sensor(bob, (0, 0))


def chain(n=10):
    scene = Scene()
    half, mass = 0.5 / n, 1 / n
    before, end = scene.ground, (0, 0)
    for k in range(n):
        rod = scene.rod(mass, mass * (2 * half) ** 2 / 12, ((2 * k + 1) * half, 0.0))
        scene.joint(before, end, rod, (-half, 0))
        before, end = rod, (half, 0)
    return scene, scene.sensor(before, end)


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
    return scene, scene.sensor(links[0], (0, 0.5))


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
        unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        offsets = [[0.0, 0.0, 0.0]] + [[link[0], 0.0, 0.0] for link in links[:-1]]
        self.last, self.end = n - 1, links[-1][0]
        self.tree = self.system.AddObject(
            ObjectKinematicTree(
                nodeNumber=node,
                jointTypes=[exudyn.JointType.RevoluteZ] * n,
                linkParents=list(range(-1, n - 1)),
                jointTransformations=exudyn.Matrix3DList([unit] * n),
                jointOffsets=exudyn.Vector3DList(offsets),
                linkInertiasCOM=exudyn.Matrix3DList([[[c * link[2] for c in row] for row in unit] for link in links]),
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
    return scene, scene.sensor()


def chain_tree(n=10):
    scene = Tree([(1 / n, 1 / n, 1 / n**3 / 12, 0.5 / n)] * n, 0.0)
    return scene, scene.sensor()


MODELS = {"A01": pendulum, "A02_N2": four_bars, "chain_N10": chain}
TREES = {"A01": pendulum_tree, "chain_N10": chain_tree}


def runner(problem, model, solver, step):
    count = steps_per_sample(problem, step)
    times, _ = reference(problem, step)
    apart, end = times[1] - times[0], PROBLEMS[problem][2]

    def run():
        scene, sensor = model()
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
        stored = scene.system.GetSensorStoredData(sensor)
        return [[float(row[1]), float(row[2])] for row in stored], seconds, count * (len(times) - 1)

    return run


def main():
    exudyn.config.printToConsole = False
    begin(f"Exudyn {exudyn.__version__}")
    for problem in MODELS:
        ways = [(name, MODELS[problem], solver) for name, solver in METHODS.items()]
        if problem in TREES:
            ways += [(f"tree {name}", TREES[problem], solver) for name, solver in EXPLICIT.items()]
        for name, model, solver in ways:
            for step in STEPS:
                measure(problem, "exudyn", name, step, runner(problem, model, solver, step))


if __name__ == "__main__":
    main()
