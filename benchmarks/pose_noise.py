"""How far noise and delay of an external pose move the metrics of a run.

The true poses of a simulated run go through the simulated tracker and the pose filter of a run with
an external pose; the metrics of the filtered poses are compared with those of the true ones. The
walk does not react to the noise here: `snakewalk rehearse` shows that.

Run: .venv/bin/snakewalk run flat-slalom --no-film --out runs/slalom
     .venv/bin/python -m benchmarks.pose_noise runs/slalom/log.mcap --seeds 20 --first-seed 500
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.pose import PoseConfig, TrackerConfig
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.sample import ArrivedPose
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.controller.pose.tracker import SimulatedTracker
from snakewalk.controller.pose.udp_feed import decoded
from snakewalk.controller.rehearsal.metric_errors import slip_alarms, with_head_poses
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose, JointState

TRACKER = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
METRICS = {
    "distance": "travelled_m",
    "cost": "electrical_cost_of_transport",
    "eta": "eta",
    "speed": "speed_m_s",
}


@dataclass
class Feed:
    """The datagrams of a tracker as they arrive."""

    tracker: SimulatedTracker

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses that have arrived by now."""
        return [decoded(sent.data, "127.0.0.1:1", sent.due_s) for sent in self.tracker.due(now_s)]


def filtered(record: RunRecord, seed: int) -> tuple[Floats, Floats]:
    """Return the poses (P, 3), (P, 3, 3) of the head that an external source gives."""
    header, pose, cycle = record.header, record.pose, record.cycle
    config = header.robot.pose or PoseConfig()
    tracker = SimulatedTracker(TRACKER, TrackedBody(header.robot, config), seed)
    heading = float(np.arctan2(pose.rotation[0, 1, 0], pose.rotation[0, 0, 0]))
    start_m = (float(pose.head_m[0, 0]), float(pose.head_m[0, 1]))
    reckoning = DeadReckoning(header.robot, header.world.friction, start_m, heading)
    estimate = ExternalPose(header.robot, config, Feed(tracker), reckoning)
    rows = np.clip(np.searchsorted(cycle.time_s, pose.time_s), 0, len(cycle.time_s) - 1)
    delay_s = TRACKER.delay_s
    before = round(delay_s / record.period_s) + 3
    for k in range(before, -1, -1):  # it stands before torque is on
        time_s = float(pose.time_s[0]) - k * record.period_s
        tracker.measure(BodyPose(time_s, pose.head_m[0], pose.rotation[0]), cycle.measured_rad[0])
    head_m, rotation = np.empty_like(pose.head_m), np.empty_like(pose.rotation)
    for k, row in enumerate(rows):
        time_s, joint_rad = float(pose.time_s[k]), cycle.measured_rad[row]
        head = BodyPose(time_s, pose.head_m[k], pose.rotation[k])
        if k:
            tracker.measure(head, joint_rad)
        found = estimate(state_of(record, int(row), time_s))
        head_m[k], rotation[k] = found.head_in_world_m, found.rotation
    return head_m, rotation


def state_of(record: RunRecord, row: int, time_s: float) -> JointState:
    """Return the joint state of a cycle."""
    cycle, joints = record.cycle, record.header.robot.joint_count
    none, no = np.full(joints, np.nan), np.zeros(joints, np.uint8)
    measured = (cycle.measured_rad[row], cycle.velocity_rad_s[row], cycle.current_a[row])
    return JointState(
        *(time_s, *measured, none, none, no, no),
        *(np.zeros(joints), np.ones(joints, bool), none),
    )


def main() -> None:
    """Print a row for each seed, and the largest errors."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("logs", type=Path, nargs="+", help="log.mcap of a simulated run")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args()
    print("| run | noise seeds | distance, % | cost, % | eta, % | speed, % | false alarms |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for log in given.logs:
        record = read_log(log)
        same, moved_m = with_head_poses(record, record.pose.head_m, record.pose.rotation)
        true, true_alarms = summary(same), slip_alarms(same, moved_m)
        errors, false = [], 0
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            noisy, moved_m = with_head_poses(record, *filtered(record, seed))
            numbers = summary(noisy)
            errors.append([100.0 * (getattr(numbers, key) / getattr(true, key) - 1.0)
                           for key in METRICS.values()])  # fmt: skip
            false += max(slip_alarms(noisy, moved_m) - true_alarms, 0)
        spans = [f"{low:+.1f} to {high:+.1f}" for low, high in
                 zip(np.min(errors, axis=0), np.max(errors, axis=0), strict=True)]  # fmt: skip
        print(f"| `{record.header.run.name}` | {given.seeds} | {' | '.join(spans)} | {false} |")


if __name__ == "__main__":
    main()
