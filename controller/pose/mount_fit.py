"""Where a source's frame lies in the world, and its body on a link, from a known motion.

The link of the tracked body turns and moves in the plane of the ground. Its turning shows delay and
vertical axis; its way shows heading, scale and mount. Dead reckoning under several frictions
predicts the way, and the best of them counts. The scale depends on the friction: it is known only
if the friction of the file predicts the way clearly better than any other.
"""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.friction_law import LAWS
from snakewalk.config.pose import Metres3, PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.dead_reckoning import DeadReckoning

DELAYS_S = np.arange(0.0, 0.8, 0.005)
"""Delays that are tried."""
SHARE = 0.8
"""Least share of the turning that the joints explain (ours)."""
TURN = (0.8, 1.25)
"""Measured turning over that of the joints (ours)."""
FRICTION = (1.0, 0.5, 0.7, 1.4, 2.0)
"""Factors on the friction along the body that are tried (ours)."""
CLEAR = 1.03
"""Residual of any other friction over that of the file's, from which on the file's is the true one
(ours)."""
LIKELY = 1.25
"""Residual of a friction over the least, up to which it is possible (ours)."""
SCALE_OFF = 0.08
"""Error of the scale under the best friction, since links press unevenly on the ground (measured:
``benchmarks.pose_mounts``)."""
MOUNT_OFF = 1.25
"""Largest error of the mount over the residual (measured: ``benchmarks.pose_mounts``)."""
WORLD_SD_DEG = 1.0
"""Standard deviation of the axes: 0.9 degrees (measured: ``benchmarks.pose_mounts``)."""
MIRRORED = 0.8
"""Residual of a mirrored frame over that of a right-handed one, below which it is one (ours)."""


class Mount(NamedTuple):
    """A source, as its motion shows it."""

    residual_m: float
    """Root mean square distance from the motion."""
    config: PoseConfig
    """The height in ``offset_m`` is that above the source's origin."""


def predicted_ways(
    robot: RobotConfig, file: FrictionConfig, times_s: Floats, joints_rad: Floats, link: int
) -> Iterator[Floats]:
    """Yield x, y and heading (n, 3) of a link under each law and several sizes of the friction.

    The head begins at 0, 0, and the body points along x. The friction of the file comes first.
    """
    for law, factor in product(dict.fromkeys((file.law, *LAWS)), FRICTION):
        friction = file.model_copy(update={"law": law, "along": factor * file.along})
        reckoning = DeadReckoning(robot, friction, (0.0, 0.0), 0.0)
        way = []
        for time_s, joint_rad in zip(times_s, joints_rad, strict=True):
            view = body_in_world(robot, reckoning.advance(time_s, joint_rad), joint_rad)
            way.append([*view.link_m[link, :2], view.headings_rad[link]])
        yield np.array(way)


def scale_interval(mounts: Sequence[Mount]) -> tuple[float, float] | None:
    """Return the least and largest scale of ``predicted_ways``; None if the scale is known."""
    off_m = [mount.residual_m for mount in mounts]
    if off_m[0] * CLEAR < min(off_m[1:]):
        return None
    scales = [mount.config.scale for mount in mounts if mount.residual_m < LIKELY * min(off_m)]
    return min(scales) * (1.0 - SCALE_OFF), max(scales) * (1.0 + SCALE_OFF)


