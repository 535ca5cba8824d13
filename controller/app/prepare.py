"""From a run's configuration to a pilot: recording, library, path, forecast, margins."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError
from config.loader import checked, load_robot, load_run, load_world
from config.robot import RobotConfig
from config.run import RunConfig, WalkConfig
from config.world import WorldConfig
from controller.capture.generated import embedded
from controller.motion.pulse import Pulse
from controller.motion.retarget import Retarget
from controller.motion.serpentine import Serpentine
from controller.motion.traction import quasi_static_gain
from controller.motion.walker import Walker
from controller.runtime.forecast import Forecast, forecast
from controller.runtime.pilot import Pilot, TrackSource
from controller.shape.crossing import self_touches
from controller.shape.library import StateLibrary, build_library
from controller.terrain.path import SplinePath

Floats = NDArray[np.float64]
POINTS = 100
_SPEED_HEADROOM = 1.1  # a piece may end between two looks of the pulse


@dataclass(frozen=True)
class Prepared:
    """Everything that is known before a servo moves."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig

    @cached_property
    def retarget(self) -> Retarget:
        """Skeleton to joints."""
        return Retarget(self.robot, POINTS)

    @cached_property
    def library(self) -> StateLibrary:
        """Shapes that this robot can make, that do not touch themselves, and that push."""
        limit = np.array(self.robot.limit_rad)
        robot, friction, states = self.robot, self.world.friction, self.run.states

        def beyond(shapes_rad: Floats) -> NDArray[np.bool_]:
            return np.asarray((np.abs(self.retarget.joints_rad(shapes_rad)) > limit).any(axis=-1))

        return build_library(
            embedded(self.run.track).angles_rad,
            {
                "joint limits": beyond,
                "self-contact": lambda x: self_touches(x, robot.length_m, robot.body_radius_m),
                "traction": lambda x: quasi_static_gain(x, friction) < states.gain_limit,
            },
            coefficients=states.coefficients,
            random_count=states.random_count,
            curvature=self.run.behaviour.curvature,
            rng=np.random.default_rng(self.run.seed),
        )

    @cached_property
    def path(self) -> SplinePath:
        """Through the start and the waypoints."""
        return SplinePath(np.vstack([self.run.start_m, self.run.waypoints_m]))

    @cached_property
    def gain(self) -> float:
        """Predicted speed over pulse speed, 0.93 eta_q (METHOD 12), mean over the shapes used."""
        if self.run.motion == "serpenoid":
            shape = self._source().track.body_rad(float(POINTS))
            return 0.93 * float(quasi_static_gain(shape, self.world.friction)[0])
        some = self.library.shapes_rad[:: max(1, len(self.library.shapes_rad) // 50)]
        return 0.93 * float(quasi_static_gain(some, self.world.friction).mean())

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        given = self.run.start_heading_rad
        return self.path.heading_rad(0.05) if given is None else given

    def pilot(self) -> Pilot:
        """Make a fresh pilot; the same configuration and seed give the same one."""
        run, robot = self.run, self.robot
        wanted = run.behaviour.pulse_body_lengths_s * (1.0 - run.behaviour.sliding) * POINTS
        return Pilot(
            self._source(),
            Pulse(self.retarget.joints_rad, wanted, robot.joint_speed_limit_rad_s),
            self.retarget.joints_rad,
            plan=SplinePath,
            start_m=np.array(run.start_m),
            waypoints_m=run.waypoints_m,
            length_m=robot.length_m,
            carrot_m=run.walk.carrot_m,
            waypoint_radius_m=run.waypoint_radius_m,
            feedback=run.motion != "walk-blind",
            aim_at_waypoint=run.motion == "walk-printed",
        )

    def forecast(self) -> Forecast:
        """Run the plan on paper, and refuse it if a joint would be driven beyond its limits.

        Raises:
            InputError: one line per joint and limit.

        """
        plan = forecast(
            self.pilot(),
            self.robot,
            self.world.friction,
            start_m=np.array(self.run.start_m),
            heading_rad=self.start_heading_rad,
            limit_s=self.run.time_limit_s,
        )
        limit = np.array(self.robot.limit_rad)
        reach = np.abs(plan.joint_rad).max(axis=0)
        speed = plan.joint_speed_rad_s
        most = self.robot.joint_speed_limit_rad_s
        faults = [
            f"plan: joint {j + 1} would bend to {reach[j]:.2f} rad; its limit is {limit[j]:.2f}"
            for j in np.flatnonzero(reach > limit)
        ] + [
            f"plan: joint {j + 1} would turn at {speed[j]:.2f} rad/s; the limit is {most:.2f}"
            for j in np.flatnonzero(speed > _SPEED_HEADROOM * most)
        ]
        if faults:
            raise InputError(faults)
        return plan

    def _source(self) -> TrackSource:
        if self.run.motion == "serpenoid":
            return Serpentine(POINTS)
        walk = self.run.walk
        if self.run.motion == "walk-printed":
            walk = WalkConfig(
                decision_fraction=1.0,
                ramp_limit_rad=0.0,
                heading_tolerance_rad=walk.heading_tolerance_rad,
                nearest_count=walk.nearest_count,
            )
        order = np.random.default_rng(self.run.seed).permutation(len(self.library.shapes_rad))
        return Walker(self.library.shapes_rad[order], walk, self._usable)

    def _usable(self, body_rad: Floats) -> bool:
        """Whether a body between two shapes can be made, does not touch itself, and pushes."""
        robot = self.robot
        if (np.abs(self.retarget.joints_rad(body_rad)) > robot.limit_rad).any():
            return False
        if self_touches(body_rad, robot.length_m, robot.body_radius_m)[0]:
            return False
        gain = quasi_static_gain(body_rad, self.world.friction)[0]
        return bool(gain >= self.run.states.gain_limit)


def prepare(run: str, **changes: object) -> Prepared:
    """Load a run with its robot and world; ``changes`` replace fields of the run where not None.

    Raises:
        ConfigError: every fault of a file at once.
        InputError: what the configuration asks cannot be made.

    """
    loaded = load_run(run)
    wanted = {key: value for key, value in changes.items() if value is not None}
    if wanted:
        loaded = checked(RunConfig, loaded.model_dump() | wanted, "command line")
    beside = Path(run).parent if run.endswith(".toml") else None
    prepared = Prepared(loaded, load_robot(loaded.robot, beside), load_world(loaded.world, beside))
    if prepared.world.ground.kind != "flat":
        raise InputError(
            f"world {prepared.world.name}: runs on elevation models are not offered yet; "
            "use a flat world"
        )
    return prepared
