"""Accelerations of the robots in tests/robots at random states by MuJoCo (pip install mujoco numpy), 17 digits.

    python tests/peers/mujoco_robots.py            writes tests/robots/NAME.csv with 12 states
    python tests/peers/mujoco_robots.py 100 DIR    writes DIR/NAME.csv with 100

Columns: coordinate, rate and acceleration of every joint that has one. Contacts, limits and equalities are off; joints that follow
others are left out of it. Free trunks begin where the file has them, at rest.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np

ROBOTS = Path(__file__).parent.parent / "robots"
NAMES = ["arm.urdf", "gantry.urdf", "walker.xml", "snake.xml", "crane.urdf"]


def write(path: Path, count: int, folder: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(path))
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_EQUALITY
    data = mujoco.MjData(model)
    slide_type = int(mujoco.mjtJoint.mjJNT_SLIDE)
    moving = [j for j in range(model.njnt) if model.jnt_type[j] in (int(mujoco.mjtJoint.mjJNT_HINGE), slide_type)]
    names = [model.joint(j).name for j in moving]
    place = [model.jnt_qposadr[j] for j in moving]
    dof = [model.jnt_dofadr[j] for j in moving]
    random = np.random.default_rng(20261125)
    lines = [",".join([f"{kind}:{name}" for kind in ("q", "v", "a") for name in names])]
    for _ in range(count):
        mujoco.mj_resetData(model, data)
        for j, p, d in zip(moving, place, dof):
            slide = model.jnt_type[j] == slide_type
            low, high = model.jnt_range[j] if model.jnt_limited[j] else (-0.5, 0.5) if slide else (-3.0, 3.0)
            data.qpos[p] = random.uniform(low, high)
            data.qvel[d] = random.uniform(-1.0, 1.0) if slide else random.uniform(-4.0, 4.0)
        mujoco.mj_forward(model, data)
        numbers = [*data.qpos[place], *data.qvel[dof], *data.qacc[dof]]
        lines.append(",".join(f"{x:.17g}" for x in numbers))
    (folder / f"{path.stem}.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    folder = Path(sys.argv[2]) if len(sys.argv) > 2 else ROBOTS
    for name in NAMES:
        write(ROBOTS / name, count, folder)
        print(name)
