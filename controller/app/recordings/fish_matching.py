"""Postures from files: a film, two films, or midlines that someone has tracked already."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.controller.capture.fish.match_film import FilmMatch, match_film
from snakewalk.controller.capture.fish.model import fish_model
from snakewalk.controller.capture.fish.postures import Postures, postures_of_track
from snakewalk.controller.capture.fish.silhouettes import open_film
from snakewalk.controller.capture.readers.load import load_track

MIDLINES = (".csv", ".npz", ".npy", ".mat", ".wcon", ".h5", ".slp", ".json")
"""Endings of tracked bodies; everything else is taken for images."""


def match_footage(
    top: Path,
    side: Path | None,
    background: Path | None,
    side_background: Path | None,
    *,
    build: str,
    rate_hz: float | None,
    length_m: float | None,
    tick: Callable[[int, int], None],
) -> tuple[FilmMatch, dict[str, Any]]:
    """Match a film and say what was found.

    Raises:
        InputError: a file that cannot be read, or no fish in it.

    """
    model = fish_model(build)
    above = open_film(top, background, rate_hz)
    beside = None if side is None else open_film(side, side_background, rate_hz)
    total, done = above.footage.count, 0

    def count() -> None:
        nonlocal done
        done += 1
        tick(done, total)

    matched = match_film(
        above.frames,
        total,
        model,
        rate_hz=above.footage.rate_hz,
        side=None if beside is None else beside.frames,
        length_m=length_m,
        name=top.name,
        on_progress=count,
    )
    facts = facts_of(matched.postures) | {
        "length_px": round(matched.model.length_px, 1),
        "rate_assumed": above.footage.rate_assumed,
        "left_out": matched.lost,
    }
    value = matched.postures.value
    if value is not None:
        facts["value_v"] = round(float(np.nanmedian(value)), 3)
    return matched, facts


def read_midlines(file: Path, build: str, rate_hz: float | None) -> tuple[Postures, dict[str, Any]]:
    """Postures of a recording that holds midlines.

    Raises:
        InputError: no recording that can be read.

    """
    track = load_track(str(file), rate_hz)
    found = postures_of_track(track, fish_model(build).joints_at)
    off = np.degrees(np.sqrt(np.mean((track.angles_rad - found.tangents_rad()[found.found]) ** 2)))
    return found, facts_of(found) | {"left_over_deg": round(float(off), 2)}


def facts_of(postures: Postures) -> dict[str, Any]:
    """Counts and ranges of postures."""
    size = np.degrees(np.nanmax(np.abs(postures.angles_rad), axis=0))
    return {
        "frames": postures.frames,
        "matched": int(postures.found.sum()),
        "rate_hz": round(postures.rate_hz, 3),
        "largest_angles_deg": size.round(1).tolist(),
    }
