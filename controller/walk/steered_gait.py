"""A steered gait: a gait with a turn follows a path through waypoints.

[KP] 4.4 bends the motion of its animals along a path. Here a parameter of the gait turns it, from
the measured pose in every cycle.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait, Needs
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.rate_limiter import RateLimiter
from snakewalk.controller.motion.source import Pace
from snakewalk.controller.motion.stop_profile import StopProfile
from snakewalk.controller.motion.turned_gait import (
    TURN_PER_S2,
    TURN_RATE_PER_S,
    rate_beside_turn,
    turned,
)
from snakewalk.controller.walk.course import Course, OnCourse, aim_rad

TURN_LIMIT = 1.4
"""Limit of the gait's turn (ours): a trot turns on an arc of 0.4 m; a swimming spine bends by as
many radians."""
TURN_PER_RAD = 3.0
"""Turn per error of the heading (ours)."""
CYCLES_PER_BODY = 4.0
"""Cycles per body length of travel: a trot makes 0.24 to 0.42 lengths a cycle."""


class SteeredGait(OnCourse):
    """A ``MotionSource`` with ``PathProgress``: it rests when all waypoints are reached."""

    pulse_m_s = 0.0
    decision: Decision | None = None

    def __init__(
        self,
        gait: Gait,
        robot: RobotConfig,
        course: Course,
        carrot_m: float,
        *,
        cycles: float = 0.0,
    ) -> None:
        """Begin at phase 0, straight.

        The course has seen ``cycles`` before. The body aims ``carrot_m`` ahead on the path.

        Raises:
            InputError: as ``check_turns``.

        """
        check_turns(gait, robot)
        super().__init__(course)
        assert gait.steered_by is not None
        self._key = gait.steered_by
        self._gait = gait
        self._robot = robot
        self._carrot_m = carrot_m
        cycle = GaitCycle(gait, robot)
        self._rate_rad_s = cycle.rate_rad_s * rate_beside_turn(gait, self._key, robot, cycle.pace())
        self._turn = RateLimiter(np.zeros(1), TURN_RATE_PER_S, TURN_PER_S2)
        self._stop_profile = StopProfile()
        self._phase_rad = 0.0
        self.cycles = cycles
        """Number of cycles of the gait on this course."""

    @property
    def needs(self) -> Needs:
        """Needs of the gait."""
        return self._gait.needs

    @property
    def done(self) -> bool:
        """Whether every waypoint has been reached and the gait is at rest."""
        return self._stop_profile.over

    @property
    def turn(self) -> float:
        """Current turn of the gait."""
        return float(self._turn.angle_rad[0])

    @property
    def frequency_hz(self) -> float:
        """Cycles per second at full rate: as configured, or as the joints allow in a turn."""
        return float(self._rate_rad_s / TURN)

    def begin(self, view: BodyView) -> Floats:
        """(J,) first targets, whatever the ground."""
        return self.goal_rad()

    def goal_rad(self) -> Floats:
        """(J,) current joint targets."""
        return self._joints_rad(self._phase_rad, self.turn)

    def velocity_rad_s(self) -> Floats:
        """(J,) central difference over 4e-4 s of phase and turn."""
        rate = self._rate_rad_s * self._stop_profile.rate
        half_s = 2e-4
        turning = float(self._turn.speed_rad_s[0])
        before, after = (
            self._joints_rad(self._phase_rad + at_s * rate, self.turn + at_s * turning)
            for at_s in (-half_s, half_s)
        )
        return (after - before) / (2.0 * half_s)

    def pace(self) -> Pace:
        """The robot's limits, because the next turn is unknown."""
        return Pace.limit(self._robot)

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` and return the new targets (J,)."""
        course = self.course
        centre_m = view.centre_m[:2]
        heading_rad = view.heading_rad
        course.follow(centre_m, view.link_m[0, :2], lambda: heading_rad, self.cycles)
        course.continue_planning()
        if course.complete:
            self._stop_profile.stop()
        else:
            self._stop_profile.go_on()
        aim = aim_rad(course.path, centre_m, course.along_m, self._carrot_m)
        turn_goal = TURN_PER_RAD * float(wrap(aim - heading_rad))
        part_s = self._stop_profile.step(dt_s)
        self._turn.step(part_s, np.clip([turn_goal], -TURN_LIMIT, TURN_LIMIT))
        self._phase_rad = (self._phase_rad + part_s * self._rate_rad_s) % TURN
        self.cycles += part_s * self._rate_rad_s / TURN
        return self.goal_rad()

    def _joints_rad(self, phase_rad: float, turn: float) -> Floats:
        bent = turned(self._gait, self._key, turn)
        return np.asarray(bent.joints_rad(self._robot, np.array([phase_rad]))[0])


def check_turns(gait: Gait, robot: RobotConfig) -> None:
    """Reject a gait that its turn cannot steer on this robot.

    Raises:
        InputError: no steerable gait, its turn is set, or joints are missing or bend too little for
            the largest turn.

    """
    if gait.steered_by is None:
        steerable = ", ".join(name for name, kind in GAITS.items() if kind.steered_by is not None)
        raise InputError(
            f"gait {gait.name}: not steered along waypoints; those that are: {steerable}; "
            f"without waypoints: snakewalk gait run {gait.name}"
        )
    if getattr(gait.params, gait.steered_by) != 0.0:
        raise InputError(
            f"gait {gait.name}: {gait.steered_by} is what steers it along waypoints; leave it out"
        )
    for turn in (-TURN_LIMIT, 0.0, TURN_LIMIT):
        turned(gait, gait.steered_by, turn).check(robot)
