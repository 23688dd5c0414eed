#!/usr/bin/env python3
"""Compares `odyn modes`, `odyn statics` and `odyn linearise` with other programs on the same mechanisms:

    pip install -r tests/peers/requirements.txt
    python3 tests/peers/analyses.py --odyn target/release/odyn

- Modes: Exudyn (`ComputeODE2Eigenvalues`), where it can state the mechanism, and equations written here with NumPy alone (gradients of energy
  and constraints by complex steps, differenced once more; SciPy for the eigenvalues).
- Statics: where MuJoCo's damped chains come to rest.
- Linear models: python-control's step response against runs of a small amplitude.

A table of the largest relative differences goes to standard output, as Markdown; the exit code is 1 where one is above its bound.
"""

import argparse
import contextlib
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy.linalg

G = 9.81


class Mechanism:
    """Bodies (axes parallel to the ground's), revolute joints with springs; from it come the scene, and the equations of others."""

    def __init__(self, name, gravity=(0.0, 0.0, 0.0), at="start", extra=""):
        self.name, self.gravity, self.at, self.extra = name, np.array(gravity), at, extra
        self.bodies, self.joints = [], []

    def body(self, mass, inertia, position, spin=(0, 0, 0)):
        self.bodies.append((mass, np.array(inertia, float), np.array(position, float), spin))
        return len(self.bodies) - 1

    def revolute(self, i, j, point, axis, stiffness=0.0):
        self.joints.append((i, j, np.array(point, float), np.array(axis, float), stiffness))

    def scene(self):
        word = lambda i: "ground" if i is None else f"b{i}"
        row = lambda v: "[" + ", ".join(repr(float(x)) for x in v) + "]"
        text = '[plugins]\nlibraries = ["joints", "forces"]\n[simulation]\nt_end = 1\noutput_step = 0.1\n'
        text += f"gravity = {row(self.gravity)}\n"
        for k, (mass, inertia, position, spin) in enumerate(self.bodies):
            text += f'[[body]]\nname = "b{k}"\nmass = {mass!r}\ninertia = {row(inertia)}\nposition = {row(position)}\n'
            text += f"velocity = [0, 0, 0]\nangular_velocity = {row(spin)}\n"
        for k, (i, j, point, axis, stiffness) in enumerate(self.joints):
            place = f'bodies = ["{word(i)}", "{word(j)}"]\npoint = {row(point)}\naxis = {row(axis)}\n'
            text += f'[[joint]]\nname = "j{k}"\ntype = "revolute"\n{place}'
            if stiffness:
                text += f'[[force]]\nname = "s{k}"\ntype = "rotational-spring-damper"\n{place}params.stiffness = {stiffness!r}\n'
        return text + self.extra


def rotation(v):
    """The matrix of a rotation vector; of complex numbers, too."""
    x, y, z = v
    s = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = x * x + y * y + z * z
    # sin(a)/a and (1 - cos a)/a^2 by their series: rotations here are small.
    first = 1 - a / 6 + a * a / 120 - a**3 / 5040
    second = 0.5 - a / 24 + a * a / 720 - a**3 / 40320
    return np.eye(3) + first * s + second * (s @ s)


