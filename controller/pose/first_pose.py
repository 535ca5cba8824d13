"""The first pose of an external source, before torque, compared with the start of the run."""

from collections.abc import Callable, Iterable

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
from snakewalk.controller.pose.senders import Senders
from snakewalk.controller.pose.tracked_body import tracked_link
from snakewalk.drivers.clock import Clock

WAIT_S = 5.0
"""Longest wait for the first pose (ours)."""
LOOK_S = 0.02
WATCH_S = 2.0
"""Time for which the poses of a robot at rest are watched (ours)."""
WATCHES = 3
"""Times that they are watched: a limp body settles on rough ground, a source drifts on (ours)."""
BLOCKS = 8
DRIFT_M_S = 0.01
DRIFT_SD = 5.0
"""Smallest speed of a robot at rest that is drift of its source, also in standard deviations
(ours). It comes from the means of ``BLOCKS`` parts of the time."""
LEAST_UP = 0.5
"""Least cosine between the link's up axis and the vertical (ours)."""
UNIT_M = 10.0
"""Distance from the start above which millimetres are considered (ours)."""
HEIGHT_M = 0.3
"""Largest distance of the first pose from the height of the ground (ours)."""


def await_first_pose(
    source: str,
    feed: PoseFeed,
    clock: Clock,
    judge: Callable[[PoseSample], str | None],
    host: str | None = None,
) -> list[ArrivedPose]:
    """Wait for the first pose, and watch the next ones at rest; returns the newest message.

    Poses of another sender are ignored; ``host`` is the only host whose poses count.

    Raises:
        InputError: none arrives, none can be read, ``judge`` returns why it cannot be right, or
            the robot that rests seems to move.

    """
    until_s = clock.now_s() + WAIT_S
    senders = Senders(host)
    reason = ""
    while clock.now_s() < until_s:
        for arrival in _of_source(feed, clock, senders):
            if isinstance(arrival.sample, UnusablePoseError):
                reason = str(arrival.sample)
                continue
            fault = judge(arrival.sample)
            if fault is not None:
                raise InputError(f"pose {source}: {fault}")
            return _watched_poses(source, feed, clock, senders, arrival)
        clock.sleep_until_s(clock.now_s() + LOOK_S)
    raise InputError(
        f"pose {source}: no usable pose within {WAIT_S:g} s: "
        f"{reason or 'nothing arrived; start the sender, or correct its address'}"
    )


def _of_source(feed: PoseFeed, clock: Clock, senders: Senders) -> list[ArrivedPose]:
    return [each for each in feed.arrived(clock.now_s()) if senders.place(each).order != "other"]


def _watched_poses(
    source: str, feed: PoseFeed, clock: Clock, senders: Senders, first: ArrivedPose
) -> list[ArrivedPose]:
    """Receive the poses of a robot at rest, whose source should not drift.

    Raises:
        InputError: the poses move.

    """
    arrived = [first]
    for _ in range(WATCHES):
        until_s = clock.now_s() + WATCH_S
        arrived = arrived[-1:]
        while clock.now_s() < until_s:
            clock.sleep_until_s(clock.now_s() + LOOK_S)
            arrived += _of_source(feed, clock, senders)
        fault = drift_fault([m.sample for m in arrived if isinstance(m.sample, PoseSample)])
        if fault is None:
            return arrived[-1:]
    raise InputError(f"pose {source}: {fault}")


def drift_fault(samples: list[PoseSample]) -> str | None:
    """Return how fast the poses of a robot at rest move; None if they rest, too."""
    if len(samples) < 2 * BLOCKS:
        return None
    time_s = np.array([sample.time_s for sample in samples])
    place_m = np.array([sample.position_m for sample in samples])
    blocks = np.array_split(np.arange(len(samples)), BLOCKS)
    at_s = np.array([time_s[rows].mean() for rows in blocks])
    if not np.ptp(at_s):
        return None  # the stamps are equal
    mean_m = np.array([place_m[rows].mean(axis=0) for rows in blocks])
    lines, covariance = np.polyfit(at_s - at_s.mean(), mean_m, 1, cov=True)
    sd_m_s = np.sqrt(covariance[0, 0].mean())
    speed_m_s = np.linalg.norm(lines[0])
    if not speed_m_s > max(DRIFT_M_S, DRIFT_SD * sd_m_s):
        return None
    return (
        f"the torque is off, and the pose moves by {100.0 * speed_m_s:.1f} cm/s; lay the robot "
        "where it does not slide, or wait until the source does not drift"
    )


def start_fault(
    sample: PoseSample,
    robot: RobotConfig,
    config: PoseConfig,
    start_m: tuple[float, float],
    ground_m: Callable[[float, float], float],
    straight_rad: float | None = None,
) -> str | None:
    """Return why a pose cannot be that of the robot at the start of a run, or None.

    Args:
        sample: the first pose.
        robot: the robot, which lies on its belly.
        config: its tracked body.
        start_m: where the head starts.
        ground_m: height of the ground at a place.
        straight_rad: heading of a straight body at the start; None: only place and axes are judged,
            because the joints are not known.

    """
    if config.frame is not None and sample.frame != config.frame:
        return f"wrong frame: {sample.frame!r}, expected {config.frame!r} (pose.frame)"
    link_m, link = tracked_link(sample, config)
    reach_m = config.start_m + (robot.length_m if config.link else 0.0)
    away_m = float(np.hypot(*(link_m[:2] - start_m)))
    small_m = link_m + (1e-3 - 1.0) * config.scale * (turned(config.world_deg) @ sample.position_m)
    if away_m > UNIT_M and np.hypot(*(small_m[:2] - start_m)) <= reach_m:
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
    turned_deg = 0.0
    where = f"at {_places(link_m[:2])}"
    if straight_rad is not None:
        turned_deg = np.degrees(np.angle(complex(*link[:2, 0]) * np.exp(-1j * straight_rad)))
        off = complex(*(link_m[:2] - start_m)) * np.exp(-1j * straight_rad)
        where = (
            f"{abs(off.real):.2f} m {'ahead of' if off.real > 0.0 else 'behind'} its start and "
            f"{abs(off.imag):.2f} m to the {'left' if off.imag > 0.0 else 'right'}, turned by "
            f"{turned_deg:+.0f} degrees if its body is straight"
        )
    if away_m > reach_m or abs(turned_deg) > config.start_deg:
        return (
            f"the robot is {where}, {away_m:.2f} m from the start of the run at "
            f"{_places(start_m)}; put it there, or correct pose.world_m and pose.world_deg"
        )
    over_m = link_m[2] - ground_m(float(link_m[0]), float(link_m[1]))
    if abs(over_m) > HEIGHT_M:
        return (
            f"wrong frame: the link is {over_m:+.2f} m above the ground; correct pose.world_m or "
            "pose.offset_m"
        )
    return None


def _places(values: Iterable[float]) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in values) + ")"
