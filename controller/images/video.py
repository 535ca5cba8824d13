"""Frames of a recording: a video that OpenCV or PyAV reads, a TIFF stack, or a folder of images.

Images of 16 bit become float32. One scale for the whole recording maps the range in use to the
range of 8 bit.
"""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.archive import read_bytes, why_no_file
from snakewalk.config.arrays import DeepImage, Floats, Image, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.reading import Fact, by_user

STACKS = (".tif", ".tiff")


def in_order(file: Path) -> list[tuple[int, str]]:
    """Sort key that puts 2.png before 10.png."""
    return [
        (int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)
    ]


def pages_of(files: Sequence[Path]) -> tuple[tuple[Path, ...], tuple[int, ...]]:
    """Return each image once per page, and the page of each, from 0."""
    file_pages = [
        (file, page)
        for file in files
        for page in range(_page_count(file) if file.suffix.lower() in STACKS else 1)
    ]
    return tuple(file for file, _ in file_pages), tuple(page for _, page in file_pages)


def _page_count(file: Path) -> int:
    try:
        return max(1, int(cv2.imcount(str(file))))
    except cv2.error:
        return 1  # reading the file reports the fault


def frame_numbers_of(files: Sequence[Path]) -> Ints | None:
    """(T,) frame numbers from 0, by the last number in the names.

    None if no number is missing at a constant step, or if the names do not form one sequence.
    """
    parts = [re.fullmatch(r"(.*?)(\d+)(\D*)", file.name) for file in files]
    matches = [part for part in parts if part is not None]
    if len(files) < 3 or len(matches) < len(files) or len({(m[1], m[3]) for m in matches}) > 1:
        return None
    number = np.array([int(match[2]) for match in matches], dtype=np.int64)
    step = np.diff(number)
    if step.min() < 1 or (step % step.min()).any() or (step == step.min()).all():
        return None
    return np.asarray((number - number[0]) // step.min(), dtype=np.int64)


os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # this program reports the faults
if "OPENCV_LOG_LEVEL" not in os.environ:  # OpenCV read the variable when it was loaded
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".webp")
ASSUMED_HZ = 30.0
_DEEP_RANGE = (16.0, 240.0)
"""Grey levels between which the values of deep images are put."""
_DEEP_SAMPLE = 9
_EVEN_STEP = 0.1  # of a frame: larger deviations mean an uneven rate
_SAME_RATE = 0.005  # share of the rate by which the times and the stated rate may differ
_MISSING = 0.02  # of the declared frames may be absent: some codecs count wrongly


@dataclass(frozen=True, slots=True)
class GreyScale:
    """Linear map from values of 16 bit to the scale of 8 bit."""

    black: float
    """Value of grey level 0."""
    gain: float
    """Grey levels a value."""