class Equations:
    """V and Phi of a mechanism by six numbers per body about given poses."""

    def __init__(self, mechanism, poses):
        self.m, self.poses = mechanism, poses
        self.n = 6 * len(mechanism.bodies)
        frames = []
        for i, j, point, axis, stiffness in mechanism.joints:
            other = np.linalg.svd(axis[None])[2][1:]
            # Bodies start parallel to the ground's axes.
            at = lambda k: point if k is None else point - mechanism.bodies[k][2]
            frames.append((i, j, at(i), at(j), axis / np.linalg.norm(axis), other, stiffness))
        self.frames = frames

    def pose(self, x, k):
        if k is None:
            return np.zeros(3), np.eye(3)
        position, turn = self.poses[k]
        return position + x[6 * k : 6 * k + 3], rotation(x[6 * k + 3 : 6 * k + 6]) @ turn

    def energy(self, x):
        total = 0
        for k, (mass, *_) in enumerate(self.m.bodies):
            total = total - mass * (self.m.gravity @ self.pose(x, k)[0])
        for i, j, _, _, axis, other, stiffness in self.frames:
            if stiffness:
                ri, rj = self.pose(x, i)[1], self.pose(x, j)[1]
                total = total + 0.5 * stiffness * np.arcsin((rj @ other[0]) @ (ri @ np.cross(axis, other[0]))) ** 2
        return total

    def rows(self, x):
        rows = []
        for i, j, a, b, axis, other, _ in self.frames:
            (pi, ri), (pj, rj) = self.pose(x, i), self.pose(x, j)
            rows.extend(pi + ri @ a - pj - rj @ b)
            rows.extend([(ri @ o) @ (rj @ axis) for o in other])
        return np.array(rows)

    def gradient(self, function, x):
        step = 1e-30
        columns = []
        for k in range(self.n):
            moved = x.astype(complex)
            moved[k] += 1j * step
            columns.append(np.imag(function(moved)) / step)
        return np.array(columns).T

    def squares(self):
        """Eigenvalues w^2 of small motions."""
        zero = np.zeros(self.n)
        jacobian = self.gradient(self.rows, zero)
        force = self.gradient(self.energy, zero)
        multipliers = np.linalg.lstsq(jacobian.T, -force, rcond=1e-10)[0]
        basis = scipy.linalg.null_space(jacobian, rcond=1e-9)
        left = np.abs(basis.T @ force).max() / max(1e-300, np.abs(force).max())
        if left > 1e-8:
            raise RuntimeError(f"no equilibrium of the equations here: {left:.1e}")
        whole = lambda x: self.energy(x) + multipliers @ self.rows(x)
        h = 2e-3
        hessian = np.zeros((self.n, basis.shape[1]))
        for k in range(basis.shape[1]):
            for factor, weight in ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60)):
                ahead = self.gradient(whole, factor * h * basis[:, k])
                behind = self.gradient(whole, -factor * h * basis[:, k])
                hessian[:, k] += weight * (ahead - behind) / h
        mass = np.zeros((self.n, self.n))
        for k, (m, inertia, *_) in enumerate(self.m.bodies):
            turn = self.poses[k][1]
            mass[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = m * np.eye(3)
            mass[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = turn @ np.diag(inertia) @ turn.T
        stiffness = basis.T @ hessian
        return scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), basis.T @ mass @ basis, eigvals_only=True)


def exudyn_bodies(mechanism):
    """Rigid bodies, revolute joints and torsion springs: for mechanisms whose joints carry nothing at rest, since Exudyn takes the
    derivatives of forces, not of the directions of reactions."""
    import exudyn
    from exudyn.solver import ComputeODE2Eigenvalues
    from exudyn.utilities import InertiaCuboid, RigidBodyInertia

    system = exudyn.SystemContainer().AddSystem()
    ground = system.CreateGround()
    numbers = []
    for mass, inertia, position, spin in mechanism.bodies:
        own = RigidBodyInertia(mass=mass, inertiaTensor=np.diag(inertia))
        numbers.append(
            system.CreateRigidBody(
                inertia=own,
                referencePosition=list(position),
                initialAngularVelocity=list(spin),
                nodeType=exudyn.NodeType.RotationRxyz,
            )
        )
    for i, j, point, axis, stiffness in mechanism.joints:
        pair = [ground if i is None else numbers[i], ground if j is None else numbers[j]]
        system.CreateRevoluteJoint(itemNumbers=pair, position=list(point), axis=list(axis), useGlobalFrame=True)
        if stiffness:
            system.CreateTorsionalSpringDamper(
                itemNumbers=pair, position=list(point), axis=list(axis), stiffness=stiffness, useGlobalFrame=True
            )
    system.Assemble()
    return ComputeODE2Eigenvalues(system, useAbsoluteValues=False)[0]


