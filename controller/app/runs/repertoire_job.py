"""A run's waypoints as a sequence of recorded actions: the plan, its file, and its job."""

from collections.abc import Callable
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
from snakewalk.controller.kinematics.links import BodyView, body_in_world, mean_heading_rad
from snakewalk.controller.repertoire.motion import RepertoireMotion
from snakewalk.controller.repertoire.moves import Moves
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.route import Follower
from snakewalk.controller.repertoire.search import Route
from snakewalk.controller.runlog.record import Laid, PlanSummary
from snakewalk.controller.runtime.guide import Guide, SourceGuide
from snakewalk.drivers.types import BodyPose


@dataclass(frozen=True)
class RepertoireJob:
    """What ``execute`` carries out."""

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
    def moves(self) -> Moves:
        """Of the repertoire, for this robot's length."""
        return Moves(self.repertoire, self.robot.length_m / self.repertoire.length_m)

    @property
    def action_names(self) -> list[str]:
        """Of the route."""
        return [self.repertoire.segments[k].name for k in self.route.actions]

    @property
    def start_heading_rad(self) -> float:
        """Mean heading of the body at the start."""
        return start_heading_rad(self.run)

    def laid(self) -> Laid:
        """In the shape with which the first action begins."""
        return laid(self.run, self.robot, self.repertoire, self.route.actions[0])

    def judged(self) -> PlanSummary:
        """The way that the search predicts."""
        return PlanSummary(
            path_m=self.route.pose[:, :2],
            waypoints_m=np.array(self.run.waypoints_m),
            waypoint_radius_m=self.run.waypoint_radius_m,
            predicted_speed_m_s=float(
                np.hypot(*np.diff(self.route.pose[:, :2], axis=0).T).sum() / self.route.duration_s
            ),
        )

    def follower(self) -> Follower:
        """Return a fresh one."""
        run = self.run
        return Follower(
            self.moves, self.route, run.waypoints_m, run.waypoint_radius_m, replan=self.replan
        )

    def guide(self, say: Callable[[str, str], None]) -> Guide:
        """Return a fresh guide."""
        return RouteGuide(self, self.follower(), say)


class WatchedJob(RepertoireJob):
    """A job whose follower stays, for what was predicted and measured: for one run."""

    @staticmethod
    def of(job: RepertoireJob) -> "WatchedJob":
        """Return the same job, watched."""
        return WatchedJob(
            job.run,
            job.robot,
            job.world,
            job.repertoire,
            job.repertoire_file,
            job.route,
            job.replan,
        )

    @cached_property
    def kept(self) -> Follower:
        """The follower of the run."""
        return super().follower()

    def follower(self) -> Follower:
        """Return the one that is kept."""
        return self.kept


class RouteGuide(SourceGuide):
    """Plays the actions and counts waypoints; rests when all are reached."""

    def __init__(
        self, job: RepertoireJob, follower: Follower, say: Callable[[str, str], None]
    ) -> None:
        self.follower = follower
        self._names = [segment.name for segment in job.repertoire.segments]
        self._path_m = job.route.pose[:, :2]
        self._say = say
        self._motion = RepertoireMotion(
            job.repertoire, job.robot, job.route.actions[0], self._choose
        )
        super().__init__(self._motion)
        say("action", self._names[job.route.actions[0]])

    @property
    def done(self) -> bool:
        """Whether every waypoint has been reached."""
        return self.follower.done

    @property
    def reached(self) -> int:  # type: ignore[override]
        """Waypoints reached."""
        return self.follower.reached

    def path_m(self, points: int) -> Floats:
        """(points, 2) of the route as planned."""
        at = np.linspace(0.0, len(self._path_m) - 1.0, points)
        known = np.arange(len(self._path_m))
        return np.column_stack([np.interp(at, known, self._path_m[:, k]) for k in (0, 1)])

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Go on by ``dt_s``."""
        self.follower.watch(view)
        if self.follower.done:
            self._motion.stop()
        return self._motion.step(dt_s, view)

    def _choose(self, view: BodyView) -> int | None:
        action = self.follower.choose(view)
        if action is not None:
            self._say("action", self._names[action])
        return action


def start_heading_rad(run: RunConfig) -> float:
    """As given, or towards the first waypoint."""
    if run.start_heading_rad is not None:
        return run.start_heading_rad
    x, y = np.subtract(run.waypoints_m[0], run.start_m)
    return float(np.arctan2(y, x))


def laid(run: RunConfig, robot: RobotConfig, repertoire: Repertoire, action: int) -> Laid:
    """Shape with which ``action`` begins, along the start heading."""
    joints = repertoire.segments[action].goal_rad[0]
    return Laid(start_heading_rad(run) - mean_heading_rad(robot, joints), joints)


def laid_frame(run: RunConfig, robot: RobotConfig, lies: Laid) -> Frame:
    """Body frame of a robot laid down so."""
    head = Frame.flat(*run.start_m, lies.heading_rad, robot.body_radius_m)
    pose = BodyPose(0.0, head.origin_m, head.rotation)
    return body_frame(body_in_world(robot, pose, lies.joint_rad).link_m)
