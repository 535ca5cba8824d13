"""Cut-outs of a film's frames, kept in a temporary file so that memory stays bounded."""

from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.controller.capture.image_file import ImageFile, StoredImage

_MARGIN_LENGTHS = 0.3  # of the body's length, kept on each side
_LEAST_MARGIN_PX = 16.0


@dataclass(frozen=True, slots=True)
class CutOut:
    """A part of a frame."""

    image: DeepImage
    """(h, w[, C]) pixels of the cut-out."""
    origin_px: tuple[int, int]
    """Position x, y of the cut-out's first pixel."""


def surroundings(points_px: Floats, reach_px: float) -> tuple[tuple[slice, slice], tuple[int, int]]:
    """Window of a frame around points (P, 2), and the x, y of its first pixel."""
    left, top = np.maximum(np.floor(points_px.min(axis=0) - reach_px), 0.0).astype(int).tolist()
    right, bottom = (np.ceil(points_px.max(axis=0) + reach_px).astype(int) + 1).tolist()
    return (slice(top, bottom), slice(left, right)), (left, top)


@dataclass(slots=True)
class FrameStore:
    """Cut-outs by frame number."""

    file: ImageFile = field(default_factory=ImageFile)
    _places: dict[int, tuple[StoredImage, tuple[int, int]]] = field(default_factory=dict)

    def put(self, number: int, frame: DeepImage, points_px: Floats, length_px: float) -> None:
        """Keep the surroundings of some points (P, 2) of a frame (H, W[, C])."""
        reach = max(_MARGIN_LENGTHS * length_px, _LEAST_MARGIN_PX)
        window, corner_px = surroundings(points_px, reach)
        part = np.ascontiguousarray(frame[window])
        if not part.size:
            return
        part = part if part.dtype == np.uint8 else part.astype(np.float16)
        self._places[number] = (self.file.add(part), corner_px)

    def get(self, number: int) -> CutOut | None:
        """The cut-out of a frame; None for a frame without one."""
        if number not in self._places:
            return None
        stored, origin_px = self._places[number]
        image = self.file.read(stored)
        return CutOut(image if image.dtype == np.uint8 else image.astype(np.float32), origin_px)
