"""Pose source of a run: a plug-in that provides the pose of the head."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.plugins import require
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.pose.external_pose import MeasuredHeads
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runlog.evidence import SIMULATED, Kind, PoseEvidence
from snakewalk.controller.runtime.drive import OnEvent, PoseSource
from snakewalk.controller.runtime.pose_hold import PoseHealth
from snakewalk.drivers.types import BodyPose, JointState

OnPicture = Callable[[Image, float], None]
"""Accepts a picture (H, W, 3), blue first, and its time in seconds."""


@dataclass(frozen=True, slots=True)
class PoseContext:
    """Parts of a run that a pose source may use."""

    prepared: PreparedRun
    backend: Backend
    reckoning: DeadReckoning
    """Dead reckoning from the joints, for a source's prediction."""
    argument: str
    """Text after the colon of ``--pose NAME:ARGUMENT``."""
    on_event: OnEvent
    on_picture: OnPicture
    """Function that accepts each picture of a camera with its time."""


class PosePlugin(Protocol):
    """A pose source, as a plug-in provides it."""

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return the faults of the source in a run, one per line."""
        ...

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        """Return how the poses of the source are known."""
        ...

    def open(self, context: PoseContext) -> AbstractContextManager["PoseProvider"]:
        """Open the source for the time of a run."""
        ...


def pose_plugin(pose: str) -> tuple[PosePlugin, str]:
    """Return the source that ``pose`` or ``--pose`` names, and its argument.

    Raises:
        InputError: the source does not exist.

    """
    name, _, argument = pose.partition(":")
    return require("pose", name, "pose").load()(), argument


def pose_faults(run: RunConfig, robot: RobotConfig, world: WorldConfig, *, metal: bool) -> None:
    """Reject a pose source that cannot work here.

    Raises:
        InputError: one line per fault, or a missing extra.

    """
    if run.pose is None:
        return
    source, _ = pose_plugin(run.pose)
    faults = source.faults(run, robot, world, on_port=metal)
    if faults:
        raise InputError(faults)


def pose_evidence(prepared: PreparedRun, backend: Backend) -> PoseEvidence:
    """Return how the poses of a run are known."""
    run = prepared.run
    robot = prepared.robot
    if backend.pose is not None and run.pose_is_true:
        return SIMULATED
    if run.pose is None:
        return PoseEvidence(Kind.DEAD_RECKONED, "joints" if robot.imu is None else "imu")
    return pose_plugin(run.pose)[0].evidence(run, robot)


@dataclass(frozen=True, slots=True)
class PoseError:
    """Error of an estimated pose against the simulator's."""

    head_m: Floats
    """(T,) distance between the centres of the head link."""
    heading_rad: Floats
    """(T,) absolute difference of the headings of the head link, rad."""
    waypoints_reached: int
    """Waypoints reached by the body's true centre, in order."""

    @property
    def head_rms_m(self) -> float:
        """Root mean square distance of the head; NaN before a pose was measured."""
        return _rms(self.head_m) if self.head_m.size else float("nan")

    def facts(self) -> dict[str, float | int]:
        """Numbers for log and answer."""
        if not self.head_m.size:
            return {}
        return {
            "head_error_rms_m": round(self.head_rms_m, 4),
            "head_error_max_m": round(float(self.head_m.max()), 4),
            "heading_error_rms_rad": round(_rms(self.heading_rad), 4),
            "heading_error_max_rad": round(float(self.heading_rad.max()), 4),
            "waypoints_truly_reached": self.waypoints_reached,
        }


@dataclass
class PoseProvider:
    """Measures the pose of the head for a run, and its accuracy."""

    measure: PoseSource
    source_facts: Callable[[], dict[str, float | int]] = dict
    """Numbers of the source, such as the frames of a camera."""
    health: PoseHealth | None = None
    """Whether the pose is credible; None for a source without this check."""
    measured_heads: Callable[[], MeasuredHeads] | None = None
    """Returns the measurements of an external source since the last call."""
    error: PoseError | None = None
    """Set after a run with an estimated pose and a known true one."""

    def facts(self) -> dict[str, float | int]:
        """Frames of a camera, and errors if the true pose is known."""
        facts: dict[str, float | int] = {} if self.error is None else self.error.facts()
        return facts | self.source_facts()


