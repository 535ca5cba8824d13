"""Motion sensors: whether current, velocity, position and goals of a joint contradict each other.

A constant sensor hides a current above its limit, a dead output stage, or a stalled joint. While a
joint moves, its other readings reveal it, and the run reports it. A joint that stands while its
goals swing is reported, too. It may be jammed although it pushes with its permitted current, as
joints do that the ground holds off. The run continues, because an obstacle may hold a sound joint.
"""

import math

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.compiling import compiled, readonly_array

CURRENT_READS = 25
CURRENT_TRAVEL_RAD = 0.5
BACK_RAD = 0.2
"""A sensor is dead if a current stays the same for that many reads and that much travel, part of it
back again (ours). Friction alone changes its sign when a joint turns back."""
SATURATED = 0.9
OVER_LIMIT = 1.5
"""Shares of a current limit between which the limit may keep a current constant (ours)."""
SPEED_READS = 25
MISMATCH_RAD = 0.15
MISMATCH_RAD_S = 0.1
"""Position and velocity contradict each other if one of them stays the same for that many reads.
The position must also differ from the integral of the velocity by this, and by this for each second
(ours). The coarsest velocity unit is 0.08 rad/s."""
SWUNG_RAD = 0.05
"""A constant position contradicts velocities above ``MISMATCH_RAD_S`` that together turn the joint
by this in each direction (ours). A velocity that decays late after a stop has one direction."""
STANDING_RAD = 0.02
STANDING_S = 3.0
GOALS_RAD = 0.25
"""A joint whose positions differ by at most ``STANDING_RAD`` for ``STANDING_S`` while its goals
differ by ``GOALS_RAD`` does not move (ours). The ground held sound joints off swings of 0.1 rad."""
WINDOW_S = 2.0
"""A comparison of position and velocity begins again after this time (ours)."""
LONGEST_STEP_S = 0.1
"""A comparison begins again after a longer pause, s (ours)."""
_FLOATS = readonly_array()
_CURRENT, _VELOCITY, _POSITION, _JOINT = range(4)


class MotionSensors:
    """Compares the readings of J joints; reports each sensor once."""

    def __init__(self, robot: RobotConfig) -> None:
        joints = robot.joint_count
        self._names = [robot.joint_label(joint) for joint in range(joints)]
        self._limits_a = np.array(robot.current_limits_a)
        self._last = np.full((3, joints), np.nan)
        self._since = np.zeros((3, 6, joints))
        self._standing = np.full((5, joints), np.nan)
        self._is_dead = np.zeros((4, joints), np.bool_)
        self._reported = self._is_dead.copy()
        self._time_s = -math.inf

    def update(self, motion: Floats, goal_rad: Floats, valid: Bools, time_s: float) -> list[str]:
        """Evaluate currents, velocities and positions (3, J); return lines to report.

        Units are A, rad/s and rad; NaN is unknown. ``goal_rad`` (J,) was sent before them, and
        ``valid`` (J,) marks joints read at ``time_s``.
        """
        step_s, self._time_s = time_s - self._time_s, time_s
        if not 0.0 < step_s <= LONGEST_STEP_S:
            self._last.fill(np.nan)
            self._standing.fill(np.nan)
        _compare(
            motion,
            valid,
            step_s,
            self._limits_a,
            self._last,
            self._since,
            self._is_dead,
        )
        _note_standing(
            motion[_POSITION], goal_rad, valid, step_s, self._standing, self._is_dead[_JOINT]
        )
        new = self._is_dead & ~self._reported
        if not new.any():
            return []
        self._reported |= new
        return [self._line(int(sensor), int(joint), motion) for sensor, joint in np.argwhere(new)]

    def _line(self, sensor: int, joint: int, motion: Floats) -> str:
        name = self._names[joint]
        if sensor == _JOINT:
            notes = self._standing[:, joint]
            return (
                f"{name}: has stood at {notes[2]:.2f} rad for {notes[0]:.1f} s, though its goals "
                f"changed from {notes[3]:.2f} to {notes[4]:.2f} rad: the ground or an obstacle "
                "holds it, or it is jammed; check that it turns freely"
            )
        value = motion[sensor, joint]
        if sensor == _CURRENT:
            what = f"current reads {value:.2f} A constantly, though the joint moves"
            effect = "nothing watches its load"
        elif sensor == _VELOCITY:
            what = f"velocity reads {value:.2f} rad/s constantly, though its position differs"
            effect = "a dead output stage may stay undetected"
        else:
            what = f"position reads {value:.2f} rad constantly, though its velocity is not 0"
            effect = "nothing watches whether it follows"
        return f"{name}: {what}: its sensor may be dead, and {effect}; stop the run and check it"


