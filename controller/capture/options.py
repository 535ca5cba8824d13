"""Checks of the options of ``snakewalk animal capture`` before any work."""

from pathlib import Path

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.console.result_files import check_ending, refuse_to_overwrite
from snakewalk.controller.track.readers.writers import SUFFIXES

_FILMS = (".mp4", ".mkv", ".avi")
_PAGES = (".html", ".htm")
_SHEETS = (".png", ".jpg", ".jpeg")
AUTO = "auto"
"""Value of ``animals`` that follows all animals that persist."""
MOST_ANIMALS = 200


def check_options(options: CaptureOptions) -> None:
    """Check the options that need no film.

    Raises:
        InputError: an unusable option, or an existing result.

    """
    if options.cropped and options.background:
        raise InputError(
            "--cropped and --background: a moving camera has no background; leave one out"
        )
    if options.cropped and options.trail:
        raise InputError("--cropped and --trail: the camera must stand still; leave one out")
    if options.length_m and options.marker:
        raise InputError("--length-m and --marker both give the scale; leave one out")
    _check_files(options)
    if options.animals is not None:
        _check_animals(options, options.animals)
    refuse_to_overwrite(
        [
            options.output,
            options.overlay,
            options.sheet,
            options.steps,
            options.trail,
            options.review,
        ],
        options.force,
    )


def _check_files(options: CaptureOptions) -> None:
    """Reject a name of a result whose end is not a format of that result."""
    check_ending(options.output, "a track", *SUFFIXES)
    if options.wide:
        check_ending(options.output, "the table of --wide", ".csv")
    if options.cropped:
        check_ending(options.output, "a track without places (--cropped)", ".npz", ".wcon")
    if options.review:
        check_ending(options.output, "the track of --review", ".npz")
    check_ending(options.overlay, "an overlay film", *_FILMS)
    for picture in (options.sheet, options.steps, options.trail):
        check_ending(picture, "a picture", *_SHEETS)
    check_ending(options.review, "a review page", *_PAGES)


def _check_animals(options: CaptureOptions, animals: str) -> None:
    if animals != AUTO and not (animals.isdecimal() and 1 <= int(animals) <= MOST_ANIMALS):
        raise InputError(
            f"--animals {animals}: expected a number from 1 to {MOST_ANIMALS}, or {AUTO}"
        )
    for name in ("steps", "trail", "keypoints", "cropped"):
        if getattr(options, name):
            raise InputError(f"--animals and --{name}: this option is for one animal; leave it out")


def settings_of(options: CaptureOptions) -> dict[str, str | int | float | bool | None]:
    """Return the film and the options on which the skeletons depend."""
    film = options.recording
    names = {"background", "rate_hz", "head", "cropped", "roi", "mask", "threshold", "animals"}
    texts = options.model_dump(mode="json", include=names | {"keypoints"})
    size = 0
    if film.exists():
        size = sum(1 for _ in film.iterdir()) if film.is_dir() else film.stat().st_size
    return {"recording": film.name, "size": size, **texts}


def track_files(options: CaptureOptions, count: int) -> list[Path]:
    """Return the files of the tracks: one per animal, or one table of all."""
    if options.output.suffix.lower() != ".npz":
        return [options.output] * count
    return [
        options.output.with_name(f"{options.output.stem}-{number}.npz")
        for number in range(1, count + 1)
    ]


def places_of(options: CaptureOptions) -> list[tuple[float, float]]:
    """Return the places of ``--head``.

    Raises:
        InputError: not two finite numbers each, or several places for one animal.

    """
    places: list[tuple[float, float]] = []
    for text in [] if options.head is None else options.head.split(";"):
        try:
            x, y = (float(part) for part in text.split(","))
        except ValueError:
            x = y = np.nan
        if not np.isfinite([x, y]).all() or (places and options.animals is None):
            raise InputError(
                f"--head {options.head}: expected X,Y in pixels; with --animals X,Y;X,Y for "
                "several heads"
            )
        places.append((x, y))
    return places
