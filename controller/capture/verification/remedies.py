"""Options that help a film of which too little is captured, tried on a few of its frames."""

import shlex
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from snakewalk.config.arrays import DeepImage
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.opened_film import OpenedFilm
from snakewalk.controller.capture.several.animal_films import share_of_several
from snakewalk.controller.images.body_detector import BodyDetector, make_detector, whole_share

_FRAMES = 20
_THRESHOLDS = (0.4, 0.6, 1.6)  # of the contrast at the boundary
_LEAST_GAIN = 0.25  # of the frames: this share more must show a whole animal
_LEAST_SHARE = 0.5  # of the frames, at least


def remedy(options: CaptureOptions, film: OpenedFilm, detector: BodyDetector) -> str | None:
    """Return a sentence with the command that shows more whole animals; None if none does.

    Args:
        options: of the command that failed.
        film: its film.
        detector: the detector of that command.

    """
    frames = film.some[:_FRAMES]
    before = whole_share(detector, frames)
    tried = list(_tried_options(options, film, detector, frames))
    if not tried:
        return None
    words, share = max(tried, key=lambda trial: trial[1])
    if share < max(_LEAST_SHARE, before + _LEAST_GAIN):
        return None
    command = shlex.join(
        ["snakewalk", "animal", "capture", str(options.recording), "-o", str(options.output)]
    )
    return (
        f"of {len(frames)} frames, {round(before * len(frames))} show a whole animal, and "
        f"{round(share * len(frames))} with {words}; try: {command} {words} --sheet sheet.png"
    )


def _tried_options(
    options: CaptureOptions,
    film: OpenedFilm,
    detector: BodyDetector,
    frames: tuple[DeepImage, ...],
) -> Iterator[tuple[str, float]]:
    """Options, and the share of the frames in which they show whole animals."""
    inside = film.region.inside
    if film.one_size and not options.cropped:
        try:
            several = share_of_several(frames, film.background, inside, film.threshold)
        except InputError:
            several = 0.0
        yield "--animals auto", several
    if not options.cropped and film.background is None and options.trail is None:
        alone = make_detector(frames, cropped=True, inside=inside, threshold=film.threshold)
        yield "--cropped", whole_share(alone, frames)
    if film.threshold is None and film.footage.deep is None:
        usual = float(np.median([detector.detect(frame).silhouette.threshold for frame in frames]))
        for level in {max(1, round(part * usual)) for part in _THRESHOLDS}:
            yield f"--threshold {level}", whole_share(replace(detector, threshold=level), frames)