@dataclass(frozen=True, slots=True)
class Footage:
    """A recording on disk."""

    path: Path
    files: tuple[Path, ...]
    """Images, or nothing for a video."""
    count: int
    """Number of frames that the film should have."""
    rate_hz: float
    rate_assumed: bool
    """Whether ``rate_hz`` is a guess: neither the caller nor the file states it."""
    decoded_by_av: bool = False
    """Whether PyAV reads the video, as this OpenCV lacks its codec."""
    deep: GreyScale | None = None
    """Scale of images of 16 bit; None for all others."""
    pages: tuple[int, ...] = ()
    """Page of each of ``files``, from 0; a stack occurs once for each of its pages."""
    numbers: tuple[int, ...] = ()
    """Frame number of each of ``files`` where some numbers are missing; else empty."""

    @property
    def missing(self) -> int:
        """Number of images that are missing in the sequence."""
        return self.numbers[-1] + 1 - len(self.numbers) if self.numbers else 0

    def time_fact(self, rate_hz: float, asked_hz: float | None) -> Fact:
        """Return the fact of the film's times, of which ``asked_hz`` is the user's rate."""
        rate = f"{rate_hz:g} Hz"
        if self.rate_assumed:
            return Fact(rate, "inferred", "the default of films; --rate states another")
        return by_user("--rate", rate if asked_hz else None) or Fact(rate, "file", "the film")

    def read(self) -> Iterator[DeepImage]:
        """Iterate over all frames (H, W) or (H, W, 3): 8 bit, or deeper on the same scale.

        Raises:
            InputError: a frame cannot be read, or a video ends early.

        """
        return (frame for frame, _ in self.timed())

    def shown(self) -> Iterator[Image]:
        """Frames of ``read`` in 8 bit."""
        return map(in_8_bits, self.read())

    def timed(self, first: int = 0) -> Iterator[tuple[DeepImage, float]]:
        """Frames of ``read`` from number ``first``, with their times in s.

        Times of images follow from their numbers if some are missing, else they are NaN.
        """
        if self.files:
            at_s = [n / self.rate_hz for n in self.numbers] or [float("nan")] * len(self.files)
            shots = list(zip(self.files, self.pages, at_s, strict=True))[first:]
            return ((self.image(file, page), moment_s) for file, page, moment_s in shots)
        return self._video(1, first)

    def spread(self, most: int) -> list[DeepImage]:
        """Return at most ``most`` frames, spread over the recording."""
        every = max(1, -(-self.count // most))
        if self.files:
            shots = list(zip(self.files, self.pages, strict=True))
            return [self.image(file, page) for file, page in shots[::every]]
        return [frame for frame, _ in self._video(every)]

    def image(self, file: Path, page: int = 0) -> DeepImage:
        """Read an image of the recording, or a background for it.

        Raises:
            InputError: no image in this file.

        """
        if self.deep is None:
            return in_8_bits(_one_channel(_decoded_page(file, cv2.IMREAD_ANYCOLOR, page)))
        decoded = _decoded_page(file, cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH, page)
        if decoded.dtype != np.uint16:
            return _one_channel(decoded)
        return _one_channel((decoded.astype(np.float32) - self.deep.black) * self.deep.gain)

    def _video(self, every: int, first: int = 0) -> Iterator[tuple[DeepImage, float]]:
        done = 0
        shots = (
            _av_frames(self.path, every, first)
            if self.decoded_by_av
            else self._grabbed_frames(every, first)
        )
        for frame, at_s in shots:
            if frame is not None:
                yield _one_channel(frame), at_s
            done += 1
        if done < (1.0 - _MISSING) * self.count - 1.0:
            raise InputError(
                f"{self.path}: ends after {done} of {self.count} frames: the file is cut or its "
                "codec is damaged; copy it again, or cut it there and give the part"
            )

    def _grabbed_frames(self, every: int, first: int) -> Iterator[tuple[Image | None, float]]:
        """Frames by OpenCV with their times; None for skipped frames."""
        film = cv2.VideoCapture(str(self.path))
        number = 0
        try:
            while film.grab():
                at_s = 1e-3 * film.get(cv2.CAP_PROP_POS_MSEC)
                if number % every or number < first:
                    yield None, at_s
                else:
                    _, frame = film.retrieve()
                    if not np.ndim(frame):  # None: damaged
                        break
                    yield np.asarray(frame, dtype=np.uint8), at_s
                number += 1
        finally:
            film.release()


def _av_frames(path: Path, every: int, first: int = 0) -> Iterator[tuple[Image | None, float]]:
    """Frames by PyAV as BGR with their times; None for skipped frames."""
    av = _av()
    try:
        with av.open(str(path)) as film:
            for number, frame in enumerate(film.decode(video=0)):
                at_s = float("nan") if frame.time is None else float(frame.time)
                skipped = number % every or number < first
                pixels = None if skipped else frame.to_ndarray(format="bgr24")
                yield None if pixels is None else np.asarray(pixels, dtype=np.uint8), at_s
    except (av.error.FFmpegError, IndexError):
        return  # the caller counts missing frames


def _av() -> ModuleType:
    import av  # noqa: PLC0415  an optional package, for films that OpenCV cannot read

    return av


def _av_facts(path: Path) -> tuple[int, float] | None:
    """Frames and rate (0: not stated) of a video; None if PyAV cannot read it."""
    if find_spec("av") is None or next(_av_frames(path, 1), None) is None:
        return None
    with _av().open(str(path)) as film:
        stream = film.streams.video[0]
        count = stream.frames or sum(1 for _ in film.decode(stream))
        return count, float(stream.average_rate or 0.0)


def open_footage(path: Path, rate_hz: float | None = None) -> Footage:
    """Open a recording without reading all of it.

    Args:
        path: a video file, a TIFF stack, or a folder of images.
        rate_hz: frames per second, overrides the rate that the file states.

    Raises:
        InputError: no such file, no images, no readable video, an empty one, or a bad rate.

    """
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise InputError(f"{path}: the frame rate must be above 0 Hz, not {rate_hz}")
    if path.is_dir() or (path.is_file() and path.suffix.lower() in STACKS):
        return _images(path, rate_hz)
    if not path.is_file():
        raise InputError(why_no_file(path, "no such video or folder of images"))
    if path.stat().st_size == 0:
        raise InputError(f"{path}: is an empty file")
    film = cv2.VideoCapture(str(path))
    try:
        first, _ = film.read()
        count = film.get(cv2.CAP_PROP_FRAME_COUNT)
        stated = film.get(cv2.CAP_PROP_FPS)
    finally:
        film.release()
    by_av = None if first else _av_facts(path)
    if by_av is not None:
        count, stated = by_av
    elif not first:
        raise InputError(
            f"{path}: OpenCV cannot read a frame: the file is incomplete, or not a video, or "
            "has another codec; convert it, install PyAV (extra view), or give images"
        )
    if not 0.0 < stated < 1e5:
        stated = 0.0
    rate = rate_hz or stated or ASSUMED_HZ
    assumed = rate_hz is None and stated == 0.0
    return Footage(path, (), max(1, int(count)), rate, assumed, by_av is not None)


def _images(path: Path, rate_hz: float | None) -> Footage:
    if path.is_dir():
        images = sorted((f for f in path.iterdir() if f.suffix.lower() in IMAGES), key=in_order)
    else:
        images = [path]
    if not images:
        raise InputError(f"{path}: holds no images ({', '.join(IMAGES)})")
    files, pages = pages_of(images)
    numbers = frame_numbers_of(files) if len(files) == len(images) else None
    return Footage(
        path,
        files,
        len(files),
        rate_hz or ASSUMED_HZ,
        rate_hz is None,
        deep=_scale_of_deep(images[:: max(1, len(images) // _DEEP_SAMPLE)]),
        pages=pages,
        numbers=() if numbers is None else tuple(numbers.tolist()),
    )


def frame_times(stated_s: Sequence[float], rate_hz: float) -> tuple[Floats, float]:
    """Times of frames, (T,) s from the first, and frames per second.

    Args:
        stated_s: time of each frame from the film; NaN if it is missing.
        rate_hz: rate that the file states.

    Returns:
        Multiples of the stated rate, if the film's times are absent or agree with it. Even times of
        another rate use that rate. Uneven times are kept, with the rate of their median step.

    """
    number = np.arange(len(stated_s))
    time_s = np.array(stated_s, dtype=float)
    if len(time_s) < 3 or not (np.diff(time_s) > 0.0).all():
        return number / rate_hz, rate_hz
    time_s -= time_s[0]
    step_s = float(time_s[-1]) / (len(time_s) - 1)
    if np.abs(time_s - step_s * number).max() > _EVEN_STEP * step_s:
        return time_s, 1.0 / float(np.median(np.diff(time_s)))
    own_hz = rate_hz if abs(step_s * rate_hz - 1.0) < _SAME_RATE else 1.0 / step_s
    return number / own_hz, own_hz


def in_8_bits(image: DeepImage) -> Image:
    """Round and clip a frame to 8 bit."""
    if image.dtype == np.uint8:
        return np.asarray(image, dtype=np.uint8)
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def _scale_of_deep(files: Sequence[Path]) -> GreyScale | None:
    """Scale of a 16-bit recording, from some of its images; None for 8 bit.

    A camera of 12 bit uses a sixteenth of the range, and a dim film less.
    """
    low, high = float("inf"), -float("inf")
    for file in files:
        decoded = _decoded_page(file, cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
        if decoded.dtype != np.uint16:
            return None
        calm = cv2.medianBlur(decoded, 3)  # removes broken pixels
        low, high = min(low, float(calm.min())), max(high, float(calm.max()))
    if high <= low:
        return GreyScale(low - _DEEP_RANGE[0], 1.0)
    gain = (_DEEP_RANGE[1] - _DEEP_RANGE[0]) / (high - low)
    return GreyScale(low - _DEEP_RANGE[0] / gain, gain)


def read_image(file: Path) -> Image:
    """Read an image (H, W) or (H, W, 3) in 8 bit.

    Raises:
        InputError: no image in this file.

    """
    return in_8_bits(_one_channel(_decoded_page(file, cv2.IMREAD_ANYCOLOR)))


def _decoded_page(
    file: Path, how: int, page: int = 0
) -> NDArray[np.uint8 | np.uint16 | np.float32]:
    if page:
        done, mats = cv2.imreadmulti(str(file), page, 1, flags=how)
        if not done:
            raise InputError(f"{file}: page {page + 1} is not a readable image")
        return np.asarray(mats[0])
    try:
        data = np.frombuffer(read_bytes(file), dtype=np.uint8)
        image = cv2.imdecode(data, how)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    except cv2.error:  # an empty file, or a size beyond OpenCV's limits
        image = None
    if image is None:
        raise InputError(f"{file}: is not a readable image; choose another file")
    pixels: NDArray[np.uint8 | np.uint16 | np.float32] = np.asarray(image)
    return pixels


def _one_channel(image: NDArray[np.uint8 | np.uint16 | np.float32]) -> DeepImage:
    """Reduce three equal channels to one: three times faster."""
    deep = image.dtype == np.float32
    out: DeepImage = np.asarray(image, dtype=np.float32 if deep else np.uint8)
    if out.ndim == 3 and not (
        cv2.absdiff(out[..., 0], out[..., 1]).any() or cv2.absdiff(out[..., 1], out[..., 2]).any()
    ):
        return np.ascontiguousarray(out[..., 0])
    return out
