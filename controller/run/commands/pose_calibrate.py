"""``snakewalk pose calibrate``: frame, mount and delay of a source, from a known motion."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, Robot, RunPort, World, show
from snakewalk.controller.console.result_files import refuse_to_overwrite, write_result
from snakewalk.controller.kinematics.smoothstep import cubic
from snakewalk.controller.motion.parted_recording import recording
from snakewalk.controller.pose.mount_fit import (
    MOUNT_OFF,
    fit_mount,
    predicted_ways,
    scale_interval,
)
from snakewalk.controller.pose.sample import ArrivedPose, PoseFeed, PoseSample, turned
from snakewalk.controller.pose.sender_clock import SenderClock
from snakewalk.controller.run.backend import RehearsedPort
from snakewalk.controller.run.external.external_source import ExternalSource
from snakewalk.controller.run.factory import prepare_source
from snakewalk.controller.run.kinds.source_run import SourceRun
from snakewalk.controller.run.pose_provider import pose_plugin
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.clock import WallClock

SECONDS = 10.0
SWING_RAD = 0.7
"""Amplitude of the head's joint; that of the neck is half of it (ours)."""
SWING_RAD_S = 2.5
"""Frequency of the head; that of the neck is 0.61 of it (ours)."""
NECK = slice(1, 4)
"""Joints of the neck among those behind the head's: they move the head aside."""
LEAST = 100
"""Least number of poses (ours)."""
REST_S, NOD_S = 1.0, 3.0
NOD_RAD = 0.35
"""Rest after the swing, and duration and angle of the nod of each of two pitch joints (ours)."""
SEEN_RAD = 0.1
"""Least turn of a body that was seen to nod (ours)."""


