"""The stereo head of a simulated run: rendered pictures, and the map from them.

Only the renderer and the physics see the true ground. The map places the content of the pictures by
the measured pose.
"""

from collections import deque
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.camera import MappingConfig, StereoHeadConfig
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world, chain_points_m
from snakewalk.controller.mapping.stereo_camera import RectifiedPair
from snakewalk.controller.mapping.stereo_ground import seen_points
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.rendering.stereo_view import CameraFrame, StereoView, tilted

_BODY_MARGIN_M = 0.03
"""Points so near to the body's own skin, in plan, are left out (ours)."""
_BLUR_PX = 1.0
"""Blur of a moving camera between two instants; its picture is the mean of the instants."""
_MOST_INSTANTS = 5


class StereoHead:
    """Records a pair of pictures each period, and adds its ground to the map once matched.

    Raises:
        OffscreenError: no off-screen OpenGL.

    """

    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField,
        qpos: Callable[[], Floats],
        ground_map: GrowingMap,
    ) -> None:
        assert robot.stereo_head is not None
        assert run.mapping is not None
        self._config: StereoHeadConfig = robot.stereo_head
        self._mapping: MappingConfig = run.mapping
        config = self._config
        self._view = StereoView(
            robot,
            world,
            ground,
            size_px=(config.width_px, config.height_px),
            focal_px=config.focal_px,
            baseline_m=config.baseline_m,
            seed=run.seed,
        )
        self._robot = robot
        self._qpos = qpos
        self._map = ground_map
        self._random = np.random.default_rng([run.seed, 1])
        self._coming: deque[_SeenGround] = deque()
        self._next_s = -np.inf
        self._before: tuple[float, Floats] | None = None
        """Time and qpos (7 + J,) of the last call."""

    def observe(self, now_s: float, pose: BodyPose, joint_rad: Floats) -> None:
        """Record a picture if due, and add the matched ones to the map.

        ``pose`` of the head and ``joint_rad`` (J,) are measured; ``now_s`` is the run's clock.
        """
        qpos = np.array(self._qpos())
        if now_s >= self._next_s - 1e-9:
            self._next_s = now_s + self._mapping.period_s
            body = body_in_world(self._robot, pose, joint_rad)
            points_m, error_m = self._measure_ground(now_s, qpos, body)
            self._coming.append(
                _SeenGround(now_s + self._mapping.latency_s, now_s, points_m, error_m)
            )
        self._before = now_s, qpos
        self.fuse(now_s)

    def fuse(self, now_s: float) -> None:
        """Add matched pictures to the map."""
        while self._coming and self._coming[0].arrives_s <= now_s + 1e-9:
            look = self._coming.popleft()
            self._map.add(look.points_m, look.error_m, look.taken_s)

    def close(self) -> None:
        """Free the frame buffer."""
        self._view.close()

    def _measure_ground(self, now_s: float, qpos: Floats, body: BodyView) -> tuple[Floats, Floats]:
        """(n, 3) ground points in the estimated world frame, and their errors."""
        config = self._config
        left, right = self._view.taken(self._exposed_frames(now_s, qpos), qpos)
        matrix = self._view.camera_matrix
        pair = RectifiedPair(
            left,
            right,
            np.ones(left.shape[:2], bool),
            config.focal_px,
            (float(matrix[0, 2]), float(matrix[1, 2])),
            0.0,
            config.baseline_m,
            np.eye(3),
        )
        _, seen_m, error_m = seen_points(pair, config.disparities, self._mapping.error_m)
        near = np.linalg.norm(seen_m, axis=1) <= self._mapping.far_m
        believed = self._frame(body)
        off = Rotation.from_rotvec(self._random.normal(0.0, config.angle_error_rad, 3))
        at_m = believed.at_m + self._random.normal(0.0, config.position_error_m, 3)
        points_m = seen_m[near] @ (off.as_matrix() @ believed.axes).T + at_m
        self._touch(body)
        free = ~self._is_body(points_m, body)
        return points_m[free], error_m[near][free]

    def _true_frame(self, q: Floats) -> CameraFrame:
        """Pose of the left camera with the body at ``q`` (7 + J,)."""
        turned = Rotation.from_quat(q[3:7], scalar_first=True).as_matrix()
        body = body_in_world(self._robot, BodyPose(0.0, q[:3], turned), q[7:])
        return self._frame(body)

    def _frame(self, body: BodyView) -> CameraFrame:
        config = self._config
        carrier = body.rotation[config.link]
        mount_m = np.array([0.0, 0.5 * config.baseline_m, config.height_m])
        at_m = body.link_m[config.link] + carrier @ mount_m
        return CameraFrame(at_m, tilted(config.tilt_rad, carrier))

    def _exposed_frames(self, now_s: float, qpos: Floats) -> list[CameraFrame]:
        frame = self._true_frame(qpos)
        if self._before is None or now_s <= self._before[0]:
            return [frame]
        share = self._config.exposure_s / (now_s - self._before[0])
        before = self._true_frame(self._before[1])
        turn = Rotation.from_matrix(before.axes @ frame.axes.T).as_rotvec() * share
        moved_m = (before.at_m - frame.at_m) * share
        blur_px = self._config.focal_px * float(np.linalg.norm(turn))
        count = min(1 + round(blur_px / _BLUR_PX), _MOST_INSTANTS)
        return [
            CameraFrame(
                frame.at_m + part * moved_m,
                Rotation.from_rotvec(part * turn).as_matrix() @ frame.axes,
            )
            for part in np.linspace(0.0, 1.0, count)
        ]

    def _touch(self, body: BodyView) -> None:
        """Mark the ground a radius below each link that lies on it."""
        radius_m = np.array(self._robot.link_radii_m)
        self._map.touch(body.link_m - radius_m[:, None] * [0.0, 0.0, 1.0])

    def _is_body(self, points_m: Floats, body: BodyView) -> Bools:
        """(n,) whether points may belong to the body."""
        chain_m = chain_points_m(self._robot, body)[:, :2]
        reach_m = self._robot.body_radius_m + _BODY_MARGIN_M
        low, high = chain_m.min(axis=0) - reach_m, chain_m.max(axis=0) + reach_m
        near = ((points_m[:, :2] > low) & (points_m[:, :2] < high)).all(axis=1)
        close_m = points_m[near, :2]
        hit = np.zeros(int(near.sum()), bool)
        for before, other in pairwise(chain_m):
            along = other - before
            share = (close_m - before) @ along / max(float(along @ along), 1e-12)
            foot_m = before + np.clip(share, 0.0, 1.0)[:, None] * along
            hit |= np.hypot(*(close_m - foot_m).T) < reach_m
        near[near] = hit
        return np.asarray(near)


class _SeenGround(NamedTuple):
    arrives_s: float
    taken_s: float
    points_m: Floats
    error_m: Floats
