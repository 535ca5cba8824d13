"""Skeleton to joints: tangent angles to yaw joints, respecting link lengths.

Links without a yaw joint between them form one rigid group. A group's heading is the mean tangent
angle over its span, so the mean heading is kept and no angle needs wrapping.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.compiling import compiled, readonly_array


class Retarget:
    """Map skeletons of ``points`` segments, head first, to joint angles of ``robot``."""

    def __init__(self, robot: RobotConfig, points: int = 100) -> None:
        yaw = np.array(robot.yaw_joints, dtype=int)
        if len(yaw) == 0:
            raise InputError(
                f"robot {robot.name}: has no yaw joint, which a walk or a recording needs; "
                "choose another robot, or a gait for pitch joints only (snakewalk gait list)"
            )
        links = robot.link_count
        ends = np.array(robot.link_ends)
        edges = ends[[0, *(yaw + 1), links]]
        self.edges = edges * points / links
        """(G + 1,) ends of the rigid groups, in points from the head."""
        self._yaw = yaw
        self._joints = robot.joint_count
        self.group_of_link = np.repeat(
            np.arange(len(yaw) + 1), np.diff(np.concatenate([[0], yaw + 1, [links]]))
        )
        """(L,) the rigid group of each link."""
        self._points = points
        self._link_lengths_m = np.array(robot.link_lengths_m)
        self._at = ends * points / links
        self._length_m = robot.length_m

    def group_headings_rad(self, skeleton_rad: Floats) -> Floats:
        """(..., G) mean tangent angle over each rigid group; ``skeleton_rad`` is (..., points)."""
        rows = np.ascontiguousarray(skeleton_rad, dtype=float).reshape(-1, self._points)
        headings = np.empty((len(rows), len(self.edges) - 1))
        _mean_angles(rows, self.edges, headings)
        return headings.reshape(*skeleton_rad.shape[:-1], -1)

    def joints_rad(self, skeleton_rad: Floats) -> Floats:
        """(..., J) joint angles; pitch joints are 0."""
        headings = self.group_headings_rad(np.asarray(skeleton_rad, dtype=float))
        joints = np.zeros((*headings.shape[:-1], self._joints))
        joints[..., self._yaw] = headings[..., :-1] - headings[..., 1:]
        return joints

    def residual_m(self, skeleton_rad: Floats) -> Floats:
        """(...) largest distance between link ends and the skeleton, both centred on their mean."""
        skeleton = np.asarray(skeleton_rad, dtype=float)
        links = self.group_headings_rad(skeleton)[..., self.group_of_link]
        robot = _ends(links, self._link_lengths_m)
        fine = _ends(skeleton, self._length_m / self._points)
        low = np.minimum(self._at.astype(int), self._points - 1)
        part = (self._at - low)[:, None]
        curve = fine[..., low, :] * (1.0 - part) + fine[..., low + 1, :] * part
        gap = robot - curve
        gap = gap - gap.mean(axis=-2, keepdims=True)
        return np.asarray(np.hypot(gap[..., 0], gap[..., 1]).max(axis=-1))


@compiled(f"void({readonly_array(dimensions=2, layout='C')}, float64[::1], float64[:, ::1])")
def _mean_angles(rows_rad: Floats, edges: Floats, means: Floats) -> None:
    """Write means (S, G) of angles (S, N) between ``edges`` (G + 1,), in samples."""
    points = rows_rad.shape[1]
    for row in range(len(rows_rad)):
        area = 0.0
        before = 0.0
        column = 0
        for g in range(len(edges)):
            low = min(int(edges[g]), points - 1)
            while column < low:
                area += rows_rad[row, column]
                column += 1
            part = edges[g] - low
            area_here = area * (1.0 - part) + (area + rows_rad[row, low]) * part
            if g > 0:
                means[row, g - 1] = (area_here - before) / (edges[g] - edges[g - 1])
            before = area_here


def _ends(angles_rad: Floats, step_m: Floats | float) -> Floats:
    """(..., n + 1, 2) ends of n segments of length ``step_m`` behind a head at the origin."""
    ahead = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1)
    steps = ahead * -np.reshape(step_m, (-1, 1))
    zero = np.zeros((*steps.shape[:-2], 1, 2))
    return np.concatenate([zero, np.cumsum(steps, axis=-2)], axis=-2)
