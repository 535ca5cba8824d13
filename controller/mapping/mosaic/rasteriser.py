"""Pictures of a morphable model: textured triangles of a pixel grid with a depth buffer ([KP] 3.5).

Both meshes, of the valid region and of its part with counterparts, are drawn in one pass: without a
counterpart the share of the second texture is 0.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats, Image, Ints
from snakewalk.controller.mapping.mosaic.local_model import joined
from snakewalk.drivers.compiling import compiled, readonly_array

NEAREST_M: Final = 0.01
"""Triangles with a nearer corner are not drawn (ours)."""
_ZENITH: Final = np.array([150.0, 183.0, 218.0])
_HORIZON: Final = np.array([236.0, 242.0, 248.0])
"""Colours of the sky at the upper and the lower edge of a picture."""
_MATRIX: Final = readonly_array("float64", 2, "C")
_FLOATS: Final = readonly_array("float64", 3, "C")
_BOOLS: Final = readonly_array("bool_", 2, "A")
_PICTURE: Final = readonly_array("uint8", 3, "C")


@dataclass(slots=True)
class Canvas:
    """A picture with its depth buffer."""

    colour: NDArray[np.uint8]
    """(H, W, 3) colours of the picture."""
    depth_m: Floats
    """(H, W); infinite where nothing was drawn."""

    @classmethod
    def blank(cls, wide: int, tall: int) -> "Canvas":
        """Return an empty canvas."""
        return cls(np.zeros((tall, wide, 3), np.uint8), np.full((tall, wide), np.inf))

    @property
    def drawn(self) -> Bools:
        """(H, W) pixels that a triangle covers."""
        return np.isfinite(self.depth_m)

    def fill(self, other: "Canvas") -> None:
        """Copy another canvas to the uncovered pixels."""
        empty = ~self.drawn
        self.colour[empty] = other.colour[empty]
        self.depth_m[empty] = other.depth_m[empty]

    def under_sky(self) -> Image:
        """(H, W, 3) picture with a light sky above the highest triangle of each column.

        Holes below it stay black, and so do columns at the edge that no model covers, below the
        skyline of nine tenths of the others.
        """
        open_above = np.logical_and.accumulate(~self.drawn, axis=0)
        height = open_above.sum(axis=0)
        skyline = height[height < len(open_above)]
        if len(skyline):
            open_above[round(float(np.quantile(skyline, 0.9))) :, height == len(open_above)] = False
        share = np.linspace(0.0, 1.0, len(self.colour))[:, None, None]
        sky = np.rint((1.0 - share) * _ZENITH + share * _HORIZON).astype(np.uint8)
        return np.where(open_above[..., None], sky, self.colour)


def cells(points_m: Floats) -> Bools:
    """(H - 1, W - 1) grid cells whose four corners belong to one surface."""
    depth = points_m[..., 2]
    along, across = joined(depth, 1), joined(depth, 0)
    return along[:-1] & along[1:] & across[:, :-1] & across[:, 1:]


def draw(
    canvas: Canvas,
    points_m: Floats,
    camera: Floats,
    drawn: Bools,
    first_image: Image,
    other: Image | None = None,
    counterpart_px: Floats | None = None,
    share: float = 0.0,
) -> None:
    """Draw a textured grid.

    Args:
        canvas: target.
        points_m: (H, W, 3) vertices in the axes of the camera.
        camera: (3, 3) matrix of the canvas.
        drawn: (H - 1, W - 1) cells to draw.
        first_image: texture whose pixels are the vertices.
        other: second texture.
        counterpart_px: (H, W, 2) vertices in the second texture, or NaN.
        share: share of the second texture at a counterpart.

    """
    if other is None or counterpart_px is None:
        other = first_image
        counterpart_px = np.full((*points_m.shape[:2], 2), np.nan)
    _draw(
        np.ascontiguousarray(points_m),
        np.ascontiguousarray(camera),
        drawn,
        np.ascontiguousarray(first_image),
        np.ascontiguousarray(other),
        np.ascontiguousarray(counterpart_px),
        share,
        canvas.colour,
        canvas.depth_m,
    )


@compiled(f"float64({_PICTURE}, float64, float64, int64)")
def _texel(picture: Image, u: float, v: float, channel: int) -> float:
    u = min(max(u, 0.0), picture.shape[1] - 1.001)
    v = min(max(v, 0.0), picture.shape[0] - 1.001)
    i, j = int(v), int(u)
    a, b = v - i, u - j
    low = (1 - b) * picture[i, j, channel] + b * picture[i, j + 1, channel]
    high = (1 - b) * picture[i + 1, j, channel] + b * picture[i + 1, j + 1, channel]
    return float((1 - a) * low + a * high)


@compiled(f"boolean({_FLOATS}, {_MATRIX}, int64[:, ::1], float64[:, ::1], float64[::1])")
def _place(points: Floats, camera: Floats, corner: Ints, screen: Floats, inverse: Floats) -> bool:
    for k in range(3):
        i, j = corner[k, 0], corner[k, 1]
        z = points[i, j, 2]
        if not z > NEAREST_M:
            return False
        screen[k, 0] = camera[0, 0] * points[i, j, 0] / z + camera[0, 2]
        screen[k, 1] = camera[1, 1] * points[i, j, 1] / z + camera[1, 2]
        inverse[k] = 1.0 / z
    return True


@compiled(
    f"void({_PICTURE}, {_PICTURE}, {_FLOATS}, float64, int64[:, ::1], float64[::1],"
    " uint8[:, :, ::1], int64, int64)"
)
def _shade(
    first_image: Image,
    other: Image,
    counterpart: Floats,
    share: float,
    corner: Ints,
    parts: Floats,
    colour: Image,
    y: int,
    x: int,
) -> None:
    """Write the colour at barycentric ``parts`` of a triangle, both textures mixed."""
    row = column = there_u = there_v = size = 0.0
    for k in range(3):
        i, j = corner[k, 0], corner[k, 1]
        row += parts[k] * i
        column += parts[k] * j
        if not np.isnan(counterpart[i, j, 0]):
            there_u += parts[k] * counterpart[i, j, 0]
            there_v += parts[k] * counterpart[i, j, 1]
            size += parts[k]
    mixed = share * size
    for channel in range(3):
        value = _texel(first_image, column, row, channel)
        if mixed > 0.0:
            there = _texel(other, there_u / size, there_v / size, channel)
            value = (1.0 - mixed) * value + mixed * there
        colour[y, x, channel] = np.uint8(value + 0.5)


@compiled(
    f"void({_FLOATS}, {_MATRIX}, {_BOOLS}, {_PICTURE}, {_PICTURE}, {_FLOATS}, float64,"
    " uint8[:, :, ::1], float64[:, ::1])"
)
def _draw(
    points: Floats,
    camera: Floats,
    drawn: Bools,
    first_image: Image,
    other: Image,
    counterpart: Floats,
    share: float,
    colour: Image,
    depth: Floats,
) -> None:
    tall, wide = depth.shape
    corner = np.empty((3, 2), np.int64)
    screen = np.empty((3, 2))
    inverse = np.empty(3)
    parts = np.empty(3)
    for cell in range(2 * drawn.size):
        row = cell // 2 // drawn.shape[1]
        column = cell // 2 % drawn.shape[1]
        half = cell % 2
        if not drawn[row, column]:
            continue
        corner[0, 0], corner[0, 1] = row + half, column
        corner[1, 0], corner[1, 1] = row + 1, column + half
        corner[2, 0], corner[2, 1] = row, column + 1
        if not _place(points, camera, corner, screen, inverse):
            continue
        ax, ay, bx, by = screen[0, 0], screen[0, 1], screen[1, 0], screen[1, 1]
        cx, cy = screen[2, 0], screen[2, 1]
        left, right = max(np.ceil(min(ax, bx, cx)), 0.0), min(max(ax, bx, cx), wide - 1.0)
        top, bottom = max(np.ceil(min(ay, by, cy)), 0.0), min(max(ay, by, cy), tall - 1.0)
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if left > right or top > bottom or area == 0.0:
            continue
        for y in range(int(top), int(bottom) + 1):
            for x in range(int(left), int(right) + 1):
                v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
                w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
                if min(1.0 - v - w, v, w) < -1e-9:
                    continue
                over = (1.0 - v - w) * inverse[0] + v * inverse[1] + w * inverse[2]
                if 1.0 / over >= depth[y, x]:
                    continue
                depth[y, x] = 1.0 / over
                parts[0] = (1.0 - v - w) * inverse[0] / over
                parts[1], parts[2] = v * inverse[1] / over, w * inverse[2] / over
                _shade(first_image, other, counterpart, share, corner, parts, colour, y, x)