def exudyn_at_rest(mechanism, poses):
    """Rigid bodies and revolute joints that carry weights where they rest. Exudyn's own eigenvalues leave out how reactions turn with
    the joints; so its forces F(q), constraint Jacobian C(q) and masses are asked for, and the stiffness is that of -F + C^T lambda with the reactions
    lambda that hold the weights, differenced (order 6) along what C leaves free."""
    import exudyn
    from exudyn.utilities import RigidBodyInertia

    system = exudyn.SystemContainer().AddSystem()
    ground = system.CreateGround()
    numbers = []
    for (mass, inertia, _, _), (position, turn) in zip(mechanism.bodies, poses):
        numbers.append(
            system.CreateRigidBody(
                # In axes of the ground, so that angles are zero where it rests.
                inertia=RigidBodyInertia(mass=mass, inertiaTensor=turn @ np.diag(inertia) @ turn.T),
                referencePosition=list(position),
                gravity=list(mechanism.gravity),
                nodeType=exudyn.NodeType.RotationRxyz,
            )
        )
    for i, j, point, axis, stiffness in mechanism.joints:
        pair = [ground if i is None else numbers[i], ground if j is None else numbers[j]]
        position, direction = point, axis
        if i is not None:
            position = poses[i][0] + poses[i][1] @ (point - mechanism.bodies[i][2])
            direction = poses[i][1] @ axis
        system.CreateRevoluteJoint(itemNumbers=pair, position=list(position), axis=list(direction), useGlobalFrame=True)
        if stiffness:
            system.CreateTorsionalSpringDamper(
                itemNumbers=pair, position=list(position), axis=list(direction), stiffness=stiffness, useGlobalFrame=True
            )
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    solver = exudyn.MainSolverStatic()
    solver.InitializeSolver(system, settings)
    n, zero = solver.GetODE2size(), np.array(system.systemData.GetODE2Coordinates())

    def look(q):
        system.systemData.SetODE2Coordinates(q)
        solver.ComputeODE2RHS(system)
        force = np.array(solver.GetSystemResidual())[:n]
        solver.ComputeJacobianODE2RHS(system, scalarFactor_ODE2=0, scalarFactor_ODE2_t=0, scalarFactor_ODE1=0)
        solver.ComputeJacobianAE(system, scalarFactor_ODE2=1.0, scalarFactor_ODE2_t=0.0, scalarFactor_ODE1=0.0, velocityLevel=False)
        return force, np.array(solver.GetSystemJacobian())[n:, :n]

    solver.ComputeMassMatrix(system)
    mass = np.array(solver.GetSystemMassMatrix())[:n, :n]
    force, rows = look(zero)
    reactions = np.linalg.lstsq(rows.T, force, rcond=1e-10)[0]
    basis = scipy.linalg.null_space(rows, rcond=1e-9)
    left = np.abs(basis.T @ force).max() / np.abs(force).max()
    if left > 1e-8:
        raise RuntimeError(f"no equilibrium in Exudyn: {left:.1e}")

    def pull(q):
        force, rows = look(q)
        return rows.T @ reactions - force

    h = 2e-3
    stiffness = np.zeros((n, basis.shape[1]))
    for k in range(basis.shape[1]):
        for factor, weight in ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60)):
            stiffness[:, k] += weight * (pull(zero + factor * h * basis[:, k]) - pull(zero - factor * h * basis[:, k])) / h
    solver.FinalizeSolver(system, settings)
    stiffness = basis.T @ stiffness
    return scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), basis.T @ mass @ basis, eigvals_only=True)