def fit_mount(
    time_s: Floats,
    way: Floats,
    stamp_s: Floats,
    place_m: Floats,
    rotation: Floats,
    known_scale: float | None = None,
) -> Mount:
    """Fit poses (m, 3), (m, 3, 3) with stamps (m,) of the run's clock to a motion.

    ``way`` (n, 3) has x, y and heading of the link at ``time_s`` (n,). A ``known_scale`` is not
    fitted.

    Raises:
        InputError: another body moves, or the frame is left-handed.

    """
    known = (stamp_s > time_s[0] + DELAYS_S[-1]) & (stamp_s < time_s[-1])
    stamp_s, place_m, body = stamp_s[known], place_m[known], Rotation.from_matrix(rotation[known])
    slow = np.column_stack([np.ones(len(stamp_s)), stamp_s - stamp_s[0]])
    turns = (body * body.mean().inv()).as_rotvec()
    way_m = way[:, 0] + 1j * way[:, 1]
    headings_rad = np.unwrap(way[:, 2])

    def turned(delay_s: float) -> tuple[float, Floats, Floats]:
        heading_rad = np.interp(stamp_s - delay_s, time_s, headings_rad)
        parts, off = _solved(np.column_stack([heading_rad, slow]), turns)
        return off, parts, heading_rad

    offs = np.array([turned(delay_s)[0] for delay_s in DELAYS_S])
    near = np.abs(DELAYS_S - DELAYS_S[offs.argmin()]) < 0.03
    square, line, _ = np.polyfit(DELAYS_S[near], offs[near], 2)
    delay_s = max(-0.5 * line / square, 0.0)
    off, parts, heading_rad = turned(delay_s)
    turn = np.linalg.norm(parts[0])
    explained = 1.0 - off**2 / (float(np.sum(turns.var(axis=0))) or 1.0)
    if not (explained > SHARE and TURN[0] < turn < TURN[1]):
        raise InputError(
            f"the tracked body turns {turn:.2f} times as far as the joints turn its link, and they "
            f"explain {100 * max(explained, 0.0):.0f} % of its turning: it is another body, or on "
            "another link (pose.link)"
        )
    upright = Rotation.align_vectors([0.0, 0.0, 1.0], parts[0])[0]
    level_m = upright.apply(place_m)
    drift_rad = upright.apply(parts[2])[2] / turn * slow[:, 1]
    heading_rad += drift_rad
    link_m = np.interp(stamp_s - delay_s, time_s, way_m)
    link_m = link_m[0] + np.cumsum(np.diff(link_m, prepend=link_m[:1]) * np.exp(1j * drift_rad))
    columns = np.column_stack([link_m, np.exp(1j * heading_rad), slow])
    seen_m = level_m[:, 0] + 1j * level_m[:, 1]
    (scale, lever, origin, _), off_m = _solved(columns, seen_m)
    world = Rotation.from_euler("z", -np.angle(scale)) * upright
    offset = (Rotation.from_euler("z", -heading_rad[:, None]) * world * body).mean()
    height_m = float(world.apply(place_m)[:, 2].mean())
    if height_m < 0.0 or _solved(columns, seen_m.conj())[1] < MIRRORED * off_m:
        raise InputError("mirrored axes: send a right-handed frame whose origin is on the ground")
    if known_scale is not None:
        scale /= abs(scale) * known_scale
        (lever, origin, _), off_m = _solved(columns[:, 1:], seen_m - scale * link_m)
    size = float(abs(scale))
    config = PoseConfig(
        world_m=_rounded(-origin / scale, 0.0),
        world_deg=tuple(world.as_euler("xyz", degrees=True).round(3).tolist()),
        world_sd_deg=WORLD_SD_DEG,
        offset_m=_rounded(lever / scale, height_m / size),
        offset_deg=tuple(offset.as_euler("xyz", degrees=True).round(3).tolist()),
        scale=round(1.0 / size, 4),
        latency_s=round(float(delay_s), 4),
    )
    return Mount(off_m / size, config)


def _rounded(place_m: complex, height_m: float) -> Metres3:
    return round(float(place_m.real), 4), round(float(place_m.imag), 4), round(height_m, 4)


def _solved(columns: Floats, values: Floats) -> tuple[Floats, float]:
    """Return coefficients of the columns, and the root mean square length of the remainder."""
    coefficients = np.asarray(np.linalg.lstsq(columns, values)[0], dtype=values.dtype)
    off = np.linalg.norm(values - columns @ coefficients)
    return coefficients, float(off) / len(values) ** 0.5
