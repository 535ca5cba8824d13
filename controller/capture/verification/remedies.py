"""Options that help a film of which too little is captured, tried on a few of its frames.

A trial is the command itself on a folder of these frames.
"""

import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import RejectedFilmError
from snakewalk.controller.capture.capturing import (
    MANY_LOST,
    CaptureFacts,
    capture_recording,
)
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.options import AUTO
from snakewalk.controller.capture.several.recording import AnimalsFacts, capture_several
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.video import in_8_bits, open_footage

_GIVEN = {"background", "rate_hz", "cropped", "roi", "mask", "threshold", "animals"}
_FRAMES = 20
_TRIALS_HZ = 10.0
_THRESHOLDS = (0.4, 0.6, 1.6)  # of the contrast at the boundary
_LEAST_GAIN = 0.25  # of the frames: this number of whole animals more must be captured
_LEAST_SHARE = 0.5  # of the frames, at least
_CLEAR_SHARE = 0.9  # of the frames: no other option is tried
_MARGIN = 12  # of the smaller side of the picture: twice the margin around places of an animal


def capture_film(options: CaptureOptions) -> CaptureFacts | AnimalsFacts:
    """Capture one or several animals; name the command that captures more if much is lost.

    Raises:
        InputError: as ``capture_recording`` and ``capture_several``.

    """
    try:
        facts = _capture(options)
    except RejectedFilmError as error:
        better = remedy(options)
        raise error if better is None else RejectedFilmError(f"{error}; {better}") from None
    for animal in captures(facts):
        if animal is None or animal.frames_lost >= MANY_LOST * animal.frames:
            better = remedy(options)
            if better is not None:
                LOGGER.warning("%s: %s", options.recording, better)
            break
    return facts


def captures(facts: CaptureFacts | AnimalsFacts) -> list[CaptureFacts | None]:
    """Return the facts of each animal; None for one without a track."""
    if isinstance(facts, CaptureFacts):
        return [facts]
    return [animal.capture for animal in facts.animals]


def remedy(options: CaptureOptions) -> str | None:
    """Return a sentence with the command that shows more whole animals; None if none does.

    Its contact sheet goes into the folder of the output.
    """
    if options.keypoints is not None:
        return None
    footage = open_footage(options.recording, options.rate_hz)
    step = max(1, min(round(footage.rate_hz / _TRIALS_HZ), footage.count // _FRAMES))
    frames = list(map(in_8_bits, islice(footage.read(), 0, _FRAMES * step, step)))
    LOGGER.info("%s: trying other options on %d frames", options.recording, len(frames))
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        (scratch / "frames").mkdir()
        for number, frame in enumerate(frames):
            cv2.imwrite(f"{name}/frames/{number:02d}.png", frame)
        best: tuple[str, Any] = ("force", True)
        usual = most = _used(options, best, scratch)
        for change in _changes(options, frames):
            used = _used(options, change, scratch)
            if used[1] > most[1] and used[0] >= _LEAST_SHARE:
                most, best = used, change
            if most[0] > _CLEAR_SHARE:
                break
        if most[1] < usual[1] + _LEAST_GAIN * len(frames):
            return None
        sheet = options.output.with_name(f"{options.output.stem}-tried.png")
        shutil.copy(scratch / f"{best[1]}.png", sheet)
    words = "--{} {}".format(*best).removesuffix(" True")
    return (
        f"of {len(frames)} frames, {usual[0]:.0%} show a whole animal, and {most[0]:.0%} with "
        f"{words}; look at {sheet}; try: "
        f"{shlex.join(['snakewalk', *sys.argv[1:]])} {words}"
    )


def _capture(options: CaptureOptions) -> CaptureFacts | AnimalsFacts:
    return (capture_recording if options.animals is None else capture_several)(options)


def _used(options: CaptureOptions, change: tuple[str, Any], scratch: Path) -> tuple[float, int]:
    """Share of the animals in a trial's frames that have points, and their number."""
    given = options.model_dump(include=_GIVEN) | {"force": True} | dict([change])
    trial = CaptureOptions(
        recording=scratch / "frames",
        output=scratch / "track.npz",
        sheet=scratch / f"{change[1]}.png",
        **given,
    )
    LOGGER.disabled = True
    try:
        facts = _capture(trial)
    except InputError:  # also options that exclude each other
        return 0.0, 0
    finally:
        LOGGER.disabled = False
    animals = captures(facts)
    used = sum(animal.frames_used for animal in animals if animal is not None)
    return used / (len(animals) * facts.frames), used


def _changes(options: CaptureOptions, frames: Sequence[Image]) -> Iterator[tuple[str, Any]]:
    yield "animals", AUTO
    yield "cropped", True
    if len({frame.shape for frame in frames}) > 1:
        return
    if options.roi is None and options.mask is None:
        for roi in _moving_parts(frames):
            yield "roi", roi
    if options.threshold is None:
        detector = make_detector(frames)
        levels = [detector.detect(frame).silhouette.threshold for frame in frames]
        for part in _THRESHOLDS:
            yield "threshold", max(1, round(part * float(np.median(levels))))


def _moving_parts(frames: Sequence[Image]) -> list[str]:
    """``X,Y,W,H`` around all parts of the picture that change, and around the largest ones."""
    change = cv2.blur(np.ptp(np.stack(frames), axis=0), (3, 3))
    if change.ndim == 3:
        change = change.max(axis=2)
    _, moved = cv2.threshold(change, 0, 1, cv2.THRESH_TRIANGLE)
    side = min(change.shape) // _MARGIN + 3
    moved = cv2.dilate(moved, np.ones((side, side), np.uint8))
    _, _, stats, _ = cv2.connectedComponentsWithStats(moved)
    # the animal may be smaller than a disturbance
    parts = sorted(stats[1:].tolist(), key=lambda part: part[-1])[-2:]
    boxes = [cv2.boundingRect(moved), *(tuple(part[:4]) for part in parts)]
    return [",".join(map(str, box)) for box in boxes]
