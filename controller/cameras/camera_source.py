"""The overhead camera as a pose source."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING

from snakewalk.config.camera import CameraConfig
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import FlatGround, Water, WorldConfig
from snakewalk.controller.cameras.camera_pose import CameraPose
from snakewalk.controller.cameras.device_camera import DeviceCamera
from snakewalk.controller.console.command import plugin
from snakewalk.controller.run.pose_provider import PoseContext, PoseProvider
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence
from snakewalk.controller.runtime.pose_hold import PoseHealth

if TYPE_CHECKING:
    from snakewalk.controller.cameras.rendered_camera import RenderedCamera


@plugin("pose", "camera")
class OverheadCameraPose:
    """A camera that looks down on known ground, level or not."""

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return why the camera cannot measure the pose here, one line per fault."""
        require_extra("pose: the overhead camera needs", "cv2", "skimage")
        faults = []
        if isinstance(world.ground, Water) or world.obstacle is not None:
            faults.append(
                f"pose: the overhead camera needs dry ground without obstacles; world {world.name} "
                "has water or an obstacle"
            )
        elif not isinstance(world.ground, FlatGround) and run.mapping is not None:
            faults.append(
                "pose: the overhead camera needs known ground; leave --map stereo out, or use "
                "--pose tags"
            )
        if run.motion == "gait" and robot.pitch_joints:
            faults.append(
                "pose: the overhead camera assumes that the body lies flat, and gaits of "
                f"{robot.name} lift or roll it; choose another pose source"
            )
        if run.camera.height_m <= 4.0 * robot.body_radius_m:
            faults.append("camera: height_m: the lens must be well above the robot")
        if on_port:
            faults += _missing(run.camera)
        return faults

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        """Return that the camera measures the pose."""
        return PoseEvidence(Kind.MEASURED, "camera")

    @contextmanager
    def open(self, context: PoseContext) -> Iterator[PoseProvider]:
        """Open the camera for a run.

        Raises:
            InputError: the camera is missing, or does not show the robot.

        """
        robot = context.prepared.robot
        with closing(_camera(context)) as device:
            measure = CameraPose(
                robot,
                device,
                context.reckoning,
                lambda text: context.on_event("camera", text),
                context.prepared.ground,
            )
            distortion = device.detector.model.distortion
            if distortion is not None:
                context.on_event("camera", str(distortion))
            always_believed = PoseHealth(lambda: None, 0.0, measure.row)
            yield PoseProvider(measure, measure.facts, always_believed)


def _camera(context: PoseContext) -> "RenderedCamera | DeviceCamera":
    prepared = context.prepared
    backend = context.backend
    run = prepared.run
    robot = prepared.robot
    ground = prepared.ground
    if ground is not None and float(ground.z_m.max()) > 0.8 * run.camera.height_m:
        raise InputError(
            f"camera: height_m: {run.camera.height_m:g} m above height 0 of the world, whose "
            f"ground rises to {ground.z_m.max():.2f} m; raise the camera"
        )
    if backend.qpos is None:
        return DeviceCamera(run, robot, backend.clock, context.on_picture, prepared.ground)
    from snakewalk.controller.cameras.rendered_camera import RenderedCamera  # noqa: PLC0415  simulator: an extra

    return RenderedCamera(
        run,
        robot,
        prepared.world,
        backend.qpos,
        backend.clock,
        context.on_picture,
        prepared.ground,
    )


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
