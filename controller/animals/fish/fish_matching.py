"""Postures from files: a film, two films, or midlines that were tracked already."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.loader import with_keys
from snakewalk.config.reading import Fact, by_user, texts
from snakewalk.controller.animals.fish.match_film import FilmMatch, match_film
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.postures import Postures, postures_of_track
from snakewalk.controller.animals.fish.silhouettes import open_film
from snakewalk.controller.track.choice import ALL
from snakewalk.controller.track.readers.load import load_track

MIDLINES = (".csv", ".npz", ".npy", ".mat", ".wcon", ".h5", ".slp", ".json")
"""Endings of tracked bodies; everything else is taken for images."""


@dataclass(frozen=True, slots=True)
class MatchedRecording:
    """Postures, facts of the match, and the matched film."""

    postures: Postures
    facts: dict[str, object]
    """Counts and ranges, and the facts about the file."""
    film: FilmMatch | None
    """Result of the matching to the film; None for tracked midlines."""


def match_footage(
    top: Path,
    side: Path | None,
    background: Path | None,
    side_background: Path | None,
    *,
    build: str,
    rate_hz: float | None,
    length_m: float | None,
    on_progress: Callable[[int, int], None],
) -> MatchedRecording:
    """Match a film, or two films of the same moments.

    Args:
        top: film from above.
        side: film from the side.
        background: picture of the scene without the fish, from above.
        side_background: the same from the side.
        build: carp or eel.
        rate_hz: frames a second, instead of the rate in the file.
        length_m: of the body; without it the unit is the body length.
        on_progress: called with the frames done, and in all.

    Raises:
        InputError: a file that cannot be read, or no fish in it.

    """
    model = fish_model(build)
    above = open_film(top, background, rate_hz)
    side_frames = None if side is None else open_film(side, side_background, rate_hz).frames
    film = match_film(
        above.frames,
        above.footage.count,
        model,
        rate_hz=above.footage.rate_hz,
        side=side_frames,
        length_m=length_m,
        name=top.name,
        on_progress=on_progress,
    )
    postures = film.postures
    value = None if postures.value is None else round(float(np.nanmedian(postures.value)), 3)
    about = {
        "quantity": Fact("silhouettes of a fish", "file", "its pictures"),
        "unit": by_user("--length", "m" if length_m else None)
        or Fact("body lengths", "inferred", "no length is given"),
        "order": Fact("head first", "inferred", "the better fit, or the displacement"),
        "time": above.footage.time_fact(postures.rate_hz, rate_hz),
    }
    facts = _facts(postures) | {
        "length_px": round(film.model.length_px, 1),
        "fins": film.model.fin,
        "rate_assumed": above.footage.rate_assumed,
        "background": above.detector.background_source,
        "left_out": film.lost,
        "value_v": value,
        "facts": texts(about),
    }
    return MatchedRecording(postures, facts, film)


def read_midlines(file: Path, build: str, rate_hz: float | None) -> MatchedRecording:
    """Postures of a recording that holds midlines.

    Raises:
        InputError: no recording that can be read.

    """
    track = load_track(str(file), with_keys(ALL, {"rate": rate_hz}, str(file)))
    postures = postures_of_track(track, fish_model(build).joints_at)
    rest = track.angles_rad - postures.tangents_rad()[postures.found]
    left_over_deg = round(float(np.degrees(np.sqrt(np.mean(rest**2)))), 2)
    facts = _facts(postures) | {
        "left_over_deg": left_over_deg,
        "facts": texts(track.facts),
        "notes": track.notes,
    }
    return MatchedRecording(postures, facts, None)


def _facts(postures: Postures) -> dict[str, object]:
    size = np.degrees(np.nanmax(np.abs(postures.angles_rad), axis=0))
    return {
        "frames": postures.frames,
        "matched": int(postures.found.sum()),
        "rate_hz": round(postures.rate_hz, 3),
        "largest_angles_deg": [float(angle) for angle in size.round(1)],
    }
