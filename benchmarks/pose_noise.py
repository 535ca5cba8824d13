"""How far noise and delay of an external pose move the metrics of a run.

The true poses of a simulated run go through the simulated tracker, the pose filter and the friction
estimate of a run with an external pose. The metrics of the filtered poses are compared with those
of the true ones. The walk does not react to the noise here: `snakewalk trials rehearse` shows that.

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
from snakewalk.config.world import FlatGround, FrictionConfig
from snakewalk.controller.kinematics.links import SpineLinks
from snakewalk.controller.mechanics.friction_filter import FoundFriction
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.measured_friction import MeasuredFriction
from snakewalk.controller.pose.sample import ArrivedPose
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.controller.pose.tracker import SimulatedTracker
from snakewalk.controller.pose.udp_feed import decoded
from snakewalk.controller.rehearsal.rehearsal import slip_alarms, with_head_poses
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


@dataclass(frozen=True, slots=True)
class Replay:
    """What a run with an external pose would have measured."""

    head_m: Floats
    """(P, 3) position of the head."""
    rotation: Floats
    """(P, 3, 3) its axes."""
    friction: FoundFriction | None
    """The last estimate of the friction; None on hills and before the first one."""
    contradicted: bool
    """Whether an estimate contradicted the friction of the world's file."""


def replayed(record: RunRecord, seed: int, tracker_config: TrackerConfig = TRACKER) -> Replay:
    """Send the true poses of a run through tracker, pose filter and friction estimate."""
    header, pose, cycle = record.header, record.pose, record.cycle
    config = header.robot.pose or PoseConfig()
    tracker = SimulatedTracker(tracker_config, TrackedBody(header.robot, config), seed)
    heading = float(np.arctan2(pose.rotation[0, 1, 0], pose.rotation[0, 0, 0]))
    start_m = (float(pose.head_m[0, 0]), float(pose.head_m[0, 1]))
    reckoning = DeadReckoning(header.robot, header.world.friction, start_m, heading)
    estimate = ExternalPose(header.robot, config, Feed(tracker), reckoning)
    rows = np.clip(np.searchsorted(cycle.time_s, pose.time_s), 0, len(cycle.time_s) - 1)
    delay_s = tracker_config.delay_s
    before = round(delay_s / record.period_s) + 3
    for k in range(before, -1, -1):  # it stands before torque is on
        time_s = float(pose.time_s[0]) - k * record.period_s
        tracker.measure(BodyPose(time_s, pose.head_m[0], pose.rotation[0]), cycle.measured_rad[0])
    head_m, rotation = np.empty_like(pose.head_m), np.empty_like(pose.rotation)
    spine, used = SpineLinks.of(header.robot), list[FrictionConfig]()
    is_level = isinstance(header.world.ground, FlatGround)
    friction = MeasuredFriction(header.world.friction, estimate.take_measured, used.append)
    last = None
    for k, row in enumerate(rows):
        time_s, joint_rad = float(pose.time_s[k]), cycle.measured_rad[row]
        head = BodyPose(time_s, pose.head_m[k], pose.rotation[k])
        if k:
            tracker.measure(head, joint_rad)
        found = estimate(state_of(record, int(row), time_s))
        head_m[k], rotation[k] = found.head_in_world_m, found.rotation
        if is_level:
            view = spine.in_world(found, joint_rad)
            last = friction.update(view, joint_rad) or last
    return Replay(head_m, rotation, last, bool(used))


def state_of(record: RunRecord, row: int, time_s: float) -> JointState:
    """Return the joint state of a cycle."""
    cycle, joints = record.cycle, record.header.robot.joint_count
    none, no = np.full(joints, np.nan), np.zeros(joints, np.uint8)
    measured = (cycle.measured_rad[row], cycle.velocity_rad_s[row], cycle.current_a[row])
    return JointState(
        *(time_s, *measured, none, none, no, no),
        *(np.zeros(joints), np.ones(joints, bool), none),
    )


def true_friction(record: RunRecord) -> FrictionConfig:
    """Return the friction of the simulated ground."""
    file, deviation = record.header.world.friction, record.header.run.deviation
    return FrictionConfig(
        along=file.along * deviation.friction_along,
        across=file.across * deviation.friction_across,
    )


def holds(found: FoundFriction, true: FrictionConfig) -> bool:
    """Whether both intervals contain the true friction."""
    (low, high), (least, most) = found.along_95, found.across_95
    return low <= true.along <= high and least <= true.across <= most


def friction_cells(replays: Sequence[Replay], true: FrictionConfig) -> str:
    """Return the cells about the friction."""
    known = [each.friction for each in replays if each.friction is not None]
    if not known:
        return "- | - | - | -"
    inside = sum(holds(each, true) for each in known)
    along = np.median([(*each.along_95, each.friction.along) for each in known], axis=0)
    ratios = [each.friction.across / each.friction.along for each in known]
    off = np.array(ratios) / (true.across / true.along) - 1.0
    return (
        f"{inside} of {len(replays)} | {along[2]:.3f} [{along[0]:.3f} {along[1]:.3f}] | "
        f"{100 * off.min():+.0f} to {100 * off.max():+.0f} | "
        f"{sum(each.contradicted for each in replays)}"
    )


def main() -> None:
    """Print a row for each run."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("logs", type=Path, nargs="+", help="log.mcap of a simulated run")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--correlation-s", type=float, default=0.0, help="of the noise")
    given = parser.parse_args()
    tracker = TRACKER.model_copy(update={"correlation_s": given.correlation_s})
    print(
        "| run | true friction | noise seeds | distance, % | cost, % | eta, % | speed, % | "
        "false alarms | true friction inside | along, median | across over along, % | "
        "file contradicted |"
    )
    print("| --- |" + " ---: |" * 11)
    for log in given.logs:
        record = read_log(log)
        same, moved_m = with_head_poses(record, record.pose.head_m, record.pose.rotation)
        true, true_alarms = summary(same), slip_alarms(same, moved_m)
        errors, false, replays = [], 0, list[Replay]()
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            replay = replayed(record, seed, tracker)
            replays.append(replay)
            noisy, moved_m = with_head_poses(record, replay.head_m, replay.rotation)
            numbers = summary(noisy)
            errors.append([100.0 * (getattr(numbers, key) / getattr(true, key) - 1.0)
                           for key in METRICS.values()])  # fmt: skip
            false += max(slip_alarms(noisy, moved_m) - true_alarms, 0)
        spans = [f"{low:+.1f} to {high:+.1f}" for low, high in
                 zip(np.min(errors, axis=0), np.max(errors, axis=0), strict=True)]  # fmt: skip
        friction = true_friction(record)
        cells = [
            *(f"`{record.header.run.name}`", f"{friction.along:.2g}, {friction.across:.2g}"),
            *(str(given.seeds), *spans, str(false), friction_cells(replays, friction)),
        ]
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
