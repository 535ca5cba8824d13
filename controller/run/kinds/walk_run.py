"""A run of the snake walk: recording, library of shapes, path, pilot, forecast and margins."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import FlatGround, WaterGround
from snakewalk.controller.kinematics.retarget import Retarget
from snakewalk.controller.kinematics.roll_compensation import RollCompensation
from snakewalk.controller.mechanics.ground_step import bridged
from snakewalk.controller.mechanics.pitch_fit import PitchFitter
from snakewalk.controller.mechanics.rollout import Rollout
from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.motion.source import MotionSource, Pace
from snakewalk.controller.run.prepared_run import GroundedRun, plan_of_path, pose_with
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.controller.runtime.forecast import Forecast, forecast, margin_faults
from snakewalk.controller.shape.library import ShapeFilter, StateLibrary, build_library
from snakewalk.controller.terrain.climb import CLIMBED_RAD, SteepSection, steep_sections
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.controller.terrain.keep_off import KeepOff, level_ground
from snakewalk.controller.terrain.map_planner import MapPlanner
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.terrain.planner import TerrainPlanner
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.walk.course import Course
from snakewalk.controller.walk.joint_track import JointTrack
from snakewalk.controller.walk.map_walk import MapWalk
from snakewalk.controller.walk.pilot import Aimed, Pilot, PitchControl, ShapeChooser
from snakewalk.controller.walk.predictive_walker import PredictiveWalker
from snakewalk.controller.walk.roll_planner import RollPlanner
from snakewalk.controller.walk.serpenoid import Serpenoid
from snakewalk.controller.walk.shape_filters import MADE, passes_all, shape_filters
from snakewalk.controller.walk.side_roll import SideRolls
from snakewalk.controller.walk.steering import Steering
from snakewalk.controller.walk.time_law import TimeLaw
from snakewalk.controller.walk.walker import Walker

_HALF_WAVE = 0.14
"""Half width of a wave, body lengths: 90 % of the shapes of the default recording are narrower."""


@dataclass(frozen=True)
class PathRun(GroundedRun):
    """Base of prepared runs along a path that is planned through waypoints."""

    @cached_property
    def planner(self) -> TerrainPlanner:
        """Plans paths over safe ground."""
        ground = self.ground_ahead
        if self.keep_off is not None and self.ground is None:
            points_m = np.vstack([self.run.start_m, self.run.waypoints_m])
            ground = level_ground(self._map_size_m[0], points_m)
        return TerrainPlanner(ground, self.world.planner, keep_off=self.keep_off)

    @property
    def keep_off(self) -> KeepOff | None:
        """Obstacle that paths avoid, if the run does not map its ground."""
        obstacle = self.world.obstacle
        if obstacle is None or self.run.mapping is not None:
            return None
        radius_m = self.robot.body_radius_m
        return KeepOff(obstacle, radius_m, _HALF_WAVE * self.robot.length_m + radius_m)

    @cached_property
    def path(self) -> SplinePath:
        """Through the start and the waypoints."""
        return self.planner.plan(np.vstack([self.run.start_m, self.run.waypoints_m]))

    def path_length_m(self) -> float:
        """Return the length of the path."""
        return self.path.length_m

    def check_waypoint(self, point_m: Floats) -> None:
        """Reject a point (2,) off the ground or in an obstacle; paths are not checked.

        Raises:
            InputError: with the fault.

        """
        x_m, y_m = (float(coordinate) for coordinate in point_m)
        where = f"waypoint ({x_m:.2f}, {y_m:.2f})"
        if not self.on_map(point_m):
            wide_m = self._map_size_m
            raise InputError(
                f"{where} is outside the world, {wide_m[0]:.1f} m by {wide_m[1]:.1f} m"
            )
        obstacle = self.world.obstacle
        if obstacle is not None and obstacle.gap_m(x_m, y_m) <= 0.0:
            raise InputError(f"{where} is in the world's obstacle, the {obstacle.kind}")

    def on_map(self, points_m: Floats) -> Bools:
        """Whether points (..., 2) are on the world's ground: (...)."""
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return np.asarray(np.abs(points_m).max(axis=-1) <= 0.5 * ground.size_m)
        assert self.ground is not None
        return self.ground.contains(points_m[..., 0], points_m[..., 1])

    @property
    def _map_size_m(self) -> tuple[float, float]:
        ground = self.world.ground
        if isinstance(ground, FlatGround | WaterGround):
            return ground.size_m, ground.size_m
        assert self.ground is not None
        return self.ground.size_m

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        given = self.run.start_heading_rad
        return self.path.heading_rad(0.05) if given is None else given