def exudyn_chain(count, mass, length, inertia):
    """A chain that hangs: in joint coordinates, where weights have a stiffness."""
    import exudyn
    from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
    from exudyn.solver import ComputeODE2Eigenvalues
    from exudyn.utilities import RigidBodyInertia

    system = exudyn.SystemContainer().AddSystem()
    zeros = [0.0] * count
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=zeros,
            initialCoordinates=zeros,
            initialCoordinates_t=zeros,
            numberOfODE2Coordinates=count,
        )
    )
    offsets = exudyn.Vector3DList()
    turns, inertias, centers = exudyn.Matrix3DList(), exudyn.Matrix3DList(), exudyn.Vector3DList()
    for k in range(count):
        offsets.Append([0, -length if k else 0, 0])
        turns.Append(np.eye(3))
        center = np.array([0, -length / 2, 0])
        about = np.diag(inertia) + mass * (center @ center * np.eye(3) - np.outer(center, center))
        inertias.Append(about)
        centers.Append(center)
    system.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exudyn.JointType.RevoluteZ] * count,
            linkParents=list(range(-1, count - 1)),
            jointTransformations=turns,
            jointOffsets=offsets,
            linkInertiasCOM=exudyn.Matrix3DList([np.diag(inertia)] * count),
            linkCOMs=centers,
            linkMasses=[mass] * count,
            gravity=[0, -G, 0],
        )
    )
    system.Assemble()
    return ComputeODE2Eigenvalues(system, useAbsoluteValues=False)[0]


def mechanisms():
    rod = lambda m, l, axis: [m * l * l / 12 if k != axis else 1e-3 * m * l * l for k in range(3)]
    chain = Mechanism("pendulum chain, 10 rods", gravity=(0, -G, 0))
    for k in range(10):
        one = chain.body(0.1, rod(0.1, 0.1, 1), (0, -0.1 * k - 0.05, 0))
        chain.revolute(one - 1 if k else None, one, (0, -0.1 * k, 0), (0, 0, 1))
    tree = lambda poses: exudyn_chain(10, 0.1, 0.1, rod(0.1, 0.1, 1))

    bar = Mechanism("four-bar at rest", gravity=(0, -G, 0), at="equilibrium")
    left, right = bar.body(1.0, rod(1, 1, 1), (0, -0.5, 0)), bar.body(1.5, rod(1.5, 1, 1), (1, -0.5, 0))
    coupler = bar.body(1.0, rod(1, 1, 0), (0.5, -1, 0))
    for i, j, at in ((None, left, (0, 0, 0)), (None, right, (1, 0, 0)), (left, coupler, (0, -1, 0)), (coupler, right, (1, -1, 0))):
        bar.revolute(i, j, at, (0, 0, 1))

    def bricard(name, gravity, stiffness):
        one = Mechanism(name, gravity=gravity, at="equilibrium")
        points = [(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)]
        axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
        for k in range(5):
            a, b = np.array(points[k]), np.array(points[k + 1])
            along = int(np.argmax(np.abs(b - a)))
            one.body(1.0, [1 / 600 if c == along else 1.01 / 12 for c in range(3)], (a + b) / 2)
        for k in range(6):
            one.revolute(k - 1 if k else None, k if k < 5 else None, points[k], axes[k], stiffness)
        return one

    sprung = bricard("Bricard's mechanism with springs", (0, 0, 0), 30.0)
    heavy = bricard("Bricard's mechanism at rest", (0, -G, 0), 0.0)

    bent = Mechanism("four-bar with springs", at="start")
    left, right = bent.body(1.0, rod(1, 1, 1), (0, 0.5, 0)), bent.body(1.5, rod(1.5, 1, 1), (1, 0.5, 0))
    coupler = bent.body(1.0, rod(1, 1, 0), (0.5, 1, 0))
    for i, j, at in ((None, left, (0, 0, 0)), (None, right, (1, 0, 0)), (left, coupler, (0, 1, 0)), (coupler, right, (1, 1, 0))):
        bent.revolute(i, j, at, (0, 0, 1), 20.0)

    beam = Mechanism("beam chain of 8 sprung segments")
    for k in range(8):
        one = beam.body(0.125, rod(0.125, 0.125, 0), (0.125 * k + 0.0625, 0, 0))
        beam.revolute(one - 1 if k else None, one, (0.125 * k, 0, 0), (0, 0, 1), 8.0)

    # Arms that hang from a turning shaft, in the plane of shaft and arms: heavy, closed by a slider is beyond joints alone; at rest it is a double pendulum
    # on either side of a shaft with a spring.
    governor = Mechanism("governor at rest", gravity=(0, -G, 0))
    shaft = governor.body(2.0, [0.05, 0.02, 0.05], (0, 0, 0))
    governor.revolute(None, shaft, (0, 0, 0), (0, 1, 0), 5.0)
    for side in (-1, 1):
        arm = governor.body(0.8, rod(0.8, 0.4, 1), (0.1 * side, -0.2, 0))
        governor.revolute(shaft, arm, (0.1 * side, 0, 0), (0, 0, 1))
        ball = governor.body(1.2, rod(1.2, 0.3, 1), (0.1 * side, -0.55, 0))
        governor.revolute(arm, ball, (0.1 * side, -0.4, 0), (0, 0, 1), 3.0)

    bodies = lambda one: (lambda poses: exudyn_bodies(one))
    resting = lambda one: (lambda poses: exudyn_at_rest(one, poses))
    return [
        (chain, tree),
        (bar, resting(bar)),
        (bent, bodies(bent)),
        (heavy, resting(heavy)),
        (sprung, bodies(sprung)),
        (beam, bodies(beam)),
        (governor, resting(governor)),
    ]


