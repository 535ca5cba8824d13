"""An MP4 file made of frames; it needs PyAV only."""

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from snakewalk.config.arrays import Bytes
from snakewalk.config.errors import InputError

if TYPE_CHECKING:
    import av


class MovieFile:
    """An MP4 file that stores frames."""

    def __init__(self, path: Path, fps: int, size: tuple[int, int]) -> None:
        try:
            import av  # noqa: PLC0415  an extra
        except ImportError:
            raise InputError("films need PyAV: pip install 'snakewalk[view]'") from None
        self._frame = av.VideoFrame.from_ndarray
        self._file = av.open(str(path), "w")
        codec = "libx264" if "libx264" in av.codecs_available else "mpeg4"
        self._stream = cast("av.VideoStream", self._file.add_stream(codec, rate=Fraction(fps)))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        self._stream.options = (
            {"crf": "23", "preset": "veryfast"} if codec == "libx264" else {"qscale": "4"}
        )

    def add(self, pixels: Bytes) -> None:
        """Append one frame (height, width, 3)."""
        frame = self._frame(np.ascontiguousarray(pixels), format="rgb24")
        self._file.mux(self._stream.encode(frame))

    def __enter__(self) -> "MovieFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.mux(self._stream.encode())
        self._file.close()
