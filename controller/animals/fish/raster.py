"""The model as the camera sees it: filled areas and outlines on a small grey canvas.

Coordinates are pixels of the full frame, x to the right and y *up* (minus the row). Edges of areas
are shaded by their share of the pixel, so that a score changes smoothly with the model.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image, Int32s
from snakewalk.controller.animals.fish.model import FishModel

_SHIFT = 4  # cv2 accepts coordinates in sixteenths of a pixel


@dataclass(frozen=True, slots=True)
class Window:
    """A part of the frame, reduced: the area of a canvas."""

    left: int
    top: int
    width: int
    height: int
    """Height of the raster in pixels of the full frame."""
    scale: float
    """Canvas pixels per frame pixel, at most 1."""

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the canvas."""
        return max(1, round(self.height * self.scale)), max(1, round(self.width * self.scale))

    def crop(self, image: Image) -> Image:
        """Return this part of ``image``, averaged down."""
        part = image[self.top : self.top + self.height, self.left : self.left + self.width]
        rows, columns = self.shape
        if part.shape == (rows, columns):
            return np.ascontiguousarray(part)
        small = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.uint8)

    def sixteenths(self, points_px: Floats) -> Int32s:
        """Points (n, 2), x right and y up, as cv2 wants them."""
        rows, columns = self.shape
        x = (points_px[:, 0] + 0.5 - self.left) * (columns / self.width) - 0.5
        y = (0.5 - points_px[:, 1] - self.top) * (rows / self.height) - 0.5
        fixed = np.column_stack([x, y]) * (1 << _SHIFT)
        return np.clip(np.rint(fixed), -(2**24), 2**24).astype(np.int32)


def draw_area(canvas: Image, window: Window, outline_px: Floats) -> None:
    """Fill an outline (n, 2) on a cleared canvas."""
    canvas[:] = 0
    points = window.sixteenths(outline_px)
    cv2.fillPoly(canvas, [points], 255, lineType=cv2.LINE_AA, shift=_SHIFT)


def draw_edge(canvas: Image, window: Window, outline_px: Floats, thickness: int) -> None:
    """Draw an outline (n, 2) as a line ``thickness`` canvas pixels wide on a cleared canvas."""
    canvas[:] = 0
    points = window.sixteenths(outline_px)
    cv2.polylines(canvas, [points], True, 255, thickness, lineType=cv2.LINE_AA, shift=_SHIFT)


def side_outline(model: FishModel, midline_px: Floats, head_rad: float) -> list[Floats]:
    """Convex pieces (n, 2) in x and height that together are the fish from the side.

    Each section is an ellipse that stands across the spine; seen from the side it is as wide as the
    share of its width that points along x. Pieces reach from one section to the next.
    """
    tangent = np.gradient(midline_px, axis=0)
    across = np.hypot(tangent[:, 0], tangent[:, 1])
    wide = np.abs(tangent[:, 1]) / np.maximum(across, 1e-9) * model.half_width * model.length_px
    lean = np.hypot(across, tangent[:, 2])
    sine = -tangent[:, 2] / np.maximum(lean, 1e-9)  # how far a section leans back along the spine
    ahead = np.where(across > 1e-9, -tangent[:, 0] / np.maximum(across, 1e-9), np.cos(head_rad))
    high = model.half_height * model.length_px
    up = np.column_stack([-sine * ahead, np.sqrt(np.maximum(1.0 - sine**2, 0.0))]) * high[:, None]
    turn = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    rim = midline_px[:, None, [0, 2]] + np.sin(turn)[:, None] * up[:, None, :]
    rim[..., 0] += np.cos(turn) * wide[:, None]
    some = rim[::2]
    pairs = np.concatenate([some[:-1], some[1:]], axis=1).astype(np.float32)
    return [np.asarray(cv2.convexHull(pair)[:, 0, :], dtype=float) for pair in pairs]


def draw_pieces(canvas: Image, window: Window, pieces_px: list[Floats]) -> None:
    """Fill convex pieces on a cleared canvas."""
    canvas[:] = 0
    points = window.sixteenths(np.concatenate(pieces_px))
    for piece in np.split(points, np.cumsum([len(piece_px) for piece_px in pieces_px])[:-1]):
        cv2.fillConvexPoly(canvas, piece, 255, lineType=cv2.LINE_AA, shift=_SHIFT)