@dataclass
class PoseComparison:
    """An estimated pose with the simulator's, which the run never uses."""

    prepared: PreparedRun
    estimate: PoseSource
    true: Callable[[], BodyPose]
    _head_m: list[float] = field(default_factory=list)
    _heading_rad: list[float] = field(default_factory=list)
    _reached_count: int = 0

    def __call__(self, state: JointState) -> BodyPose:
        """Return the estimated pose."""
        pose = self.estimate(state)
        true = self.true()
        self._head_m.append(float(np.hypot(*(pose.head_in_world_m - true.head_in_world_m)[:2])))
        turn = pose.heading_rad - true.heading_rad
        self._heading_rad.append(float(abs(np.angle(np.exp(1j * turn)))))
        run = self.prepared.run
        if self._reached_count < len(run.waypoints_m):
            centre = body_in_world(self.prepared.robot, true, state.position_rad).centre_m[:2]
            away = np.hypot(*(centre - run.waypoints_m[self._reached_count]))
            self._reached_count += int(away <= run.waypoint_radius_m)
        return pose

    def error(self) -> PoseError:
        """Return the errors so far."""
        return PoseError(np.array(self._head_m), np.array(self._heading_rad), self._reached_count)


@contextmanager
def pose_provider(
    prepared: PreparedRun,
    backend: Backend,
    on_event: OnEvent,
    on_picture: OnPicture = lambda picture, time_s: None,
) -> Iterator[PoseProvider]:
    """Make the run's provider; at the end ``on_event`` receives its accuracy.

    ``on_picture`` receives each picture of a camera with its time.

    Raises:
        InputError: the camera is missing, does not show the robot, or cannot work here.

    """
    run = prepared.run
    robot = prepared.robot
    true = backend.pose
    if true is not None and run.pose_is_true:
        measured = true
        yield PoseProvider(lambda state: measured())
        return
    reckoning = DeadReckoning(
        robot,
        prepared.world.friction,
        run.start_m,
        prepared.start_heading_rad,
        imu=run.pose == "imu" or (run.pose is None and robot.imu is not None),
    )
    comparison: PoseComparison | None = None
    with ExitStack() as stack:
        if run.pose is None:
            provider = PoseProvider(reckoning)
        else:
            source, argument = pose_plugin(run.pose)
            context = PoseContext(prepared, backend, reckoning, argument, on_event, on_picture)
            provider = stack.enter_context(source.open(context))
        if true is not None:
            provider.measure = comparison = PoseComparison(prepared, provider.measure, true)
        yield provider
        if comparison is not None:
            provider.error = comparison.error()
    facts = provider.facts()
    if facts:
        on_event("pose", ", ".join(f"{key} {value}" for key, value in facts.items()))


class _DeadReckonedPose:
    source = "joints"

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        return PoseEvidence(Kind.DEAD_RECKONED, self.source)

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        return []

    @contextmanager
    def open(self, context: PoseContext) -> Iterator[PoseProvider]:
        yield PoseProvider(context.reckoning)


@plugin("pose", "joints")
class JointsPose(_DeadReckonedPose):
    """Dead reckoning from the joint angles alone."""


@plugin("pose", "imu")
class ImuPose(_DeadReckonedPose):
    """Dead reckoning from the joints and the heading of the robot's IMU."""

    source = "imu"

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return a fault if the robot has no IMU."""
        if robot.imu is not None:
            return []
        return [f"pose: robot {robot.name} has no IMU: describe it in its file, table [imu]"]


@plugin("pose", "simulator")
class SimulatorPose(_DeadReckonedPose):
    """The true pose of the simulated body."""

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        """Return that the simulator measures the pose."""
        return SIMULATED

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return a fault if servos are on a port."""
        if not on_port:
            return []
        return ["pose: servos on a port have no simulator; use udp, camera, imu or joints"]


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values * values)))