@compiled(
    f"void({readonly_array(dimensions=2)}, {readonly_array('boolean')}, float64, {_FLOATS},"
    " float64[:, ::1], float64[:, :, ::1], boolean[:, ::1])",
    makes_arrays=False,
)
def _compare(  # noqa: C901  a compiled loop
    motion: Floats,
    valid: Bools,
    step_s: float,
    limits_a: Floats,
    last: Floats,
    since: Floats,
    is_dead: Bools,
) -> None:
    """Note how long each reading stays constant, and how far its joint moves meanwhile.

    Args:
        motion: (3, J) currents, velocities, positions.
        valid: (J,) whether a joint was read; the others keep their notes.
        step_s: time since the previous readings.
        limits_a: (J,) limits of the current; infinite without one.
        last: (3, J) previous readings; NaN: begin again.
        since: (3, 6, J) since each reading changed: reads, time, and for the current travel and
            displacement, for the others displacement and integral of the velocity. Two further rows
            are turns by velocities in each direction since the position changed.
        is_dead: (4, J) sensors that contradict the others; extended.

    """
    for k in range(motion.shape[1]):
        if not valid[k]:
            continue
        moved = motion[2, k] - last[2, k]
        turned = 0.5 * (motion[1, k] + last[1, k]) * step_s
        if moved != 0.0 or np.isnan(turned):
            since[2, 4:, k] = 0.0
        elif abs(turned) > MISMATCH_RAD_S * step_s:
            since[2, 4 + int(turned > 0.0), k] += abs(turned)
        for n in range(3):
            begins = motion[n, k] != last[n, k] or np.isnan(moved) or np.isnan(turned)
            if n > 0 and since[n, 1, k] >= WINDOW_S:
                begins = True
            if begins:
                since[n, :4, k] = 0.0
            elif not is_dead[n, k]:
                since[n, 0, k] += 1.0
                since[n, 1, k] += step_s
                since[n, 2, k] += abs(moved) if n == 0 else moved
                since[n, 3, k] += moved if n == 0 else turned
                reads = since[n, 0, k]
                first = since[n, 2, k]
                second = since[n, 3, k]
                if n == 0:
                    is_dead[n, k] = (
                        reads >= CURRENT_READS
                        and first >= CURRENT_TRAVEL_RAD
                        and first - abs(second) >= BACK_RAD
                        and (
                            abs(motion[0, k]) < SATURATED * limits_a[k]
                            or abs(motion[0, k]) > OVER_LIMIT * limits_a[k]
                        )
                    )
                else:
                    limit = MISMATCH_RAD + MISMATCH_RAD_S * since[n, 1, k]
                    is_dead[n, k] = (
                        reads >= SPEED_READS
                        and abs(first - second) >= limit
                        and (n == 2 or first != 0.0)  # both constant: the position is reported
                    )
                    if n == 2 and reads >= SPEED_READS:
                        is_dead[n, k] |= min(since[n, 4, k], since[n, 5, k]) >= SWUNG_RAD
            last[n, k] = motion[n, k]


@compiled(
    f"void({_FLOATS}, {_FLOATS}, {readonly_array('boolean')}, float64, float64[:, ::1],"
    " boolean[::1])",
    makes_arrays=False,
)
def _note_standing(
    position_rad: Floats,
    goal_rad: Floats,
    valid: Bools,
    step_s: float,
    standing: Floats,
    is_stuck: Bools,
) -> None:
    """Note how long each joint stands, and how its goals change meanwhile.

    ``standing`` (5, J): time, least and greatest position, least and greatest goal; NaN: begin
    again. ``is_stuck`` (J,) is extended by joints that do not follow their goals.
    """
    for k in range(len(valid)):
        if not valid[k]:
            continue
        standing[0, k] += step_s
        for m, angle_rad in ((1, position_rad[k]), (3, goal_rad[k])):
            standing[m, k] = min(standing[m, k], angle_rad)
            standing[m + 1, k] = max(standing[m + 1, k], angle_rad)
        if np.isnan(standing[0, k]) or standing[2, k] - standing[1, k] > STANDING_RAD:
            standing[0, k] = 0.0
            standing[1:3, k] = position_rad[k]
            standing[3:, k] = goal_rad[k]
        is_stuck[k] |= standing[0, k] >= STANDING_S and standing[4, k] - standing[3, k] >= GOALS_RAD
