"""The first pose of an external source, before torque, compared with the start of the run."""

from collections.abc import Callable
from typing import Final

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.pose.sample import (
    ArrivedPose,
    PoseFeed,
    PoseSample,
    UnusablePoseError,
    turned,
)
from snakewalk.drivers.clock import Clock

WAIT_S: Final = 5.0
"""How long the first pose is awaited (ours)."""
LOOK_S: Final = 0.02
LEAST_UP: Final = 0.5
"""Least cosine between the link's up axis and the vertical (ours)."""
HEIGHT_M: Final = 0.3
"""Largest distance of the first pose from the height of the ground (ours)."""


def await_first_pose(
    source: str, feed: PoseFeed, clock: Clock, judge: Callable[[PoseSample], str | None]
) -> list[ArrivedPose]:
    """Wait for the first pose; returns all that have arrived.

    Raises:
        InputError: none arrives, none can be read, or ``judge`` returns why it cannot be right.

    """
    until_s = clock.now_s() + WAIT_S
    arrived = list[ArrivedPose]()
    reason = ""
    while clock.now_s() < until_s:
        for arrival in feed.arrived(clock.now_s()):
            arrived.append(arrival)
            if isinstance(arrival.sample, UnusablePoseError):
                reason = str(arrival.sample)
                continue
            fault = judge(arrival.sample)
            if fault is not None:
                raise InputError(f"pose {source}: {fault}")
            return arrived
        clock.sleep_until_s(clock.now_s() + LOOK_S)
    raise InputError(
        f"pose {source}: no usable pose within {WAIT_S:g} s: "
        f"{reason or 'nothing arrived; start the sender, or correct its address'}"
    )


def start_fault(
    sample: PoseSample,
    robot: RobotConfig,
    config: PoseConfig,
    start_m: tuple[float, float],
    ground_m: Callable[[float, float], float],
) -> str | None:
    """Return why a pose cannot be that of the robot at the start of a run, or None.

    Args:
        sample: the first pose.
        robot: the robot, which lies on its belly.
        config: its tracked body.
        start_m: where the head starts.
        ground_m: height of the ground at a place.

    """
    if config.frame is not None and sample.frame != config.frame:
        return f"wrong frame: {sample.frame!r}, expected {config.frame!r} (pose.frame)"
    world = turned(config.world_deg)
    body_m = np.array(config.world_m) + world @ sample.position_m
    link = world @ sample.rotation @ turned(config.offset_deg).T
    link_m = body_m - link @ np.array(config.offset_m)
    reach_m = config.start_m + (robot.length_m if config.link else 0.0)
    away_m = float(np.hypot(*(link_m[:2] - start_m)))
    start = f"({start_m[0]:.2f}, {start_m[1]:.2f})"
    small_m = np.array(config.world_m) + world @ (1e-3 * sample.position_m)
    if away_m > reach_m and float(np.hypot(*(small_m[:2] - start_m))) <= reach_m:
        return (
            f"wrong unit: position {_places(sample.position_m)} looks like millimetres; send metres"
        )
    up = link[:, 2]
    if up[2] < LEAST_UP:
        axis = "xyz"[int(np.abs(up).argmax())]
        hint = "; for a source whose y axis points up, set pose.world_deg = [90, 0, 0]"
        return (
            f"wrong frame: the link's up axis points along {axis} of the world"
            f"{hint if axis == 'y' else ''}; correct pose.world_deg or pose.offset_deg"
        )
    if away_m > reach_m:
        return (
            f"the robot is at {_places(link_m[:2])}, {away_m:.2f} m from the start of the run at "
            f"{start}; put it there, or correct pose.world_m"
        )
    over_m = float(link_m[2]) - ground_m(float(link_m[0]), float(link_m[1]))
    if abs(over_m) > HEIGHT_M:
        return (
            f"wrong frame: the link is {over_m:+.2f} m above the ground; correct pose.world_m or "
            "pose.offset_m"
        )
    return None


def _places(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in values) + ")"
