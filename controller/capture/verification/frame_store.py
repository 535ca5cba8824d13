"""Cut-outs of a film's frames, kept in a temporary file so that memory stays bounded."""

import tempfile
from dataclasses import dataclass, field
from typing import IO

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage, Floats

_AROUND = 0.3  # of the body's length, kept on each side
_LEAST_AROUND_PX = 16.0


@dataclass(frozen=True, slots=True)
class CutOut:
    """A part of a frame."""

    image: DeepImage
    """(h, w[, C])"""
    origin_px: tuple[int, int]
    """x, y of its first pixel."""


@dataclass(frozen=True, slots=True)
class _Place:
    at: int
    size: int
    shape: tuple[int, ...]
    origin_px: tuple[int, int]


@dataclass(slots=True)
class FrameStore:
    """Cut-outs by frame number."""

    _file: IO[bytes] = field(default_factory=tempfile.TemporaryFile)
    _places: dict[int, _Place] = field(default_factory=dict)
    _end: int = 0

    def put(self, number: int, frame: DeepImage, points_px: Floats, length_px: float) -> None:
        """Keep the surroundings of some points (P, 2) of a frame (H, W[, C])."""
        reach = max(_AROUND * length_px, _LEAST_AROUND_PX)
        left, top = np.maximum(np.floor(points_px.min(axis=0) - reach), 0.0).astype(int)
        right, bottom = np.ceil(points_px.max(axis=0) + reach).astype(int) + 1
        part = np.ascontiguousarray(frame[top:bottom, left:right])
        if not part.size:
            return
        if part.dtype == np.uint8:
            fast = [cv2.IMWRITE_PNG_COMPRESSION, 1]
            data = cv2.imencode(".png", part, fast)[1].tobytes()
        else:
            data = part.astype(np.float16).tobytes()
        self._file.seek(self._end)
        self._file.write(data)
        self._places[number] = _Place(self._end, len(data), part.shape, (int(left), int(top)))
        self._end += len(data)

    def get(self, number: int) -> CutOut | None:
        """The cut-out of a frame; None for a frame without one."""
        place = self._places.get(number)
        if place is None:
            return None
        self._file.seek(place.at)
        data = self._file.read(place.size)
        raw = 2 * int(np.prod(place.shape)) == place.size and not data.startswith(b"\x89PNG")
        if raw:
            flat = np.frombuffer(data, dtype=np.float16).astype(np.float32)
            return CutOut(flat.reshape(place.shape), place.origin_px)
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        return CutOut(np.asarray(image, dtype=np.uint8), place.origin_px)
