"""Frames of a recording: a video that OpenCV or PyAV reads, or a folder of images by name."""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError

os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")

os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # faults get our own messages

IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".webp")
ASSUMED_HZ = 30.0
_MISSING = 0.02  # of the frames that a file declares may be absent: some codecs count wrongly


@dataclass(frozen=True, slots=True)
class Footage:
    """A recording on disk; ``read`` goes through it from the start each time."""

    path: Path
    files: tuple[Path, ...]
    """Images, or nothing for a video."""
    count: int
    """Frames that there should be."""
    rate_hz: float
    rate_assumed: bool
    """Whether ``rate_hz`` is a guess: neither the caller nor the file states it."""
    decoded_by_av: bool = False
    """Whether PyAV reads the video, as this OpenCV lacks its codec."""

    def read(self) -> Iterator[Image]:
        """(H, W) or (H, W, 3) 8-bit frames in order.

        Raises:
            InputError: a frame that cannot be read; of a video, as soon as it ends early.

        """
        return self._images() if self.files else self._video(1)

    def spread(self, most: int) -> list[Image]:
        """At most ``most`` frames, spread over the recording."""
        every = max(1, -(-self.count // most))
        if self.files:
            return [read_image(file) for file in self.files[::every]]
        return list(self._video(every))

    def _images(self) -> Iterator[Image]:
        for file in self.files:
            yield read_image(file)

    def _video(self, every: int) -> Iterator[Image]:
        done = 0
        for frame in _av_frames(self.path, every) if self.decoded_by_av else self._grabbed(every):
            if frame is not None:
                yield _one_channel(frame)
            done += 1
        if done < (1.0 - _MISSING) * self.count - 1.0:
            raise InputError(
                f"{self.path}: ends after {done} of {self.count} frames: the file is cut or its "
                "codec is damaged; copy it again, or cut it there and give the part"
            )

    def _grabbed(self, every: int) -> Iterator[NDArray[np.generic] | None]:
        """All frames by OpenCV; None for those between each ``every``-th, which stay undecoded."""
        film = cv2.VideoCapture(str(self.path))
        number = 0
        try:
            while film.grab():
                if number % every:
                    yield None
                else:
                    whole, frame = film.retrieve()
                    if not whole:
                        break
                    yield frame
                number += 1
        finally:
            film.release()


def _av_frames(path: Path, every: int) -> Iterator[NDArray[np.generic] | None]:
    """All frames by PyAV, blue first as OpenCV has them; None for those that are not asked for."""
    import av  # noqa: PLC0415  an extra

    try:
        with av.open(str(path)) as film:
            for number, frame in enumerate(film.decode(video=0)):
                yield None if number % every else frame.to_ndarray(format="bgr24")
    except (av.error.FFmpegError, IndexError):
        return  # what is missing is counted by the caller


def _av_facts(path: Path) -> tuple[int, float] | None:
    """Frames and rate (0: not stated) of a video that PyAV reads; None where it does not."""
    if find_spec("av") is None or next(_av_frames(path, 1), None) is None:
        return None
    import av  # noqa: PLC0415  an extra

    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        count = stream.frames or sum(1 for _ in film.decode(stream))
        return count, float(stream.average_rate or 0.0)


def open_footage(path: Path, rate_hz: float | None = None) -> Footage:
    """Open a recording without reading all of it.

    Args:
        path: a video file, or a folder of images.
        rate_hz: frames a second, instead of what the file states; a folder states none.

    Raises:
        InputError: no such file, no images, no video that can be read, or an empty one.

    """
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise InputError(f"{path}: the frame rate must be above 0 Hz, not {rate_hz}")
    if path.is_dir():
        files = tuple(
            sorted((f for f in path.iterdir() if f.suffix.lower() in IMAGES), key=_in_order)
        )
        if not files:
            raise InputError(f"{path}: holds no images ({', '.join(IMAGES)})")
        return Footage(path, files, len(files), rate_hz or ASSUMED_HZ, rate_hz is None)
    if not path.is_file():
        raise InputError(f"{path}: no such video or folder of images")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: is an empty file")
    film = cv2.VideoCapture(str(path))
    try:
        first, _ = film.read()
        count, stated = film.get(cv2.CAP_PROP_FRAME_COUNT), film.get(cv2.CAP_PROP_FPS)
    finally:
        film.release()
    by_av = None if first else _av_facts(path)
    if by_av is not None:
        count, stated = by_av
    elif not first:
        raise InputError(
            f"{path}: no frame can be read: it is no video, is cut, or has a codec that this "
            "OpenCV lacks (PyAV, of the extra view, reads more); convert it, or give images"
        )
    if not 0.0 < stated < 1e5:
        stated = 0.0
    rate = rate_hz or stated or ASSUMED_HZ
    assumed = rate_hz is None and stated == 0.0
    return Footage(path, (), max(1, int(count)), rate, assumed, by_av is not None)


def read_image(file: Path) -> Image:
    """(H, W) or (H, W, 3) 8 bit.

    Raises:
        InputError: no image in this file.

    """
    try:
        data = np.frombuffer(file.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    image = cv2.imdecode(data, cv2.IMREAD_ANYCOLOR) if data.size else None
    if image is None:
        raise InputError(f"{file}: is no image that can be read")
    return _one_channel(image)


def _one_channel(image: NDArray[np.generic]) -> Image:
    """One channel where all three are the same: three times quicker."""
    out = np.asarray(image, dtype=np.uint8)
    if out.ndim == 3 and not (
        cv2.absdiff(out[..., 0], out[..., 1]).any() or cv2.absdiff(out[..., 1], out[..., 2]).any()
    ):
        return np.ascontiguousarray(out[..., 0])
    return out


def _in_order(file: Path) -> list[tuple[int, str]]:
    """2.png before 10.png."""
    return [
        (int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)
    ]
