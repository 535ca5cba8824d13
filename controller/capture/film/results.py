"""Files of captured animals: one track each, or one table of all."""

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from snakewalk.controller.capture.capture import CaptureFile, save_capture
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.track.readers.load import load_file
from snakewalk.controller.track.readers.writers import write_tracks
from snakewalk.controller.track.track import Track


def write_captures(path: Path, animals: Sequence[CaptureFile], *, wide: bool = False) -> None:
    """Write one captured animal as a track, or any number as a .csv or .wcon.

    Args:
        path: of the result; its suffix gives the format.
        animals: one for an .npz.
        wide: one row of a .csv a frame, instead of one a point.

    """
    with atomic_write(path) as part:
        if path.suffix.lower() == ".npz":
            (only,) = animals
            save_capture(part, only)
        else:
            unit = "px" if animals[0].m_per_px is None else "m"
            tracks = [_track(animal) for animal in animals]
            write_tracks(part, tracks, path.suffix, wide=wide, unit=unit)


def _track(capture_file: CaptureFile) -> Track:
    """The track of a captured animal; in pixels without a scale."""
    if capture_file.m_per_px is None:
        capture_file = replace(capture_file, m_per_px=1.0)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "track.npz"
        save_capture(file, capture_file)
        return load_file(file)
