"""Speed of exported bodies in plain MuJoCo, compared with the simulator.

``python -m benchmarks.exported_body`` prints the table of ``docs/export.md``.
"""

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.exchange.robot_export import Contact, mjcf_text
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

CASES: Final = (
    ("lateral-undulation", "yaw16"),
    ("concertina-yaw16", "yaw16"),
    ("sidewinding", "alternating16"),
    ("turn-in-place", "alternating16"),
)
CONTACTS: Final[tuple[Contact, ...]] = ("rollers", "isotropic", "none")
_FROM_S: Final = 3.0
_TO_S: Final = 11.0
_SAMPLE_S: Final = 0.02


def exported_speeds(gait: str, robot_name: str, contacts: Sequence[Contact]) -> list[float]:
    """Return the net speed of the centre in the world ``flat``, then that of each exported body.

    All follow the same goals: those that the simulated run sends to its servos.
    """
    prepared = prepare_gait(gait, robot=robot_name, world="flat", seconds=_TO_S + 1.0)
    record = run_robot(RunRequest(prepared, stoppable=False)).record
    robot = prepared.robot
    goal_s, goal_rad = record.cycle.time_s, record.cycle.sent_rad
    speeds = [_speed(record.pose.time_s, record.pose.links_m.mean(axis=1))]
    for contact in contacts:
        model = mujoco.MjModel.from_xml_string(mjcf_text(robot, "dcmotor", contact))
        data = mujoco.MjData(model)
        joints = [model.joint(name).id for name in robot.joint_names]
        data.qpos[2] = robot.body_radius_m + 1e-3
        data.qpos[model.jnt_qposadr[joints]] = goal_rad[0]
        motors = [model.actuator(name).id for name in robot.joint_names]
        links = [model.body(f"link{link}").id for link in range(robot.link_count)]
        time_s: list[float] = []
        centre_m: list[Floats] = []
        while data.time < _TO_S + 2.0 * _SAMPLE_S:
            row = min(int(np.searchsorted(goal_s, data.time)), len(goal_s) - 1)
            data.ctrl[motors] = goal_rad[row]
            mujoco.mj_step(model, data)
            if not time_s or data.time - time_s[-1] > _SAMPLE_S:
                time_s.append(data.time)
                centre_m.append(data.xipos[links].mean(axis=0))
        speeds.append(_speed(np.array(time_s), np.array(centre_m)))
    return speeds


def _speed(time_s: Floats, centre_m: Floats) -> float:
    first, last = np.searchsorted(time_s, (_FROM_S, _TO_S))
    return float(np.hypot(*(centre_m[last] - centre_m[first])[:2])) / (_TO_S - _FROM_S)


def main() -> None:
    """Print the table."""
    print("| gait | robot | snakewalk, m/s |", " | ".join(CONTACTS), "|")
    print("| --- | --- | ---: |", " | ".join("---:" for _ in CONTACTS), "|")
    for gait, robot in CASES:
        ours, *others = exported_speeds(gait, robot, CONTACTS)
        cells = " | ".join(f"{other:.4f} ({other / ours:.2f})" for other in others)
        print(f"| `{gait}` | `{robot}` | {ours:.4f} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