class Odyn:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def call(self, command, scene, *more):
        file = self.folder / "scene.toml"
        file.write_text(scene)
        full = [self.program, command, str(file), "--json", "-o", str(self.folder / command), *more]
        done = subprocess.run(full, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return json.loads(done.stdout)


def matrix(p):
    e0, e1, e2, e3 = p
    return np.array(
        [
            [e0 * e0 + e1 * e1 - e2 * e2 - e3 * e3, 2 * (e1 * e2 - e0 * e3), 2 * (e1 * e3 + e0 * e2)],
            [2 * (e1 * e2 + e0 * e3), e0 * e0 - e1 * e1 + e2 * e2 - e3 * e3, 2 * (e2 * e3 - e0 * e1)],
            [2 * (e1 * e3 - e0 * e2), 2 * (e2 * e3 + e0 * e1), e0 * e0 - e1 * e1 - e2 * e2 + e3 * e3],
        ]
    )


def difference(found, expected):
    """Largest relative difference of sorted lists."""
    found, expected = np.sort(np.asarray(found)), np.sort(np.asarray(expected))
    if len(found) != len(expected):
        raise RuntimeError(f"{len(found)} modes and {len(expected)}: {found} {expected}")
    return float(np.abs(found / expected - 1).max())


def imaginary(modes):
    """w^2 by the modes of odyn, negative where they grow; a pair of real ones counts once."""
    return [m["imaginary"] ** 2 if m["imaginary"] else -(m["real"] ** 2) for m in modes["modes"] if m["imaginary"] or m["real"] > 0]


def compare_modes(odyn, table):
    for one, exudyn in mechanisms():
        scene = one.scene()
        modes = odyn.call("modes", scene, "--at", one.at)
        found = imaginary(modes)
        if one.at == "equilibrium":
            rest = odyn.call("statics", scene)["found"][0]["bodies"]
            poses = [(np.array(b["position"]), matrix(b["orientation"])) for b in rest]
        else:
            poses = [(position, np.eye(3)) for _, _, position, _ in one.bodies]
        squares = Equations(one, poses).squares()
        table.add(f"modes: {one.name}", "NumPy/SciPy", len(found), difference(found, squares), 1e-6)
        if exudyn:
            with contextlib.redirect_stdout(sys.stderr):
                values = np.asarray(exudyn(poses))
            values = values[: len(found)] if len(values) >= len(found) else values
            table.add(f"modes: {one.name}", "Exudyn", len(found), difference(found, values), 1e-6)


ROTOR = """
[plugins]
libraries = ["joints", "forces"]
[simulation]
t_end = 1
output_step = 0.1
[[body]]
name = "disc"
mass = 2
inertia = [0.3, 0.3, 0.5]
velocity = [0, 0, 0]
angular_velocity = [0, 0, 40]
[[body]]
name = "housing"
mass = 1
inertia = [0.2, 0.25, 0.1]
[[joint]]
name = "shaft"
type = "revolute"
bodies = ["housing", "disc"]
point = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "pivot"
type = "spherical"
bodies = ["ground", "housing"]
point = [0, 0, 0]
[[force]]
name = "springs"
type = "bushing"
bodies = ["ground", "housing"]
point = [0, 0, 0]
params = { stiffness = [0, 0, 0], rotational_stiffness = [300, 260, 50] }
"""


def rotor_rates():
    """Angular momentum of housing and disc in axes of the ground, tilted by (a, b, c): its rates, written out."""
    spin, housing, disc = 40.0, np.array([0.2, 0.25, 0.1]), np.array([0.3, 0.3, 0.5])
    stiffness = np.array([300.0, 260.0, 50.0])

    def rates(z):
        angles, omega = z[:3], z[3:6]
        turn = rotation(angles)
        own = turn.T @ omega
        # The disc turns with the housing across the shaft, and keeps its spin momentum along it.
        momentum = disc[2] * spin
        inertia = np.array([housing[0] + disc[0], housing[1] + disc[1], housing[2]])
        h = inertia * own + np.array([0, 0, momentum])
        torque = turn.T @ (-stiffness * angles)
        acceleration = (torque - np.cross(own, h)) / inertia
        # Rotation vectors near zero: their rate is omega + angles x omega / 2 up to second order.
        return np.concatenate([omega - 0.5 * np.cross(angles, omega), turn @ acceleration])

    a = np.zeros((6, 6))
    h = 1e-4
    for k in range(6):
        step = np.zeros(6)
        step[k] = h
        a[:, k] = (8 * (rates(step) - rates(-step)) - (rates(2 * step) - rates(-2 * step))) / (12 * h)
    return a


def exudyn_rotor():
    """The same as one body in a frame that does not spin: not stated in Exudyn's bodies, so as its general equations of the second order."""
    import exudyn
    from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2
    from exudyn.solver import ComputeODE2Eigenvalues

    system = exudyn.SystemContainer().AddSystem()
    node = system.AddNode(
        NodeGenericODE2(referenceCoordinates=[0.0] * 3, initialCoordinates=[0.0] * 3, initialCoordinates_t=[0.0] * 3, numberOfODE2Coordinates=3)
    )
    momentum = 0.5 * 40.0
    gyroscopic = np.array([[0, momentum, 0], [-momentum, 0, 0], [0, 0, 0]])
    system.AddObject(
        ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=np.diag([0.5, 0.55, 0.1]),
            stiffnessMatrix=np.diag([300.0, 260.0, 50.0]),
            dampingMatrix=gyroscopic,
        )
    )
    system.Assemble()
    values = ComputeODE2Eigenvalues(system, computeComplexEigenvalues=True, useAbsoluteValues=False)[0]
    return np.abs(np.imag(np.asarray(values)))


