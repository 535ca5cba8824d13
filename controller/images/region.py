"""The region of a picture that may contain the animal: a rectangle, a mask, or both."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from snakewalk.config.arrays import Bools, DeepImage, Indices
from snakewalk.config.errors import InputError
from snakewalk.controller.images.video import read_image

_LEAST_SIDE_PX = 16  # smallest side
_SOFT_PX = (
    5  # the fill of the outside is averaged over this distance, so that its noise forms no pattern
)


@dataclass(frozen=True, slots=True)
class Region:
    """A cut-out of every frame; the nearest ground fills the area outside the mask."""

    origin_px: tuple[int, int]
    """Position x, y of the region's first pixel in the whole picture."""
    size_px: tuple[int, int]
    """Width and height; (0, 0): the whole picture, whatever its size."""
    inside: Bools | None = None
    """(height, width) of the region: where the animal may be; None: everywhere."""
    fill: tuple[Indices, Indices] | None = None
    """Rows and columns of the ground that fills each pixel of the outside."""

    def cut(self, frame: DeepImage) -> DeepImage:
        """Cut the region (height, width[, C]) out of a frame (H, W[, C])."""
        if self.size_px == (0, 0):
            return frame
        (x, y), (wide, high) = self.origin_px, self.size_px
        part = np.ascontiguousarray(frame[y : y + high, x : x + wide])
        if self.inside is None or self.fill is None:
            return part
        soft = cv2.blur(part, (_SOFT_PX, _SOFT_PX))
        part[~self.inside] = soft[self.fill]
        return part

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Transform a point of the whole picture to the region."""
        return x - self.origin_px[0], y - self.origin_px[1]


WHOLE = Region((0, 0), (0, 0))


def region_of(roi: str | None, mask: Path | None, frame_shape: tuple[int, ...]) -> Region:
    """Return the region of the options ``--roi X,Y,W,H`` and ``--mask PNG``.

    Args:
        roi: first pixel and size of the rectangle, px; None: the whole picture.
        mask: picture of the frames' size; brighter than half of its maximum where the animal may
            be.
        frame_shape: (H, W[, C]).

    Raises:
        InputError: the rectangle is malformed, too small or outside the picture, or the mask has
            another size or too few pixels.

    """
    rows, columns = frame_shape[:2]
    if roi is None and mask is None:
        return WHOLE
    x, y, wide, high = (0, 0, columns, rows) if roi is None else _rectangle(roi)
    if not (x >= 0 and y >= 0 and x + wide <= columns and y + high <= rows):
        raise InputError(
            f"--roi {roi}: reaches beyond the picture of {columns} x {rows} pixels; expected "
            "X,Y,W,H: the first pixel, width and height"
        )
    if min(wide, high) < _LEAST_SIDE_PX:
        raise InputError(
            f"--roi {roi}: at least {_LEAST_SIDE_PX} x {_LEAST_SIDE_PX} pixels are needed"
        )
    if mask is None:
        return Region((x, y), (wide, high))
    image = read_image(mask)
    if image.shape[:2] != (rows, columns):
        raise InputError(
            f"--mask {mask}: is {image.shape[1]} x {image.shape[0]}, the frames are {columns} x "
            f"{rows}: it must be as large as they are"
        )
    grey = image if image.ndim == 2 else image.max(axis=2)
    inside = grey[y : y + high, x : x + wide] > 0.5 * float(grey.max())
    if inside.sum() < _LEAST_SIDE_PX**2:
        raise InputError(
            f"--mask {mask}: leaves {int(inside.sum())} pixels; white is where the animal may be"
        )
    left, top, wide, high = cv2.boundingRect(inside.astype(np.uint8))
    inside = np.ascontiguousarray(inside[top : top + high, left : left + wide])
    core = cv2.erode(inside.astype(np.uint8), np.ones((_SOFT_PX, _SOFT_PX), np.uint8)) > 0
    far = ~(core if core.any() else inside)
    rows_of, columns_of = distance_transform_edt(far, return_distances=False, return_indices=True)
    fill = (rows_of[~inside], columns_of[~inside])
    return Region((x + left, y + top), (wide, high), inside, fill)


def _rectangle(text: str) -> tuple[int, int, int, int]:
    try:
        x, y, wide, high = (int(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--roi {text}: expected X,Y,W,H in whole pixels, such as 100,50,640,480"
        ) from None
    return x, y, wide, high
