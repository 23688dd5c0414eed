"""Accelerations of robots at random states, by `odyn import` and `odyn run`, against MuJoCo (pip install mujoco numpy).

    python tests/peers/robot_collections.py ODYN FOLDER [STATES]

Takes every URDF file below FOLDER: of `pip download --no-deps example-robot-data`, say, unpacked. Shapes, meshes, mimicked joints and friction are
left out on both sides (MuJoCo makes them soft), limits are off. A file that one side refuses is named with the reason.
"""

import csv
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

import mujoco
import numpy as np

odyn, folder = sys.argv[1], Path(sys.argv[2])
states = int(sys.argv[3]) if len(sys.argv) > 3 else 5
GOOD = 1e-9


def bare(path: Path) -> str:
    tree = xml.parse(path)
    root = tree.getroot()
    for link in root.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value")) == 0.0:
            # MuJoCo forgets the inertia of what has no mass; `odyn import` keeps it.
            link.remove(link.find("inertial"))
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        for dynamics in joint.findall("dynamics"):
            dynamics.attrib.pop("friction", None)
    for tag in ("gazebo", "transmission", "mujoco"):
        for node in root.findall(tag):
            root.remove(node)
    return xml.tostring(root, encoding="unicode")


def ours(work: Path, names: list[str], pose: np.ndarray, speeds: np.ndarray) -> dict[str, float]:
    scene = work / "robot.toml"
    given = [f"--pose={n}={x:.17g}" for n, x in zip(names, pose)] + [f"--speed={n}={x:.17g}" for n, x in zip(names, speeds)]
    called = subprocess.run(
        [odyn, "import", work / "robot.urdf", "-o", scene, "--force", "--no-limits", *given], capture_output=True, text=True
    )
    if called.returncode:
        raise ValueError(called.stderr.strip().splitlines()[0])
    scene.write_text(scene.read_text().replace('quantity = "coordinate"', 'quantity = "coordinate_acceleration"'))
    called = subprocess.run(
        [odyn, "run", scene, "--set", "simulation.t_end=1e-6", "--set", "simulation.output_step=1e-6", "-o", work / "out"],
        capture_output=True,
        text=True,
    )
    if called.returncode:
        raise ValueError((called.stderr.strip() or called.stdout.strip()).splitlines()[0])
    with open(work / "out" / "results.csv", newline="") as file:
        rows = list(csv.reader(file))
    return {name.split(" [")[0]: float(value) for name, value in zip(rows[0], rows[1])}


def compare(path: Path, work: Path) -> float | None:
    (work / "robot.urdf").write_text(bare(path))
    model = mujoco.MjModel.from_xml_path(str(work / "robot.urdf"))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(model)
    simple = [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)]
    if model.nv == 0 or any(kind not in simple for kind in model.jnt_type):
        return None
    names = [model.joint(j).name for j in range(model.njnt)]
    random = np.random.default_rng(20261125)
    worst = 0.0
    for _ in range(states):
        mujoco.mj_resetData(model, data)
        slide = model.jnt_type == simple[1]
        data.qpos[:] = np.where(slide, random.uniform(-0.3, 0.3, model.nv), random.uniform(-3.0, 3.0, model.nv))
        data.qvel[:] = np.where(slide, random.uniform(-1.0, 1.0, model.nv), random.uniform(-4.0, 4.0, model.nv))
        mujoco.mj_forward(model, data)
        found = ours(work, names, data.qpos, data.qvel)
        size = max(1.0, np.abs(data.qacc).max())
        for name, theirs in zip(names, data.qacc):
            got = found.get(name, found.get(f"{name}-joint"))
            if got is None:
                raise ValueError(f"no joint {name} among {list(found)}")
            worst = max(worst, abs(got - theirs) / size)
    return worst


compared = wrong = 0
for path in sorted(folder.rglob("*.urdf")):
    with tempfile.TemporaryDirectory() as work:
        try:
            worst = compare(path, Path(work))
        except Exception as error:
            print(f"{path.stem}: refused: {str(error)[:160]}", flush=True)
            continue
    if worst is None:
        continue
    compared += 1
    wrong += worst > GOOD
    print(f"{path.stem}: {worst:.1e}{'  WRONG' if worst > GOOD else ''}", flush=True)
print(f"{compared} robots compared, {wrong} beyond {GOOD:g}")
sys.exit(wrong > 0)
