"""Options of a capture, and copies of them."""

from pathlib import Path
from typing import Any

from snakewalk.controller.capture.film.film_options import CaptureOptions


def film_options(recording: Path, output: Path, **others: Any) -> CaptureOptions:
    """Options of a film, and the track to write."""
    return CaptureOptions(recording=recording, output=output, **others)


def changed(options: CaptureOptions, **others: Any) -> CaptureOptions:
    """Options with other values."""
    return CaptureOptions(**options.model_dump() | others)
