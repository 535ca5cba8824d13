"""Differences of a robot from its file and world: ground, loads, servos, horns."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import LAWS, LawName
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.plant import Mounting

FRICTION = 1.25
MASS = 1.15
WEAK = 0.7
HORN_DEG = 2.0
"""Sizes of drawn errors: factor on friction and mass or its inverse, torque of one servo, and
standard deviation of the horns (ours)."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """Differences from the files; defaults and None mean no difference."""

    along: float = 1.0
    """Factor on the friction along the body, forward and backward."""
    across: float = 1.0
    """Friction across the body over the world's."""
    load_kg: Floats | None = None
    """(L,) additional mass of each link."""
    torque: Floats | None = None
    """(J,) factor on each servo's torque for a current."""
    slip_rad: Floats | None = None
    """(J,) angle by which each joint is bent more than its servo reports: a slipped horn."""
    law: LawName | None = None
    """Law of friction; None: the world's."""

    @classmethod
    def drawn(cls, robot: RobotConfig, rng: np.random.Generator) -> "Deviation":
        """Draw errors of friction, mass, one servo, the horns, and the law of friction."""
        along, across, mass = (
            factor ** rng.choice([-1.0, 1.0]) for factor in (FRICTION, FRICTION, MASS)
        )
        torque = np.ones(robot.joint_count)
        torque[rng.integers(robot.joint_count)] = WEAK
        return cls(
            float(along),
            float(across),
            (float(mass) - 1.0) * np.array(robot.link_masses_kg),
            torque,
            np.radians(HORN_DEG) * rng.standard_normal(robot.joint_count),
            LAWS[rng.integers(len(LAWS))],
        )

    @classmethod
    def of_run(cls, run: RunConfig, robot: RobotConfig) -> "Deviation":
        """Return the deviation of a robot in a run: by its factors, or drawn from its seed."""
        by = run.deviation
        if by.drawn:
            return cls.drawn(robot, np.random.default_rng(run.seed))
        more = by.mass - 1.0
        return cls(
            by.friction_along,
            by.friction_across,
            more * np.array(robot.link_masses_kg) if more else None,
            np.full(robot.joint_count, by.torque) if by.torque != 1.0 else None,
            law=by.friction_law,
        )

    def robot(self, robot: RobotConfig) -> RobotConfig:
        """Return the body that the physics has."""
        if self.load_kg is None:
            return robot
        masses_kg = np.array(robot.link_masses_kg) + self.load_kg
        if robot.stereo_head is not None:  # the robot adds it again
            masses_kg[robot.stereo_head.link] -= robot.stereo_head.mass_kg
        return robot.with_link_masses(masses_kg.tolist())

    def world(self, world: WorldConfig) -> WorldConfig:
        """Return the ground that the physics has."""
        world_friction = world.friction
        back = None if world_friction.back is None else world_friction.back * self.along
        changes = {
            "along": world_friction.along * self.along,
            "across": world_friction.across * self.across,
        }
        law = self.law or world_friction.law
        friction = world_friction.model_copy(update=changes | {"back": back, "law": law})
        return world.model_copy(update={"friction": friction})

    def shaft_rad(self, joint_rad: Floats) -> Floats:
        """Return the angles (J,) of joints whose servos report ``joint_rad``."""
        return joint_rad if self.slip_rad is None else joint_rad + self.slip_rad

    def mounting(self, robot: RobotConfig) -> "Mounting":
        """Return how the servos sit on the shafts."""
        stated_mounting = Mounting.of(robot)
        if self.slip_rad is None:
            return stated_mounting
        return Mounting(
            stated_mounting.sign, stated_mounting.zero_rad - stated_mounting.sign * self.slip_rad
        )


NO_DEVIATION = Deviation()
