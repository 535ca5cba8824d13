"""A run on paper: the pilot steers a quasi-static body, to check a plan before torque.

In each step the shape follows the pilot's goals, and the rigid velocity balances Coulomb friction
and gravity under each link (``controller.mechanics.rigid_motion``). Servos do not lag, and inertia
counts only where nothing holds the body. Links lie flat in plan with equal weights.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import (
    BodyView,
    body_in_world,
    link_weights,
    mean_heading_rad,
    pose_at,
)
from snakewalk.controller.mechanics.load import friction_n, yaw_load_n_m
from snakewalk.controller.mechanics.rigid_motion import (
    Inertia,
    NoBalanceError,
    rigid_velocity,
)
from snakewalk.controller.mechanics.slope_load import holding_factor, slope_load
from snakewalk.controller.walk.pilot import Pilot
from snakewalk.drivers.attitude import about_up


@dataclass(frozen=True, slots=True)
class Slide:
    """Ground that was steeper than the body could hold."""

    slope_rad: float
    """Mean slope under the body at the place with the least support."""
    holding_rad: float
    """Torque that the friction could have held there, in the body's shape."""
    lasted_s: float
    """Time without support of the body."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """Predicted course of the plan, if the friction is as configured."""

    time_s: Floats
    """(T,) times of the forecast, s."""
    joint_rad: Floats
    """(T, J) joint angles, rad."""
    centre_m: Floats
    """(T, 2) centre of mass in the world."""
    torque_n_m: Floats
    """(T, J) that the yaw joints must hold against friction."""
    pulse_m: float
    """Distance that the shape has travelled along the body."""
    reached: int
    missed: int
    slide: Slide | None
    """Place where the body slides; None where friction held everywhere."""

    @property
    def duration_s(self) -> float:
        """Time of the last step."""
        return float(self.time_s[-1])

    @property
    def joint_speed_rad_s(self) -> Floats:
        """(J,) largest speed asked of each joint."""
        return np.asarray(np.abs(self._speeds_rad_s()).max(axis=0))

    @property
    def joint_acceleration_rad_s2(self) -> Floats:
        """(J,) largest acceleration asked of each joint."""
        changes = np.diff(self._speeds_rad_s(), axis=0) / np.diff(self.time_s)[1:, None]
        return np.asarray(np.abs(changes).max(axis=0, initial=0.0))

    def _speeds_rad_s(self) -> Floats:
        return np.asarray(np.diff(self.joint_rad, axis=0) / np.diff(self.time_s)[:, None])

    @property
    def joint_torque_n_m(self) -> Floats:
        """(J,) largest torque that each joint must hold."""
        return np.asarray(np.abs(self.torque_n_m).max(axis=0))


def forecast(
    pilot: Pilot,
    robot: RobotConfig,
    friction: FrictionConfig,
    *,
    start_m: Floats,
    heading_rad: float,
    ground: HeightField | None = None,
    step_s: float = 0.04,
    limit_s: float = 240.0,
) -> Forecast:
    """Run ``pilot`` on a quasi-static body until it is done or the time is up.

    Args:
        pilot: used up by this; the run needs a fresh one.
        robot: links and joints.
        friction: of the ground, the same under every link.
        start_m: (2,) centre of the head link.
        heading_rad: of the mean body line.
        ground: under the run; None is a level floor.
        step_s: of the simulation and of the pilot.
        limit_s: when to give up.

    """
    body = _PaperBody(robot, friction, ground, step_s)
    body.begin(start_m, heading_rad, pilot.goal_rad())
    times = [0.0]
    angles = [body.joints]
    centres = []
    pulse_m = 0.0
    torques = [np.zeros(robot.joint_count)]
    while True:
        view = body.view()
        centres.append(view.centre_m[:2])
        if pilot.done or times[-1] >= limit_s:
            break
        torques.append(body.step(pilot.step(step_s, view), view))
        pulse_m += step_s * pilot.pulse_m_s
        times.append(times[-1] + step_s)
        angles.append(body.joints)
    return Forecast(
        np.array(times),
        np.array(angles),
        np.array(centres),
        np.array(torques),
        pulse_m,
        pilot.reached,
        pilot.missed,
        body.slide,
    )


class _PaperBody:
    """A quasi-static body: friction balances the pull of the slope while it can hold the body."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        ground: HeightField | None,
        step_s: float,
    ) -> None:
        self._robot = robot
        self._friction = friction
        self._ground = ground
        self._step_s, self._head_m, self._head_rad = step_s, np.zeros(2), 0.0
        self._velocity, self._moving_m_s = np.zeros(3), np.zeros((robot.joint_count + 1, 2))
        self._yaw = np.array([axis == "y" for axis in robot.joint_axes])
        self._weight_n = robot.mean_link_mass_kg * GRAVITY_M_S2
        self._share = link_weights(robot)[:, None]
        self._lengths_m = np.array(robot.link_lengths_m)
        self.joints: Floats = np.zeros(robot.joint_count)
        """(J,) joint angles."""
        self.slide: Slide | None = None
        """Steepest ground that did not hold the body."""

    def begin(self, head_m: Floats, heading_rad: float, joints: Floats) -> None:
        """Lay the body down: head link (2,), heading of its mean line, joint angles (J,)."""
        self._head_m = np.array(head_m[:2], dtype=float)
        self._head_rad = heading_rad - mean_heading_rad(self._robot, joints)
        self.joints = joints

    def view(self) -> BodyView:
        pose = pose_at(self._head_m, self._head_rad)
        return body_in_world(self._robot, pose, self.joints)

    def step(self, goal: Floats, view: BodyView) -> Floats:
        """Move the joints to ``goal`` (J,) and the body with them; returns torques (J,), N m."""
        step_s = self._step_s
        weight_n = self._weight_n
        share = self._share
        before = _in_head_frame(self._robot, self.joints)
        after = _in_head_frame(self._robot, goal)
        shape_m_s = (after.link_m - before.link_m)[:, :2] / step_s
        points = before.link_m[:, :2]
        headings = before.headings_rad
        turn = about_up(self._head_rad)[:2, :2]
        tangential, normal = slope_load(self._ground, view.link_m)
        tangential = share * (tangential @ turn)
        normal = share[:, 0] * normal
        was_m_s = self._moving_m_s @ turn
        balance = self._balance(points, headings, shape_m_s, was_m_s, tangential, normal)
        velocity = self._velocity
        lever = np.stack([-points[:, 1], points[:, 0]], axis=1)
        moving = shape_m_s + velocity[:2] + velocity[2] * lever
        force_n = (
            friction_n(moving, headings, self._friction, weight_n) * normal[:, None]
            + weight_n * tangential
        )
        if not balance:
            self.slide = _worse_slide(
                self.slide, points, headings, self._friction, tangential, normal, step_s
            )
            force_n -= self._robot.mean_link_mass_kg * share * (moving - was_m_s) / step_s
        self._moving_m_s = moving @ turn.T
        torque = self._yaw * yaw_load_n_m(points, headings, self._lengths_m, force_n)
        self._head_m = self._head_m + step_s * turn @ velocity[:2]
        self._head_rad += step_s * velocity[2]
        self.joints = goal
        return torque

    def _balance(
        self,
        points: Floats,
        headings: Floats,
        shape_m_s: Floats,
        was_m_s: Floats,
        tangential: Floats,
        normal: Floats,
    ) -> bool:
        """Find the rigid velocity; returns whether friction holds the body."""
        friction = self._friction
        try:
            self._velocity = rigid_velocity(
                points,
                headings,
                shape_m_s,
                friction,
                self._velocity,
                tangential=tangential,
                normal=normal,
            )
        except NoBalanceError:
            self._velocity = rigid_velocity(
                points,
                headings,
                shape_m_s,
                friction,
                self._velocity,
                tangential=tangential,
                normal=normal,
                inertia=Inertia(was_m_s, self._step_s),
            )
            return False
        return True