def compare_rotor(odyn, table):
    modes = odyn.call("modes", ROTOR)
    found = [m["imaginary"] for m in modes["modes"] if m["imaginary"]]
    values = scipy.linalg.eigvals(rotor_rates()).imag
    table.add("modes: rotor with gyroscopic terms", "NumPy/SciPy", len(found), difference(found, values[values > 1e-6]), 1e-6)
    with contextlib.redirect_stdout(sys.stderr):
        values = exudyn_rotor()
    positive = np.sort(values[values > 1e-6])
    positive = positive[::2] if len(positive) == 2 * len(found) else positive
    table.add("modes: rotor with gyroscopic terms", "Exudyn", len(found), difference(found, positive), 1e-6)


def compare_statics(odyn, table):
    """Chains of hinges with springs and weights, in space; MuJoCo comes to rest by dampers."""
    import mujoco

    random = np.random.default_rng(7)
    worst, count = 0.0, 5
    for _ in range(count):
        links = 5
        one = Mechanism("chain", gravity=(0, 0, -G), at="equilibrium")
        xml, close = "", ""
        at = np.zeros(3)
        previous, before = None, np.zeros(3)
        for k in range(links):
            axis = [(0, 1, 0), (0, 0, 1), (1, 0, 0)][int(random.integers(3))]
            step = random.uniform(-0.3, 0.3, 3)
            mass, inertia = float(random.uniform(0.5, 2)), [0.01, 0.012, 0.009]
            stiffness = float(random.uniform(20, 60))
            center = at + step / 2
            body = one.body(mass, inertia, center)
            one.revolute(previous, body, at, axis, stiffness)
            text = lambda v: " ".join(repr(float(x)) for x in v)
            xml += f'<body pos="{text(at - before)}"><joint type="hinge" axis="{text(axis)}" stiffness="{stiffness!r}" damping="3"/>'
            xml += f'<inertial pos="{text(step / 2)}" mass="{mass!r}" diaginertia="{text(inertia)}"/>'
            close += "</body>"
            previous, before, at = body, at, at + step
        model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option gravity="0 0 {-G}" timestep="0.002" integrator="implicit"/><worldbody>{xml}{close}</worldbody></mujoco>'
        )
        data = mujoco.MjData(model)
        for _ in range(60000):
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        found = odyn.call("statics", one.scene())["found"][0]
        for k, body in enumerate(found["bodies"]):
            worst = max(worst, float(np.abs(np.array(body["position"]) - data.xipos[k + 1]).max()))
    table.add(f"statics: {count} sprung chains in space, places, m", "MuJoCo", 5 * count, worst, 1e-9)


