"""A run's waypoints as a sequence of recorded actions: its plan, its source and its outcome."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.frame import Frame, body_frame
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.motion.wrapper import MotionWrapper
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.route import RouteFollower
from snakewalk.controller.repertoire.search import MotionPrimitives, Route
from snakewalk.controller.run.prepared_run import pose_with, start_heading_rad
from snakewalk.controller.run.request import RunResult
from snakewalk.controller.run.results import by_evidence
from snakewalk.controller.runlog.record import InitialPose, PlanSummary
from snakewalk.controller.runtime.drive import OnEvent
from snakewalk.drivers.types import BodyPose


@dataclass(frozen=True)
class RepertoireRun:
    """A ``PreparedRun`` of recorded actions."""

    run: RunConfig
    robot: RobotConfig
    world: WorldConfig
    repertoire: Repertoire
    repertoire_file: Path
    route: Route
    replan: bool = True
    gain: float = field(default=float("nan"), init=False)
    ground: HeightField | None = field(default=None, init=False)

    @cached_property
    def primitives(self) -> MotionPrimitives:
        """Motion primitives of the repertoire, for this robot's length."""
        return MotionPrimitives(self.repertoire, self.robot.length_m / self.repertoire.length_m)

    @property
    def action_names(self) -> list[str]:
        """Names of the route's actions."""
        return [self.repertoire.segments[k].name for k in self.route.actions]

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return start_heading_rad(self.run)

    def initial_pose(self) -> InitialPose:
        """Return the shape with which the first action begins."""
        return pose_of_action(self.run, self.robot, self.repertoire, self.route.actions[0])

    def check_plan(self) -> PlanSummary:
        """Summarise the path that the search predicts."""
        return PlanSummary(
            path_m=self.route.pose[:, :2],
            waypoints_m=np.array(self.run.waypoints_m),
            waypoint_radius_m=self.run.waypoint_radius_m,
            predicted_speed_m_s=float(
                np.hypot(*np.diff(self.route.pose[:, :2], axis=0).T).sum() / self.route.duration_s
            ),
        )

    def make_source(self, on_event: OnEvent) -> "RouteMotion":
        """Return a fresh motion that plays the route."""
        return RouteMotion(self, on_event)


class RouteMotion(MotionWrapper):
    """Plays the actions and counts waypoints; comes to rest when all are reached."""

    missed = 0
    along_m = float("nan")
    pulse_m_s = 0.0
    decision: Decision | None = None
    replanned: str | None = None

    def __init__(self, prepared: RepertoireRun, on_event: OnEvent) -> None:
        run = prepared.run
        route = prepared.route
        self.follower = RouteFollower(
            prepared.primitives,
            route,
            run.waypoints_m,
            run.waypoint_radius_m,
            replan=prepared.replan,
        )
        """Chooses the actions, and keeps the predicted and measured motion."""
        self._names = [segment.name for segment in prepared.repertoire.segments]
        self._path_m = route.pose[:, :2]
        self._on_event = on_event
        first = route.actions[0]
        self._motion = RepertoireMotion(prepared.repertoire, prepared.robot, first, self._choose)
        super().__init__(self._motion)
        on_event("action", self._names[first])

    @property
    def reached(self) -> int:
        """Number of waypoints reached."""
        return self.follower.reached

    def path_m(self, count: int) -> Floats:
        """(count, 2) points along the route as planned."""
        sample_places = np.linspace(0.0, len(self._path_m) - 1.0, count)
        stations = np.arange(len(self._path_m))
        return np.column_stack(
            [np.interp(sample_places, stations, self._path_m[:, k]) for k in (0, 1)]
        )

    def begin(self, view: BodyView) -> Floats:
        """(J,) where the first action begins: the ground is flat."""
        return self._motion.goal_rad()

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s`` and return the new targets (J,)."""
        self.follower.count_waypoints(view)
        if self.follower.done:
            self._motion.stop()
        return self._motion.step(dt_s, view)

    def _choose(self, view: BodyView) -> int | None:
        action = self.follower.choose(view)
        if action is not None:
            self._on_event("action", self._names[action])
        return action


def pose_of_action(
    run: RunConfig, robot: RobotConfig, repertoire: Repertoire, action: int
) -> InitialPose:
    """Return the shape with which ``action`` begins, along the start heading."""
    return pose_with(robot, start_heading_rad(run), repertoire.segments[action].goal_rad[0])


def initial_frame(run: RunConfig, robot: RobotConfig, pose: InitialPose) -> Frame:
    """Return the body frame of a robot put down in ``pose``."""
    head = Frame.flat(*run.start_m, pose.heading_rad, robot.body_radius_m)
    head_pose = BodyPose(0.0, head.origin_m, head.rotation)
    return body_frame(body_in_world(robot, head_pose, pose.joint_rad).link_m)


@dataclass(frozen=True, slots=True)
class RouteRun:
    """A run of a plan, and what its follower predicted and measured."""

    job: RepertoireRun
    result: RunResult

    @property
    def follower(self) -> RouteFollower:
        """Follower of the route, with its predicted and measured poses."""
        source = self.result.source
        assert isinstance(source, RouteMotion), "a repertoire run has no other motion"
        return source.follower

    @property
    def complete(self) -> bool:
        """Whether every waypoint was reached without a trip."""
        return self.result.outcome.complete

    def to_dict(self) -> dict[str, object]:
        """Numbers for a command's answer."""
        job = self.job
        outcome = self.result.outcome
        follower = self.follower
        facts: dict[str, object] = {
            "waypoints": len(job.run.waypoints_m),
            **by_evidence(self.result, {"waypoints_reached": outcome.reached}),
            "replanned": job.replan,
            "actions_planned": len(job.route.actions),
            "actions_run": len(follower.measured),
            "predicted_s": round(job.route.duration_s, 2),
            "duration_s": round(outcome.duration_s, 2),
            "tripped": outcome.tripped,
        }
        cycle = follower.errors()
        route = follower.route_errors()
        if len(cycle):
            errors = {
                "cycle_error_median_m": round(float(np.median(cycle[:, 0])), 4),
                "cycle_error_median_rad": round(float(np.median(cycle[:, 1])), 4),
            }
            facts |= by_evidence(self.result, errors)
        if len(route) and not job.replan:
            errors = {
                "open_loop_error_max_m": round(float(route[:, 0].max()), 4),
                "open_loop_error_end_m": round(float(route[-1, 0]), 4),
                "open_loop_error_end_rad": round(float(route[-1, 1]), 4),
            }
            facts |= by_evidence(self.result, errors)
        return facts


def run_name(job: RepertoireRun) -> str:
    """Return the name of the run's folder."""
    how = "repertoire" if job.replan else "repertoire-open"
    return f"{job.run.name}-{job.robot.name}-{how}"
