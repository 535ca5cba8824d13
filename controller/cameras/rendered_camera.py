"""The overhead camera of a simulated run: rendered top views."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.camera import CameraConfig
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.cameras.camera_frames import (
    CHECK_FRAMES,
    OnPicture,
    SimulatedFrames,
    centre_of,
    require_whole_body,
)
from snakewalk.controller.cameras.camera_pose import PriorAt
from snakewalk.controller.cameras.floor_learning import FloorLearning
from snakewalk.controller.cameras.ground_rest import heights_of
from snakewalk.controller.cameras.markers.floor_markers import marker_picture
from snakewalk.controller.cameras.overhead_camera import (
    CameraModel,
    LineDetection,
    OverheadDetector,
)
from snakewalk.controller.cameras.pose_tracking import BodyPrior, TrackedPose
from snakewalk.drivers.clock import Clock
from snakewalk.sim.rendering.looks import FloorPrint
from snakewalk.sim.rendering.top_view import TopView


def floor_prints(camera: CameraConfig) -> list[FloorPrint]:
    """The printed markers of a simulated floor, each with a white margin of a cell."""
    prints = []
    for number, place_m in camera.marker_places_m.items():
        drawn = marker_picture(number, 96)
        cell = len(drawn) // 6
        sheet = np.pad(drawn, cell, constant_values=255)
        prints.append(FloorPrint(place_m, camera.marker_side_m * len(sheet) / len(drawn), sheet))
    return prints


def top_view(
    run: RunConfig, robot: RobotConfig, world: WorldConfig, ground: HeightField | None
) -> TopView:
    """Return the view of the simulator's camera."""
    camera = run.camera
    return TopView(robot, world, camera, centre_of(run), run.seed, floor_prints(camera), ground)


def rendered_detector(
    run: RunConfig, robot: RobotConfig, floor: Image, ground: HeightField | None
) -> OverheadDetector:
    """Build the detector of the simulator's camera from a picture (H, W, 3) of the empty floor.

    Raises:
        InputError: its markers fix no floor.

    """
    camera = run.camera
    model = CameraModel.of_floor(camera, centre_of(run), None, floor)
    model = replace(model, heights=heights_of(ground))
    return OverheadDetector(model, floor, robot.body_radius_m, camera.shade)


class RenderedCamera:
    """The simulated robot from above; each frame arrives a period after it was taken.

    A frame is taken at the first joint read at or after its time, and dated with it.

    Raises:
        OffscreenError: no off-screen OpenGL.

    """

    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        qpos: Callable[[], Floats],
        clock: Clock,
        on_picture: OnPicture = lambda picture, time_s: None,
        ground: HeightField | None = None,
    ) -> None:
        self._view = top_view(run, robot, world, ground)
        self.detector = rendered_detector(run, robot, self._view.empty_floor(), ground)
        self._qpos = qpos
        self._clock = clock
        self._on_picture = on_picture
        self._frames = SimulatedFrames[LineDetection | TrackedPose](
            run.camera.rate_hz, clock.now_s()
        )
        self._robot = robot
        self._learning = FloorLearning(robot, run.camera.learn_s)
        self._taken = 0
        require_whole_body(self.first(), "the simulated camera")

    def first(self) -> LineDetection:
        """Detect the body now."""
        return self.detector.detect(self._view.picture(self._qpos()), self._clock.now_s())

    def arrived(self, now_s: float, prior_at: PriorAt) -> list[LineDetection | TrackedPose]:
        """Capture a frame if due; return arrived ones."""
        return self._frames.arrived(now_s, lambda: self._track(now_s, prior_at(now_s)))

    def close(self) -> None:
        """Free the frame buffer."""
        self._view.close()

    def _track(self, now_s: float, prior: BodyPrior | None) -> LineDetection | TrackedPose:
        picture = self._view.picture(self._qpos())
        self._on_picture(picture[..., ::-1], now_s)
        self._taken += 1
        if self._taken % CHECK_FRAMES == 0:
            self.detector = self.detector.registered(picture)
        if prior is None:
            return self.detector.detect(picture, now_s)
        detection = self.detector.track(picture, now_s, prior, self._robot)
        self.detector = self._learning.after(self.detector, picture, prior, detection)
        return detection