def _in_head_frame(robot: RobotConfig, joint_rad: Floats) -> BodyView:
    return body_in_world(robot, pose_at(np.zeros(2), 0.0), joint_rad)


def _worse_slide(
    slide: Slide | None,
    points_m: Floats,
    headings_rad: Floats,
    friction: FrictionConfig,
    tangential: Floats,
    normal: Floats,
    step_s: float,
) -> Slide:
    """Add a step without support; store the place of the largest deficit."""
    factor = holding_factor(points_m, headings_rad, friction, tangential, normal)
    steepness = float(np.hypot(*(tangential / normal[:, None]).mean(axis=0)))
    slope_rad, holding_rad = float(np.arctan(steepness)), float(np.arctan(factor * steepness))
    lasted_s = step_s + (slide.lasted_s if slide else 0.0)
    if slide is not None and slide.holding_rad - slide.slope_rad <= holding_rad - slope_rad:
        slope_rad, holding_rad = slide.slope_rad, slide.holding_rad
    return Slide(slope_rad, holding_rad, lasted_s)


_HEADROOM = 1.05
"""A piece that is appended may ask for a brake that is a little late."""
_ROUNDING = 1e-9


def margin_faults(plan: Forecast, robot: RobotConfig) -> list[str]:
    """One line per joint and limit that ``plan`` breaks: reach, speed, acceleration, torque."""
    joints = robot.joint_count
    checks = (
        ("bend to", "rad", np.abs(plan.joint_rad).max(axis=0), np.array(robot.limit_rad), 1.0),
        (
            "turn at",
            "rad/s",
            plan.joint_speed_rad_s,
            np.full(joints, robot.joint_speed_limit_rad_s),
            _HEADROOM,
        ),
        (
            "accelerate at",
            "rad/s^2",
            plan.joint_acceleration_rad_s2,
            np.full(joints, robot.joint_acceleration_limit_rad_s2),
            _HEADROOM,
        ),
        ("hold", "N m", plan.joint_torque_n_m, np.full(joints, robot.torque_limit_n_m), 1.0),
    )
    return [
        f"plan: {robot.joint_label(int(j))} would {verb} {asked[j]:.2f} {unit}; "
        f"its limit is {limit[j]:.2f}"
        for verb, unit, asked, limit, headroom in checks
        for j in np.flatnonzero(asked > headroom * limit + _ROUNDING)
    ]
