"""The page on which a person reviews a capture: frames, skeletons, status over time; one file.

It needs no server and no network. It saves corrections as a file for
``controller.capture.corrections``.
"""

import base64
import json
import math
import shlex
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import CaptureFile
from snakewalk.controller.images.silhouette import as_deep_as
from snakewalk.controller.images.video import in_8_bits
from snakewalk.controller.track.frame_status import FrameStatus

_TEMPLATE = Path(__file__).with_name("review.html")
_LARGEST_SIDE_PX = 1280
_SMALLEST_SIDE_PX = 320
"""Longest side of the pictures on the page."""
_MOST_BYTES = 150_000_000
"""Limit for all pictures together (ours): a browser opens such a page in seconds."""
_QUALITY = 85
_STATUS_TEXTS = [str(frame_status) for frame_status in FrameStatus]


def picture_scale(some: Sequence[DeepImage], count: int, name: str) -> float:
    """Reduction of the frames that keeps the page below its limit.

    Args:
        some: frames spread over the recording.
        count: of all frames.
        name: of the recording, for errors.

    Raises:
        InputError: too many frames even for the smallest pictures.

    """
    longest: int = max(max(frame.shape[:2]) for frame in some)
    scale = min(1.0, _LARGEST_SIDE_PX / longest)
    expected = count * float(np.mean([len(_packed_picture(frame, scale)) for frame in some]))
    if expected > _MOST_BYTES:
        scale *= math.sqrt(_MOST_BYTES / expected)
        if scale * longest < _SMALLEST_SIDE_PX:
            raise InputError(
                f"{name}: a page with pictures of {count} frames would be too large for a browser; "
                "capture a part of the film, or choose a part of the picture with --roi"
            )
    return scale


def review_page(
    animals: Sequence[CaptureFile],
    frames: Iterable[DeepImage],
    *,
    scale: float,
    tracks: Sequence[Path],
    origin_px: tuple[int, int] = (0, 0),
    on_progress: Callable[[], None] = lambda: None,
) -> str:
    """Write the page.

    Args:
        animals: of one recording.
        frames: all of them, (H, W[, C]), as captured.
        scale: of their pictures: ``picture_scale``.
        tracks: the file of each animal, for the page.
        origin_px: x, y of the frames' first pixel in the whole picture.
        on_progress: called after each frame.

    """
    captured = animals[0].captured
    pictures: list[str] = []
    sizes: list[tuple[int, int]] = []
    for frame in frames:
        sizes.append((frame.shape[1], frame.shape[0]))
        pictures.append(base64.b64encode(_packed_picture(frame, scale)).decode())
        on_progress()
    data = {
        "name": animals[0].name if len(animals) == 1 else f"{len(animals)} animals",
        "rate_hz": captured.rate_hz,
        "time_s": np.round(captured.time_s, 4).tolist(),
        "origin": list(origin_px),
        "sizes": sizes,
        "words": _STATUS_TEXTS,
        "animals": [_of_animal(animal, file) for animal, file in zip(animals, tracks, strict=True)],
        "images": pictures[: len(captured.status)],
    }
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return _TEMPLATE.read_text(encoding="utf-8").replace("__DATA__", text, 1)


def _of_animal(file: CaptureFile, track: Path) -> dict[str, Any]:
    captured = file.captured
    corrections = f"{track.stem}-corrections.json"
    corrected = track.with_name(f"{track.stem}-corrected.npz")
    return {
        "name": file.name,
        "track": file.fingerprint,
        "corrections": corrections,
        "command": f"snakewalk animal capture {shlex.quote(str(track))} --corrections "
        f"{shlex.quote(corrections)} -o {shlex.quote(str(corrected))}",
        "length": round(float(np.nanmedian(captured.length_px)), 2),
        "status": [_STATUS_TEXTS.index(str(frame_status)) for frame_status in captured.status],
        "points": [
            np.round(line, 2).ravel().tolist() if np.isfinite(line).all() else None
            for line in captured.points_px
        ],
        "margin": [round(float(m), 3) if np.isfinite(m) else None for m in captured.margin],
        "unsure_after": list(file.identity_uncertain_after),
    }


def _packed_picture(frame: DeepImage, scale: float) -> bytes:
    if scale < 1.0:
        size = tuple(max(1, round(side * scale)) for side in frame.shape[1::-1])
        frame = as_deep_as(frame, cv2.resize(frame, size, interpolation=cv2.INTER_AREA))
    return bytes(cv2.imencode(".jpg", in_8_bits(frame), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1])
