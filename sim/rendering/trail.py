"""Lines on the ground of a picture: trails of head and body, paths, and a scale."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from snakewalk.config import colours
from snakewalk.config.arrays import Floats
from snakewalk.config.colours import rgba
from snakewalk.config.heightfield import HeightField

Rgba = tuple[float, float, float, float]
PATH: Rgba = rgba(colours.PATH)
"""Colour of the path that the run follows."""
FORMER: Rgba = rgba(colours.PATH, 0.35)
"""Colour of a path that another one replaced."""
TRAIL: Rgba = rgba(colours.HEAD)
"""Colour of the trail of the head."""
CENTRE: Rgba = rgba(colours.CENTRE)
"""Colour of the trail of the body's centre."""
AXES: tuple[Rgba, Rgba] = ((0.80, 0.12, 0.12, 1), (0.10, 0.50, 0.15, 1))
"""Colours of the world's x and y axes."""
AXES_GEOMS = 5
_AXES_SAMPLES = 9
"""Points of each rod at which the ground is looked up (ours)."""
LIFT_M = 0.004
SPACING_M = 0.12
"""Distance between the dots of a path, m."""
STEP_M = 0.03
"""Distance between the points of the head's trail, m."""
MOST = 400
"""Dots of a path, pieces of the trail: its end is drawn."""


@dataclass(frozen=True, slots=True)
class TrailLine:
    """Trail of a point of the body."""

    time_s: Floats
    """(H,) when it was at each point of the line."""
    points_m: Floats
    """(H, 3) points of the head's trail, on the ground."""
    rgba: Rgba

    def add(self, scene: mujoco.MjvScene, now_s: float) -> None:
        """Append the end of the line up to a time."""
        past_count = int(np.searchsorted(self.time_s, now_s, side="right"))
        for k in range(max(1, past_count - MOST), past_count):
            kind = mujoco.mjtGeom.mjGEOM_LINE
            piece = _next_geom(scene)
            mujoco.mjv_initGeom(piece, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), self.rgba)
            mujoco.mjv_connector(piece, kind, 3.0, self.points_m[k - 1], self.points_m[k])


@dataclass(frozen=True, slots=True)
class Trail:
    """Dots and lines of the frames."""

    starts_s: Floats
    """(K,) from when on each path is in force, increasing."""
    dots_m: tuple[Floats, ...]
    """Dots of K paths, (D, 3) each, on the ground."""
    lines: tuple[TrailLine, ...]
    """Lines of the head and of the body's centre."""
    dot_radius_m: float

    @property
    def most(self) -> int:
        """Largest number of geoms of a frame."""
        return max((len(dots) for dots in self.dots_m), default=0) * 2 + MOST * len(self.lines)

    def add(self, scene: mujoco.MjvScene, now_s: float) -> None:
        """Append dots and lines to an updated scene with enough free geoms.

        It draws the path in force, the previous one in pale, and the trails.
        """
        current = int(np.searchsorted(self.starts_s, now_s, side="right")) - 1
        for k, colour in ((current - 1, FORMER), (current, PATH)):
            for at_m in self.dots_m[k] if k >= 0 else ():
                mujoco.mjv_initGeom(
                    _next_geom(scene),
                    mujoco.mjtGeom.mjGEOM_SPHERE,
                    np.full(3, self.dot_radius_m),
                    at_m,
                    np.eye(3).ravel(),
                    colour,
                )
        for line in self.lines:
            line.add(scene, now_s)


def make_trail(
    paths: Sequence[tuple[float, Floats]],
    time_s: Floats,
    head_m: Floats,
    centre_m: Floats,
    ground: HeightField | None,
    size: float = 1.0,
) -> Trail:
    """Lay paths (P, 2), each with its start time, and trails on the ground.

    ``paths`` are in order of time. ``time_s`` (T,) increases; ``head_m`` and ``centre_m`` are (T, 2
    or more). ``ground`` None is a plane. ``size`` is ``looks.mark_size``.
    """
    return Trail(
        starts_s=np.array([start for start, _ in paths], dtype=float),
        dots_m=tuple(_on_ground(_dots(path, size), ground) for _, path in paths),
        lines=(
            _line(time_s, centre_m, ground, CENTRE),
            _line(time_s, head_m, ground, TRAIL),
        ),
        dot_radius_m=0.012 * size,
    )


def add_axes(
    scene: mujoco.MjvScene, at_m: Floats, length_m: float, ground: HeightField | None
) -> None:
    """Append rods along the world's x and y, around (2,), above the ground."""
    at_m = at_m - 0.5 * length_m  # so that both stay close to the place
    along_m = np.linspace(0.0, length_m, _AXES_SAMPLES)[:, None]
    below = np.concatenate([at_m + along_m * np.eye(2)[axis] for axis in range(2)])
    highest_m = _on_ground(below, ground)[:, 2].max()
    foot = np.array([*at_m, highest_m + 0.03 * length_m])  # no hill hides a rod
    rod = mujoco.mjtGeom.mjGEOM_CAPSULE
    still = (np.zeros(3), np.zeros(3), np.eye(3).ravel())
    _label(scene, foot - [0.3 * length_m, 0.3 * length_m, 0.0], f"{length_m:g} m")
    for axis, (name, colour) in enumerate(zip("xy", AXES, strict=True)):
        along = np.eye(3)[axis] * length_m
        geom = _next_geom(scene)
        mujoco.mjv_initGeom(geom, rod, *still, colour)
        mujoco.mjv_connector(geom, rod, 0.03 * length_m, foot, foot + along)
        _label(scene, foot + 1.1 * along, name)


def _label(scene: mujoco.MjvScene, at_m: Floats, text: str) -> None:
    geom = _next_geom(scene)
    white = (1.0, 1.0, 1.0, 1.0)
    kind = mujoco.mjtGeom.mjGEOM_LABEL
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), at_m, np.eye(3).ravel(), white)
    geom.label = text


def _line(time_s: Floats, point_m: Floats, ground: HeightField | None, rgba: Rgba) -> TrailLine:
    rows = np.flatnonzero(np.diff(np.floor(_arc_m(point_m) / STEP_M), prepend=-1.0) > 0)
    return TrailLine(time_s[rows], _on_ground(point_m[rows, :2], ground), rgba)


def _next_geom(scene: mujoco.MjvScene) -> mujoco.MjvGeom:
    scene.ngeom += 1
    return scene.geoms[scene.ngeom - 1]


def _dots(path_m: Floats, size: float) -> Floats:
    """Points of a path at equal arc lengths (D, 2)."""
    if len(path_m) < 2:
        return np.zeros((0, 2))
    arc = _arc_m(path_m)
    arc_m = np.arange(0.0, arc[-1], max(SPACING_M * size, arc[-1] / MOST))
    return np.column_stack([np.interp(arc_m, arc, path_m[:, k]) for k in range(2)])


def _arc_m(points_m: Floats) -> Floats:
    steps = np.linalg.norm(np.diff(points_m[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], steps.cumsum()])


def _on_ground(points_m: Floats, ground: HeightField | None) -> Floats:
    x, y = points_m.T
    z = np.zeros_like(x) if ground is None else ground.elevation_m(x, y)
    return np.column_stack([x, y, z + LIFT_M])
