"""Pictures of a morphable model: textured triangles of a pixel grid with a depth buffer ([KP] 3.5).

Both meshes, of the valid region and of its part with counterparts, are drawn in one pass: without a
counterpart the share of the second texture is 0.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats, Image, Singles
from snakewalk.drivers.compiling import callable_in_loops, compiled, readonly_array

NEAREST_M = 0.01
"""Triangles with a nearer corner are not drawn (ours)."""
_UNSEEN = np.full(3, 150, np.uint8)
"""Colour of unseen pixels (ours)."""
_MATRIX = readonly_array("float64", 2, "C")
_FLOATS = readonly_array("float64", 3, "C")
_BYTES = readonly_array("uint8", 3, "C")
_BOOLS = readonly_array("bool_", 2, "A")


@dataclass(slots=True)
class Canvas:
    """A picture with its depth buffer."""

    colour: Bytes
    """(H, W, 3) colours of the picture."""
    depth_m: Floats
    """(H, W); infinite where nothing was drawn."""
    blocked: Bools
    """(H, W) pixels that no longer change."""

    @classmethod
    def blank(cls, wide: int, tall: int) -> "Canvas":
        """Return an empty canvas."""
        return cls(
            np.zeros((tall, wide, 3), np.uint8),
            np.full((tall, wide), np.inf),
            np.zeros((tall, wide), bool),
        )

    @property
    def drawn(self) -> Bools:
        """(H, W) pixels that a triangle covers."""
        return np.isfinite(self.depth_m)

    def with_unseen(self) -> Image:
        """(H, W, 3) picture in which the pixels that no camera saw are grey."""
        return np.where(self.drawn[..., None], self.colour, _UNSEEN)


@dataclass(frozen=True, slots=True)
class SecondTexture:
    """Second texture of a grid."""

    texture: Image
    counterpart_px: Floats
    """(H, W, 2) vertices in the second texture, or NaN."""
    share: float
    """Share of the second texture at a counterpart."""


def draw(
    canvas: Canvas,
    points_m: Floats,
    projection: Floats,
    drawn: Bools,
    texture: Image,
    blend: SecondTexture | None = None,
) -> None:
    """Draw a textured grid.

    Args:
        canvas: target.
        points_m: (H, W, 3) vertices.
        projection: (3, 4) matrix from vertices to pixels of the canvas.
        drawn: (H - 1, W - 1) cells to draw.
        texture: picture whose pixels are the vertices.
        blend: second texture.

    """
    screen = np.empty(points_m.shape)
    _project(np.ascontiguousarray(points_m), np.ascontiguousarray(projection), screen)
    source_px = np.full((*canvas.depth_m.shape, 2), np.nan, np.float32)
    _rasterise(screen, drawn, canvas.blocked, canvas.depth_m, source_px)
    if blend is None:
        blend = SecondTexture(texture, np.empty((1, 1, 2)), 0.0)
    _paint(
        np.ascontiguousarray(texture),
        np.ascontiguousarray(blend.texture),
        np.ascontiguousarray(blend.counterpart_px),
        blend.share,
        source_px,
        canvas.colour,
    )


@compiled(f"void({_FLOATS}, {_MATRIX}, float64[:, :, ::1])", makes_arrays=False)
def _project(points: Floats, projection: Floats, screen: Floats) -> None:
    """Write columns, rows and inverse depths of points (H, W, 3); NaN behind the camera."""
    for row in range(points.shape[0]):
        for column in range(points.shape[1]):
            x, y, z = points[row, column, 0], points[row, column, 1], points[row, column, 2]
            a, b, c, d = projection[2, 0], projection[2, 1], projection[2, 2], projection[2, 3]
            depth = a * x + b * y + c * z + d
            over = 1.0 / depth if depth > NEAREST_M else np.nan
            for k in range(2):
                a, b, c, d = projection[k, 0], projection[k, 1], projection[k, 2], projection[k, 3]
                screen[row, column, k] = (a * x + b * y + c * z + d) * over
            screen[row, column, 2] = over


@compiled(
    f"void({_FLOATS}, {_BOOLS}, {_BOOLS}, float64[:, ::1], float32[:, :, ::1])", makes_arrays=False
)
def _rasterise(  # noqa: C901  a compiled loop
    screen: Floats,
    drawn: Bools,
    blocked: Bools,
    depth: Floats,
    source: Singles,
) -> None:
    """Write the depth and the source (column, row) of the nearest triangle of each pixel.

    ``screen`` (H, W, 3) holds columns, rows and inverse depths; NaN behind the camera.
    """
    tall, wide = depth.shape
    for row in range(drawn.shape[0]):
        for column in range(drawn.shape[1]):
            if not drawn[row, column]:
                continue
            for half in range(2):
                ax, ay = screen[row + half, column, 0], screen[row + half, column, 1]
                bx, by = screen[row + 1, column + half, 0], screen[row + 1, column + half, 1]
                cx, cy = screen[row, column + 1, 0], screen[row, column + 1, 1]
                left, right = max(np.ceil(min(ax, bx, cx)), 0.0), min(max(ax, bx, cx), wide - 1.0)
                top, bottom = max(np.ceil(min(ay, by, cy)), 0.0), min(max(ay, by, cy), tall - 1.0)
                area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
                if not (left <= right and top <= bottom and area * area > 0.0):
                    continue
                a = screen[row + half, column, 2]
                b = screen[row + 1, column + half, 2]
                c = screen[row, column + 1, 2]
                over_area = 1.0 / area
                for y in range(int(top), int(bottom) + 1):
                    for x in range(int(left), int(right) + 1):
                        if blocked[y, x]:
                            continue
                        v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) * over_area
                        w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) * over_area
                        if min(1.0 - v - w, v, w) < -1e-9:
                            continue
                        over = (1.0 - v - w) * a + v * b + w * c
                        if over * depth[y, x] <= 1.0:
                            continue
                        depth[y, x] = 1.0 / over
                        v, w = v * b / over, w * c / over
                        source[y, x, 0] = column + v * half + w
                        source[y, x, 1] = row + (1.0 - v - w) * half + v


@callable_in_loops
def _bilinear(values: NDArray[Any], column: float, row: float, channel: int) -> float:
    """Bilinear value of an array (H, W, k) at a place, whose border continues outwards."""
    column = min(max(column, 0.0), values.shape[1] - 1.0)
    row = min(max(row, 0.0), values.shape[0] - 1.0)
    x, y = min(int(column), values.shape[1] - 2), min(int(row), values.shape[0] - 2)
    p, q = column - x, row - y
    upper = (1.0 - p) * values[y, x, channel] + p * values[y, x + 1, channel]
    lower = (1.0 - p) * values[y + 1, x, channel] + p * values[y + 1, x + 1, channel]
    return float((1.0 - q) * upper + q * lower)


@compiled(
    f"void({_BYTES}, {_BYTES}, {_FLOATS}, float64, float32[:, :, ::1], uint8[:, :, ::1])",
    makes_arrays=False,
)
def _paint(
    texture: Image,
    second: Image,
    counterpart: Floats,
    share: float,
    source: Singles,
    colour: Bytes,
) -> None:
    """Write the colours of pixels with a source; NaN: none."""
    for y in range(source.shape[0]):
        for x in range(source.shape[1]):
            u, v = source[y, x, 0], source[y, x, 1]
            if np.isnan(u):
                continue
            part, s, t = 0.0, 0.0, 0.0
            if share > 0.0:
                s, t = _bilinear(counterpart, u, v, 0), _bilinear(counterpart, u, v, 1)
                part = 0.0 if np.isnan(s + t) else share
            for k in range(3):
                value = (1.0 - part) * _bilinear(texture, u, v, k)
                if part > 0.0:
                    value += part * _bilinear(second, s, t, k)
                colour[y, x, k] = int(value + 0.5)