POINTS = 100
_BRIDGED_LINKS = 4.0
"""Radius of the ball that bridges the ground, over a link's length (ours). Bodies pass steps of 4
cm in 41 s with 4, in 49 s with 1; with 0 one of eight fails."""

_STIFF = "--set run.walk.pitch.p_gain=800 --set run.walk.pitch.current_limit_a=0.4"
"""Options with which pitch joints roll a body up a plane of 19 degrees (docs/terrain.md)."""
_ROLLING_A = 0.3
"""Goal current of pitch joints that roll a body up 18 degrees (ours, decision 37)."""


@dataclass(frozen=True)
class WalkRun(PathRun):
    """A ``PreparedRun`` of the snake walk, or of the serpenoid, along a path."""

    @cached_property
    def bridged(self) -> HeightField | None:
        """The ground as far as stiff links can follow it."""
        return None if self.ground_ahead is None else self._bridged_ground(self.ground_ahead)

    def _bridged_ground(self, ground: HeightField) -> HeightField:
        return bridged(ground, _BRIDGED_LINKS * self.robot.mean_link_length_m)

    @cached_property
    def ground_map(self) -> GrowingMap | None:
        """Map of a run over unknown ground, initially empty."""
        if self.run.mapping is None or self.ground is None:
            return None
        return GrowingMap.over(self.ground, self.run.mapping.spacing_m)

    @cached_property
    def retarget(self) -> Retarget:
        """Skeleton to joints."""
        return Retarget(self.robot, POINTS)

    @cached_property
    def shape_filters(self) -> dict[str, ShapeFilter]:
        """Tests of a shape: turn, joint ranges, no self-contact, traction."""
        return shape_filters(self.robot, self.world.friction, self.run.states, POINTS)

    @cached_property
    def library(self) -> StateLibrary:
        """Shapes that this robot can make without self-contact, and that push."""
        states = self.run.states
        return build_library(
            load_track(self.run.track).angles_rad,
            self.shape_filters,
            coefficients=states.coefficients,
            random_count=states.random_count,
            curvature=self.run.behaviour.curvature,
            rng=np.random.default_rng(self.run.seed),
        )

    @cached_property
    def pitch_fitter(self) -> PitchFitter:
        """Fits the pitch joints to the ground; 0 on a level floor."""
        return PitchFitter(self.robot, self.bridged, self.run.walk.pitch.fit_gain)

    @cached_property
    def gain(self) -> float:
        """Predicted speed over pulse speed: mean quasi-static gain of the shapes.

        The simulated body makes 0.91 to 0.99 of it on level ground, 0.67 to 0.77 on hills (shipped
        runs, docs/method.md).
        """
        if self.run.motion == "serpenoid":
            shape = self._chooser().track.body_rad(float(POINTS))
            return float(quasi_static_gain(shape, self.world.friction)[0])
        some = self.library.shapes_rad[:: max(1, len(self.library.shapes_rad) // 50)]
        return float(quasi_static_gain(some, self.world.friction).mean())

    @property
    def pulse_segments_s(self) -> float:
        """Speed of the shape along the body."""
        behaviour = self.run.behaviour
        return behaviour.pulse_body_lengths_s * (1.0 - behaviour.sliding) * POINTS

    def initial_pose(self) -> InitialPose:
        """Return the initial pose of a simulated robot.

        It is straight on a flat floor. On a slope a straight round body rolls, so it has its first
        shape.
        """
        if self.ground is None:
            return InitialPose(self.start_heading_rad, np.zeros(self.robot.joint_count))
        return pose_with(self.robot, self.start_heading_rad, self.pilot(level=True).goal_rad())

    def pilot(self, *, level: bool = False) -> Pilot:
        """Make a fresh pilot, equal for the same configuration and seed.

        ``level`` keeps the pitch joints at 0.
        """
        return self._pilot(self._chooser(), level=level)

    def _pilot(
        self,
        chooser: ShapeChooser,
        *,
        level: bool = False,
        planner: MapPlanner | None = None,
        fitter: PitchFitter | None = None,
    ) -> Pilot:
        run = self.run
        robot = self.robot
        time_law = TimeLaw(
            JointTrack(chooser.track, self.retarget.joints_rad, robot.limit_rad),
            self.pulse_segments_s,
            speed_limit_rad_s=robot.joint_speed_limit_rad_s,
            acceleration_limit_rad_s2=robot.joint_acceleration_limit_rad_s2,
        )
        return Pilot(
            chooser,
            time_law,
            pace=Pace.limit(robot),
            course=Course(
                (planner or self.planner).in_steps,
                run.waypoints_m,
                start_m=np.array(run.start_m),
                radius_m=run.waypoint_radius_m,
                length_m=robot.length_m,
                travel_per_body=chooser.track.points,
                travel=time_law.head,
                feedback=run.motion != "walk-blind",
            ),
            pitch=PitchControl(
                None if level or self.ground is None else fitter or self.pitch_fitter,
                robot.servo.pitch_lead_s,
                None if level or not robot.pitch_joints else RollCompensation(robot),
            ),
            fall_back=(
                chooser.fall_back
                if isinstance(chooser, PredictiveWalker) and run.walk.fallback
                else None
            ),
            carrot_m=run.walk.carrot_m,
            aim_at_waypoint=run.motion == "walk-printed",
        )

    def forecast(self) -> Forecast:
        """Predict the run on paper.

        Raises:
            InputError: one line per joint and limit that the plan breaks.

        """
        plan = forecast(
            self.pilot(level=True),
            self.robot,
            self.world.friction,
            start_m=np.array(self.run.start_m),
            heading_rad=self.start_heading_rad,
            ground=self.ground_ahead,
            limit_s=self.run.time_limit_s,
        )
        faults = margin_faults(plan, self.robot)
        if faults:
            raise InputError(faults)
        return plan

    def check_plan(self) -> PlanSummary:
        """Predict the run and summarise it for the log.

        Raises:
            InputError: one line per joint and limit that the plan breaks.

        """
        ahead = self.forecast()
        return replace(
            plan_of_path(self.run, self.path),
            predicted_speed_m_s=self.gain * ahead.pulse_m / ahead.duration_s,
            states=None if self.run.motion == "serpenoid" else self.library.counts,
        )

    def make_source(self, on_event: OnEvent) -> MotionSource:
        """Return a fresh pilot; it warns if the recording has no part in the walk."""
        for line in self.warnings:
            on_event("shapes", line)
        for line in self.climb_warnings:
            on_event("climb", line)
        if self.ground_map is not None:
            return self._map_walk(self.ground_map)
        chooser = self._chooser()
        pilot = self._pilot(chooser)
        pilot.on_event = on_event
        if not isinstance(chooser, PredictiveWalker) or self.bridged is None or not self._rolls:
            return pilot
        relief = self.planner.relief
        return SideRolls(
            pilot,
            chooser,
            self.robot,
            RollPlanner(
                self.robot,
                self.bridged,
                lambda point_m: relief is None or bool(relief.safe(*point_m)),
            ),
            climb_progress=self.run.walk.climb_progress,
            pulse_m_s=self.pulse_segments_s * self.robot.length_m / POINTS,
            on_event=on_event,
        )

    def _map_walk(self, ground_map: GrowingMap) -> MapWalk:
        planner = MapPlanner(self.world.planner)
        ground = ground_map.height_field()
        rollout = self._rollout()
        if ground is not None:
            planner.update(ground)
        fitter = PitchFitter(self.robot, None, self.run.walk.pitch.fit_gain)
        pilot = self._pilot(self._chooser(rollout), planner=planner, fitter=fitter)

        def change_ground(ground: HeightField) -> None:
            smooth = self._bridged_ground(ground)
            rollout.change_ground(smooth)
            fitter.change_ground(smooth)

        if ground is not None:
            change_ground(ground)
        assert self.run.mapping is not None
        return MapWalk(
            pilot,
            ground_map,
            planner,
            change_ground=change_ground,
            replan_m=self.run.mapping.replan_bodies * self.robot.length_m,
        )

    def _rollout(self) -> Rollout:
        return Rollout(self.robot, self.world.friction, self.bridged, POINTS)

    @property
    def _may_roll(self) -> bool:
        """Whether the body rolls sideways if its joints carry it: round, and without a mast."""
        robot = self.robot
        is_round = robot.belly.shape != "rails" and robot.stereo_head is None
        return self.run.walk.rolls and is_round and bool(robot.pitch_joints)

    @property
    def _rolls(self) -> bool:
        """Whether the body may roll, and its pitch joints carry it."""
        return self._may_roll and all(
            self.robot.current_limits_a[joint] >= _ROLLING_A for joint in self.robot.pitch_joints
        )

    @property
    def pulse_m_s(self) -> float:
        """Speed at which the wave travels along the body, without its sliding."""
        behaviour = self.run.behaviour
        return behaviour.pulse_body_lengths_s * (1.0 - behaviour.sliding) * self.robot.length_m

    @property
    def warnings(self) -> tuple[str, ...]:
        """Surprising properties of the path and the shapes, one line each."""
        pulse_m_s = self.pulse_m_s
        lines = []
        if self.path.length_m > pulse_m_s * self.run.time_limit_s:
            lines.append(
                f"path: {self.path.length_m:.1f} m at a pulse of {pulse_m_s:.2f} m/s need at "
                f"least {self.path.length_m / pulse_m_s:.0f} s, but time_limit_s is "
                f"{self.run.time_limit_s:g}; the run will not reach its end; set the speed "
                "of the walk with behaviour.pulse_body_lengths_s"
            )
        if self.run.mapping is not None:
            lines.append("the ground is not known before the run: the plan assumes a level floor")
        if self.run.motion == "serpenoid":
            return tuple(lines)
        if self.run.behaviour.curvature is None and self.library.curvature > 1.0:
            lines.append(
                f"every bend is {self.library.curvature:g} times as wide as recorded: this "
                "ground's friction leaves narrower ones no hold (behaviour.curvature)"
            )
        if not self.library.recorded:
            lines.append(
                f"no shape of {self.run.track} is used: the robot or the ground refuses them all; "
                f"the walk is made of {len(self.library.shapes_rad)} random ones "
                f"(why: snakewalk animal track {self.run.track})"
            )
        return tuple(lines)

    @cached_property
    def steep_sections(self) -> list[SteepSection]:
        """Sections of the path that are too steep for the body, on known ground."""
        if self.ground_ahead is None:
            return []
        return steep_sections(
            self.path, self.ground_ahead, self.robot.length_m, self._steepest_climb_rad
        )

    @property
    def climb_warnings(self) -> tuple[str, ...]:
        """One line for each of the ``steep_sections``."""
        return tuple(map(self._too_steep, self.steep_sections))

    @property
    def _steepest_climb_rad(self) -> float:
        """Steepest slope that a body climbs, or that friction along it holds."""
        return max(CLIMBED_RAD, float(np.arctan(self.world.friction.along)))

    def _too_steep(self, section: SteepSection) -> str:
        x_m, y_m = self.path.position(section.begin_m)
        words = [
            "--motion walk" * (self.run.motion != "walk"),
            "--robot alternating16" * (not self._may_roll),
            _STIFF * (not self._rolls),
        ]
        remedy = f"add {' '.join(filter(None, words))} to let it roll up, or move the waypoints"
        if not any(words):
            remedy = "its pitch joints let it roll up there"
        return (
            f"the path climbs {np.degrees(section.slope_rad):.1f} deg from {section.begin_m:.1f} "
            f"to {section.end_m:.1f} m, beginning at ({x_m:.2f}, {y_m:.2f}): this body is known "
            f"to climb {np.degrees(self._steepest_climb_rad):.1f} deg; {remedy}"
        )

    def walker(self, library: StateLibrary, filters: Mapping[str, ShapeFilter]) -> Walker:
        """Make a fresh walk by the graph alone over a library."""
        walk = self.run.walk
        if self.run.motion == "walk-printed":
            walk = walk.model_copy(update={"decision_fraction": 1.0, "ramp_limit_rad": 0.0})
        return Walker(self._shuffled_shapes(library), walk, passes_all(filters))

    def _shuffled_shapes(self, library: StateLibrary) -> Floats:
        """Shapes (S, N) in an order by the seed: W settles ties by the order."""
        order = np.random.default_rng(self.run.seed).permutation(len(library.shapes_rad))
        return library.shapes_rad[order]

    def _chooser(self, rollout: Rollout | None = None) -> ShapeChooser:
        if self.run.motion == "serpenoid":
            return Aimed(Serpenoid(POINTS))
        if self.run.motion != "walk":
            return Aimed(self.walker(self.library, self.shape_filters))
        predicts = rollout or self._rollout()
        return PredictiveWalker(
            self._shuffled_shapes(self.library),
            self.run.walk,
            lambda track: Steering(predicts, track, self.pulse_segments_s),
            len(self.robot.yaw_joints),
            passes_all({name: self.shape_filters[name] for name in MADE}),
        )
