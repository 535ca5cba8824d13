"""A drawn floor with printed markers below one camera, and the detector that was set up on it."""

from snakewalk.config.camera import CameraConfig
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from tests.oracles.overhead_scene import DrawnView

ROBOT = load_robot("yaw16")
PLACES = {0: (-1.3, -0.95), 3: (1.3, -0.95), 7: (1.3, 0.95), 12: (-1.3, 0.9), 20: (0.0, 0.95)}
CAMERA = CameraConfig(
    width_px=320, height_px=240, field_width_m=3.0, height_m=3.0,
    markers_m={str(number): place for number, place in PLACES.items()},
)  # fmt: skip
"""320 px at 3 m: a pixel is 9.4 mm, a marker 16 px wide."""
TRUE = CameraModel.straight_down(CAMERA, (0.0, 0.0))
VIEW = DrawnView(ROBOT, TRUE, (320, 240), markers_m=PLACES)
FLOOR = VIEW.empty_floor()
DETECTOR = OverheadDetector(
    CameraModel.from_markers(CAMERA, (0.0, 0.0), None, FLOOR),
    FLOOR,
    ROBOT.body_radius_m,
    CAMERA.shade,
)
