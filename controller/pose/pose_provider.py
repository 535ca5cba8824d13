"""What measures the head in a run: the simulator, an overhead camera, an IMU, or the joints."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import FlatGround, WorldConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.dead_reckoning import DeadReckoning
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runtime.drive import OnEvent, PoseSource
from snakewalk.drivers.types import BodyPose, JointState

if TYPE_CHECKING:
    from snakewalk.controller.cameras.camera_pose import CameraPose
    from snakewalk.controller.cameras.device_camera import DeviceCamera
    from snakewalk.controller.cameras.rendered_camera import OnPicture, RenderedCamera


def pose_faults(run: RunConfig, robot: RobotConfig, world: WorldConfig, *, metal: bool) -> None:
    """Refuse a pose source that cannot work here.

    Raises:
        InputError: one line per fault, or the extra that an overhead camera needs is not there.

    """
    faults = []
    if run.pose == "simulator" and metal:
        faults.append("pose: servos on a port have no simulator; take camera, imu or joints")
    if run.pose == "imu" and robot.imu is None:
        faults.append(f"pose: robot {robot.name} has no IMU: describe it in its file, table [imu]")
    if run.pose == "camera":
        require_extra("pose: the overhead camera needs", "cv2", "skimage")
        if not isinstance(world.ground, FlatGround) or world.obstacle is not None:
            faults.append(
                f"pose: the overhead camera needs a bare level floor; world {world.name} has none"
            )
        if run.motion == "gait" and robot.pitch_joints:
            faults.append(
                f"pose: the overhead camera takes the body to lie flat; a gait of {robot.name} "
                "lifts or rolls it"
            )
        if run.camera.height_m <= 4.0 * robot.body_radius_m:
            faults.append("camera: height_m: the lens must be well above the robot")
        if metal:
            faults += _missing(run.camera)
    if faults:
        raise InputError(faults)


def _missing(camera: CameraConfig) -> list[str]:
    return [
        f"camera: {key}: needed with servos on a port: {why}"
        for key, why in (
            ("device", "number, device or address of the camera"),
            ("background", "an image of the empty floor"),
            ("centre_m", "the floor's place under the lens"),
        )
        if getattr(camera, key) is None
        and not (key == "centre_m" and camera.markers_m is not None and camera.lens is not None)
    ]


@dataclass(frozen=True, slots=True)
class PoseError:
    """How far an estimated pose was off from the simulator's."""

    head_m: Floats
    """(T,) distance between the centres of the head link."""
    heading_rad: Floats
    """(T,) absolute difference between its headings."""
    waypoints_reached: int
    """Waypoints reached by the body's true centre, in order."""

    @property
    def head_rms_m(self) -> float:
        """Root of the mean square distance of the head link; NaN before a pose was measured."""
        return _rms(self.head_m) if self.head_m.size else float("nan")

    def facts(self) -> dict[str, float | int]:
        """Numbers for the log and for a command's answer."""
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
    """Measures the pose of the head for a run; knows afterwards how well."""

    measure: PoseSource
    camera: "CameraPose | None" = None
    error: PoseError | None = None
    """Set at the end of a run whose pose was estimated while the simulator knew the true one."""

    def facts(self) -> dict[str, float | int]:
        """Frames of a camera, and errors where the true pose is known."""
        facts: dict[str, float | int] = {} if self.error is None else self.error.facts()
        if self.camera is not None:
            facts |= {"frames": self.camera.frames, "frames_used": self.camera.used}
        return facts


@dataclass
class PoseComparison:
    """An estimated pose beside the simulator's, which is recorded but never used by the run."""

    prepared: PreparedRun
    estimate: PoseSource
    true: Callable[[], BodyPose]
    _head_m: list[float] = field(default_factory=list)
    _heading_rad: list[float] = field(default_factory=list)
    _reached: int = 0

    def __call__(self, state: JointState) -> BodyPose:
        """Return the estimated pose."""
        pose, true = self.estimate(state), self.true()
        self._head_m.append(float(np.hypot(*(pose.head_in_world_m - true.head_in_world_m)[:2])))
        turn = pose.heading_rad - true.heading_rad
        self._heading_rad.append(float(abs(np.arctan2(np.sin(turn), np.cos(turn)))))
        run = self.prepared.run
        if self._reached < len(run.waypoints_m):
            centre = body_in_world(self.prepared.robot, true, state.position_rad).centre_m[:2]
            away = np.hypot(*(centre - run.waypoints_m[self._reached]))
            self._reached += int(away <= run.waypoint_radius_m)
        return pose

    def error(self) -> PoseError:
        """Return the errors so far."""
        return PoseError(np.array(self._head_m), np.array(self._heading_rad), self._reached)


@contextmanager
def pose_provider(
    prepared: PreparedRun,
    backend: Backend,
    on_event: OnEvent,
    on_picture: "OnPicture" = lambda picture, time_s: None,
) -> Iterator[PoseProvider]:
    """Make the provider that the run asks for; at its end ``on_event`` takes how good it was.

    ``on_picture`` takes each picture of a camera with its time.

    Raises:
        InputError: the camera is not there, does not show the robot, or cannot work here.

    """
    run, robot = prepared.run, prepared.robot
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
    provider = PoseProvider(reckoning)
    comparison: PoseComparison | None = None
    with ExitStack() as stack:
        if run.pose == "camera":
            from snakewalk.controller.cameras.camera_pose import CameraPose  # noqa: PLC0415  OpenCV is an extra

            device = stack.enter_context(closing(_camera(prepared, backend, on_picture)))
            provider.measure = provider.camera = CameraPose(
                robot, device, reckoning, lambda text: on_event("camera", text)
            )
        if true is not None:
            provider.measure = comparison = PoseComparison(prepared, provider.measure, true)
        yield provider
        if comparison is not None:
            provider.error = comparison.error()
    facts = provider.facts()
    if facts:
        on_event("pose", ", ".join(f"{key} {value}" for key, value in facts.items()))


def _camera(
    prepared: PreparedRun, backend: Backend, on_picture: "OnPicture"
) -> "RenderedCamera | DeviceCamera":
    run, robot, clock = prepared.run, prepared.robot, backend.clock
    if backend.qpos is None:
        from snakewalk.controller.cameras.device_camera import DeviceCamera  # noqa: PLC0415  OpenCV is an extra

        return DeviceCamera(run, robot, clock, on_picture)
    from snakewalk.controller.cameras.rendered_camera import RenderedCamera  # noqa: PLC0415  OpenCV is an extra

    return RenderedCamera(run, robot, prepared.world, backend.qpos, clock, on_picture)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values * values)))
