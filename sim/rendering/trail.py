"""Lines on the ground of a picture: where the head went, and the paths that it follows."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField

Rgba = tuple[float, float, float, float]
PATH: Final[Rgba] = (0.98, 0.98, 0.95, 1)
"""Of the path in force."""
FORMER: Final[Rgba] = (0.98, 0.98, 0.95, 0.35)
"""Of a path that another one replaced."""
TRAIL: Final[Rgba] = (0.20, 0.33, 0.62, 1)
LIFT_M = 0.004
SPACING_M = 0.12
"""Between dots of a path."""
STEP_M = 0.03
"""Between points of the trail."""
MOST = 400
"""Dots of a path, pieces of the trail: its end is drawn."""


@dataclass(frozen=True, slots=True)
class Trail:
    """What the lines of each frame are made of."""

    starts_s: Floats
    """(K,) from when on each path is in force, increasing."""
    dots_m: tuple[Floats, ...]
    """K times (D, 3), on the ground."""
    head_s: Floats
    """(H,) when the head was at each point of its trail."""
    head_m: Floats
    """(H, 3), on the ground."""

    @property
    def most(self) -> int:
        """Most geoms that a frame takes."""
        return max((len(dots) for dots in self.dots_m), default=0) * 2 + MOST

    def add(self, scene: mujoco.MjvScene, now_s: float) -> None:
        """Append dots and lines to a scene that was just updated and has room for them.

        Drawn are the path in force, pale the one before it, and the head's trail.
        """
        current = int(np.searchsorted(self.starts_s, now_s, side="right")) - 1
        for k, rgba in ((current - 1, FORMER), (current, PATH)):
            for at_m in self.dots_m[k] if k >= 0 else ():
                mujoco.mjv_initGeom(
                    _next(scene), mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, 0.012), at_m,
                    np.eye(3).ravel(), rgba,
                )  # fmt: skip
        been = int(np.searchsorted(self.head_s, now_s, side="right"))
        for k in range(max(1, been - MOST), been):
            line = _next(scene)
            mujoco.mjv_initGeom(
                line, mujoco.mjtGeom.mjGEOM_LINE, np.zeros(3), np.zeros(3), np.eye(3).ravel(), TRAIL
            )
            mujoco.mjv_connector(
                line, mujoco.mjtGeom.mjGEOM_LINE, 3.0, self.head_m[k - 1], self.head_m[k]
            )


def make_trail(
    paths: Sequence[tuple[float, Floats]],
    time_s: Floats,
    head_m: Floats,
    ground: HeightField | None,
) -> Trail:
    """Lay paths, each (P, 2) with the time from when on it is in force, and the head on the ground.

    Args:
        paths: in the order of their times; none on a run without a path.
        time_s: (T,) increasing.
        head_m: (T, 2 or more) the head's x and y at these times.
        ground: None on a plane.

    """
    arc = _arc_m(head_m)
    rows = np.flatnonzero(np.diff(np.floor(arc / STEP_M), prepend=-1.0) > 0)
    return Trail(
        starts_s=np.array([start for start, _ in paths], dtype=float),
        dots_m=tuple(_on_ground(_dots(path), ground) for _, path in paths),
        head_s=time_s[rows],
        head_m=_on_ground(head_m[rows, :2], ground),
    )


def _next(scene: mujoco.MjvScene) -> mujoco.MjvGeom:
    scene.ngeom += 1
    return scene.geoms[scene.ngeom - 1]


def _dots(path_m: Floats) -> Floats:
    """Points of a path at equal arc length (D, 2)."""
    if len(path_m) < 2:
        return np.zeros((0, 2))
    arc = _arc_m(path_m)
    at = np.arange(0.0, arc[-1], max(SPACING_M, arc[-1] / MOST))
    return np.column_stack([np.interp(at, arc, path_m[:, k]) for k in range(2)])


def _arc_m(points_m: Floats) -> Floats:
    steps = np.linalg.norm(np.diff(points_m[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], steps.cumsum()])


def _on_ground(points_m: Floats, ground: HeightField | None) -> Floats:
    x, y = points_m.T
    z = np.zeros_like(x) if ground is None else ground.elevation_m(x, y)
    return np.column_stack([x, y, z + LIFT_M])