STEP = """
[plugins]
libraries = ["joints", "forces"]
[simulation]
gravity = [0, 0, -9.81]
t_end = 3
output_step = 0.01
tolerance = 1e-12
[[input]]
name = "torque"
value = VALUE
unit = "N m"
[[body]]
name = "upper"
mass = 1
inertia = [0.02, 0.02, 0.001]
position = [0, 0, -0.25]
[[body]]
name = "lower"
mass = 0.7
inertia = [0.01, 0.01, 0.001]
position = [0, 0, -0.7]
[[joint]]
name = "shoulder"
type = "revolute"
bodies = ["ground", "upper"]
point = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "elbow"
type = "revolute"
bodies = ["upper", "lower"]
point = [0, 0, -0.5]
axis = [0, 1, 0]
[[force]]
name = "damper"
type = "rotational-spring-damper"
bodies = ["upper", "lower"]
axis = [0, 1, 0]
params = { stiffness = 2, damping = 0.2 }
[[force]]
name = "motor"
type = "rotational-actuator"
bodies = ["ground", "upper"]
axis = [0, 1, 0]
inputs = { signal = "torque" }
[[output]]
name = "angle"
quantity = "coordinate"
of = "elbow"
channel = "angle"
"""


def compare_control(odyn, table):
    import control

    odyn.call("linearise", STEP.replace("VALUE", "0"))
    m = np.load(odyn.folder / "linearise" / "linear.npz")
    model = control.ss(m["A"], m["B"], m["C"], m["D"])
    amplitude = 1e-5
    odyn.call("run", STEP.replace("VALUE", repr(amplitude)))
    rows = np.genfromtxt(odyn.folder / "run" / "results.csv", delimiter=",", names=True)
    times, values = control.step_response(model, T=rows["t"])
    run = rows["angle"] / amplitude
    miss = np.abs(np.squeeze(values) - run).max() / np.abs(run).max()
    table.add("linearise: step response against a run", "python-control", len(run), float(miss), 1e-6)


class Table:
    def __init__(self):
        self.failed = False
        print("| what | beside | numbers | largest difference | bound |\n|---|---|---:|---:|---:|")

    def add(self, what, beside, count, found, bound):
        bad = not found <= bound
        self.failed |= bad
        print(f"| {what} | {beside} | {count} | {found:.1e}{' **above**' if bad else ''} | {bound:.0e} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--odyn", default="target/release/odyn", help="the program")
    parser.add_argument("--only", help="one of modes, rotor, statics, control")
    chosen = parser.parse_args()
    table = Table()
    parts = {"modes": compare_modes, "rotor": compare_rotor, "statics": compare_statics, "control": compare_control}
    with tempfile.TemporaryDirectory() as folder:
        odyn = Odyn(str(Path(chosen.odyn).resolve()), Path(folder))
        for name, part in parts.items():
            if chosen.only in (None, name):
                part(odyn, table)
    return 1 if table.failed else 0


if __name__ == "__main__":
    sys.exit(main())
