"""Images and large arrays of a film in temporary files, so that memory stays bounded."""

import tempfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from snakewalk.config.arrays import DeepImage, Floats

IN_MEMORY_BYTES = 2**20
"""Arrays of this size and smaller ones stay in memory."""
_FAST = 1  # level of compression
_ROWS = 500  # of a large array that are computed at once


@dataclass(frozen=True, slots=True)
class StoredImage:
    """Where an image lies in its file."""

    at: int
    size: int
    """Bytes in the file."""
    shape: tuple[int, ...]
    dtype: np.dtype[Any]


@dataclass(slots=True)
class ImageFile:
    """A temporary file of images; it vanishes with the object."""

    _file: IO[bytes] = field(default_factory=tempfile.TemporaryFile)
    _end: int = 0

    def add(self, image: DeepImage) -> StoredImage:
        """Store an image (H, W[, C]) without a loss."""
        data = zlib.compress(image.tobytes(), _FAST)
        self._file.seek(self._end)
        self._file.write(data)
        stored = StoredImage(self._end, len(data), image.shape, image.dtype)
        self._end += len(data)
        return stored

    def read(self, stored: StoredImage) -> DeepImage:
        """Return a stored image."""
        self._file.seek(stored.at)
        data = zlib.decompress(self._file.read(stored.size))
        return np.frombuffer(data, dtype=stored.dtype).reshape(stored.shape)


def large_array(shape: tuple[int, ...], folder: Path | None) -> Floats:
    """Return an array to be filled; a large one lies in an unnamed file of ``folder``.

    Args:
        shape: of the array.
        folder: of the result; None: the array stays in memory.

    """
    if folder is None or 8 * int(np.prod(shape)) <= IN_MEMORY_BYTES:
        return np.empty(shape)
    with tempfile.TemporaryFile(dir=folder) as file:
        return np.memmap(file, dtype=np.float64, mode="w+", shape=shape)


def scaled(
    values: Floats, factor: Sequence[float], offset: Sequence[float], folder: Path | None
) -> Floats:
    """Return ``values`` (T, ..., C) times a factor (C,) plus an offset (C,): ``large_array``."""
    out = large_array(values.shape, folder)
    for first in range(0, len(values), _ROWS):
        some = slice(first, first + _ROWS)
        out[some] = values[some] * np.asarray(factor) + np.asarray(offset)
    return out