@command(
    "pose calibrate",
    examples=("pose calibrate udp:9870 --port /dev/ttyUSB0 --robot my-robot.toml -o tracked.toml",),
    results=("out",),
)
def calibrate_source(
    source: Annotated[str, typer.Argument(help="external pose source, as for `run --pose`")],
    port: RunPort = None,
    robot: Robot = None,
    world: World = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="write the robot with its pose source here (.toml)"),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Swing the head for 10 s, and find the source's axes, scale, mount and delay.

    A robot with pitch joints then lifts its head, which shows whether the vertical is mirrored.

    The robot lies straight on level ground. The place of its head becomes 0, 0, and it points along
    x. Another body, and a left-handed frame, end the command with exit code 2.
    """
    plugin, argument = pose_plugin(source)
    if not isinstance(plugin, ExternalSource) or port is None:
        raise InputError(
            f"pose calibrate {source}: needs a source of another program, such as udp:9870, and "
            "--port; for the lens of a camera use snakewalk pose lens"
        )
    refuse_to_overwrite([out], force)
    prepared = prepare_calibration(robot, world)
    with closing(plugin.open_feed(argument, WallClock())) as feed:
        config, residual_m = calibrated(prepared, port, feed)
    if out is not None:
        described = prepared.robot.model_copy(update={"pose": config})
        write_result(out, plain_toml(described, f"Found by snakewalk pose calibrate {source}."))
    show(
        {
            "body": "the tracked body is {:+.3f} m ahead of the centre of its link, {:+.3f} m "
            "left, {:+.3f} m up, within {:.3f} m".format(*config.offset_m, MOUNT_OFF * residual_m),
            "ground": "the source's origin is {:+.3f} m ahead of the head's first place, {:+.3f} m "
            "left".format(*config.world_m),
            "pose": config.model_dump(exclude_defaults=True),
            "residual_m": round(residual_m, 4),
        },
        as_json,
    )


def prepare_calibration(robot: str | None, world: str | None) -> SourceRun:
    """Prepare the motion."""
    return prepare_source(
        lambda body: recording(body, *_swing(body)),
        robot=robot,
        world=world,
        seconds=40.0,
    )


def calibrated(
    prepared: SourceRun, port: str | RehearsedPort, feed: PoseFeed
) -> tuple[PoseConfig, float]:
    """Run the motion, and fit the poses that arrive; returns the source and the fit's residual, m.

    Raises:
        InputError: the run was stopped, few poses arrived, or they are not of this robot.

    """
    arrived: list[ArrivedPose] = []
    result = run_robot(
        RunRequest(
            prepared, port=port, on_progress=lambda progress: arrived.extend(feed.arrived(0.0))
        )
    )
    rows = []
    clock = SenderClock()
    for each in arrived:
        sample = each.sample
        if isinstance(sample, PoseSample):
            clock.add(sample.time_s, each.arrival_s)
            local_s = clock.local_s(sample.time_s, each.arrival_s)
            rows.append((local_s, sample.position_m, sample.rotation))
    if result.outcome.tripped or len(rows) < LEAST:
        raise InputError(f"pose calibrate: {result.outcome.tripped or 'few poses arrived'}")
    robot = prepared.robot
    before = robot.pose or PoseConfig()
    stamps_s, places_m, rotations = (np.array(column) for column in zip(*rows, strict=True))
    cycle = result.record.cycle
    nodded_s = cycle.time_s[(cycle.sent_rad[:, robot.pitch_joints[:2]] > 0.9 * NOD_RAD).any(1)]
    swung_s = nodded_s[0] - REST_S if len(nodded_s) else np.inf
    swings, poses = cycle.time_s < swung_s, stamps_s < swung_s
    time_s = cycle.time_s[swings]
    ways = list(
        predicted_ways(
            robot, prepared.world.friction, time_s, cycle.measured_rad[swings], before.link
        )
    )
    seen = stamps_s[poses], places_m[poses], rotations[poses]
    fits = [fit_mount(time_s, way, *seen) for way in ways]
    stated = fits
    interval = scale_interval(fits)
    if interval is not None:
        low, high = interval
        if "scale" not in before.model_fields_set or not low <= before.scale <= high:
            raise InputError(
                f"pose calibrate: friction hides the scale: the poses show {low:.3g} to "
                f"{high:.3g}; measure it, and state pose.scale in the robot file (1 if it is in "
                "exact metres)"
            )
        stated = [fit_mount(time_s, way, *seen, before.scale) for way in ways]
        fits += stated
    mount = min(stated, key=lambda fit: fit.residual_m)
    if len(nodded_s):
        late_s = nodded_s[[0, -1]] + (mount.config.latency_s or 0.0)
        nodding = (stamps_s > late_s[0]) & (stamps_s < late_s[1])
        resting = poses & (stamps_s > swung_s - 0.5)
        _check_vertical(mount.config, rotations[resting], rotations[nodding])
    # fits with a fitted and with a stated scale are off to opposite sides: the size of the way
    # depends on the friction, and what is wrong with it goes into the offset
    weights = [fit.residual_m**-6.0 for fit in fits]
    *level_m, _ = np.average([fit.config.offset_m for fit in fits], 0, weights).round(4).tolist()
    offset_m = *level_m, round(mount.config.offset_m[2] - robot.body_radius_m, 4)
    found = mount.config.model_dump(exclude_unset=True) | {"offset_m": offset_m}
    return before.model_copy(update=found), mount.residual_m


def _check_vertical(config: PoseConfig, before: Floats, during: Floats) -> None:
    """Compare rotations (n, 3, 3) before a nod with those (m, 3, 3) while the head is lifted.

    Raises:
        InputError: the head went down.

    """
    if not len(before) or not len(during):
        return
    lifted, level = (Rotation.from_matrix(each).mean() for each in (during, before))
    turn = turned(config.world_deg) @ (lifted * level.inv()).as_rotvec()
    if turn[1] > SEEN_RAD:  # about the axis to the left, which lowers a head that points along x
        raise InputError("mirrored axes: the head was lifted, and its poses go down; send z up")


def _swing(robot: RobotConfig) -> tuple[Floats, Floats]:
    """Return times (n,) and angles (n, J): head and neck swing; then the head is lifted."""
    nods = robot.pitch_joints[:2]
    time_s = np.arange(0.0, SECONDS + (REST_S + NOD_S if nods else 0.0), 0.04)
    amplitude_rad = SWING_RAD * cubic(np.clip(np.minimum(time_s, SECONDS - time_s), 0.0, 1.0))
    nod = np.clip((time_s - SECONDS - REST_S) / NOD_S, 0.0, 1.0)
    angle = SWING_RAD_S * time_s
    joint_rad = np.zeros((len(time_s), robot.joint_count))
    head, *neck = robot.yaw_joints
    joint_rad[:, head] = amplitude_rad * np.sin(angle)
    joint_rad[:, neck[NECK]] = (0.5 * amplitude_rad * np.sin(0.61 * angle + 0.7))[:, None]
    joint_rad[:, nods] = (NOD_RAD * np.sin(np.pi * nod) ** 2)[:, None]
    return time_s, joint_rad
