"""From frame to frame: the last posture is the next start, and a lost fish is looked for anew."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.fish.first_frame import rough_midline, starts
from snakewalk.controller.capture.fish.matching import EDGE_WEIGHT, SilhouetteFrame
from snakewalk.controller.capture.fish.model import FishModel
from snakewalk.controller.capture.fish.top_view import Match, search

LOST = 0.3
"""A posture of a smaller V explains nothing."""
_TIE = 0.05  # V by which one way round must be better than the other


@dataclass(frozen=True, slots=True)
class Step:
    """What became of one frame."""

    match: Match | None
    """None where the fish was not found; the frame is left out, not guessed."""
    reason: str = ""
    """Why, for a frame without a match."""


def track_film(
    frames: Iterable[SilhouetteFrame],
    model: FishModel,
    *,
    way: Floats | None = None,
    weight: float = EDGE_WEIGHT,
    pitches_rad: Iterable[float] | None = None,
) -> Iterator[Step]:
    """Match every frame.

    The start is last frame's posture moved on by the last step ([TH]: around the prolongation of
    the head), last frame's posture itself, and the silhouette's own skeleton turned the same way
    round; a fish that beats its tail fast is found by the last one. Below ``LOST`` the head may be
    at either end again.

    Args:
        frames: grey pictures and silhouettes.
        model: the calibrated fish.
        way: (2,) where the fish goes in the first frames, x right and y up; decides which end is
            the head where the build does not.
        weight: W of Eq. 3.
        pitches_rad: how far the head is lifted in each frame, if a side view said so.

    """
    last: Floats | None = None
    moved = np.zeros(3)
    pitch = iter(pitches_rad) if pitches_rad is not None else None
    for seen in frames:
        lifted = float(next(pitch)) if pitch is not None else 0.0
        line = None if seen.reason else rough_midline(seen.mask)
        if line is None:
            last = None
            yield Step(None, seen.reason or "no silhouette")
            continue
        found: Match | None = None
        ways = starts(model, line)
        if last is not None:
            ahead = last.copy()
            ahead[:3] += moved
            same = [at for at in ways if np.cos(at[2] - last[2]) > 0.0]
            found = search(
                seen, model, [ahead, last, *same], pitch_rad=lifted, weight=weight,
                near=ahead[:2], from_level=1,
            )  # fmt: skip
        if found is None or found.value < LOST:
            found = _anew(seen, model, ways, way if last is None else None, lifted, weight)
        if found is None or found.value < LOST:
            last = None
            yield Step(None, "no posture fits")
            continue
        here = found.parameters.copy()
        if last is not None:
            here[2] = last[2] + np.angle(np.exp(1j * (here[2] - last[2])))
            moved = (here - last)[:3]
        else:
            moved = np.zeros(3)
        last = here
        yield Step(Match(here, found.value))


def _anew(
    seen: SilhouetteFrame,
    model: FishModel,
    ways: list[Floats],
    way: Floats | None,
    pitch_rad: float,
    weight: float,
) -> Match | None:
    """Both ways round on their own; the build decides, and the way it goes only in a tie."""
    ends = [
        match
        for start in ways
        if (match := search(seen, model, [start], pitch_rad=pitch_rad, weight=weight)) is not None
    ]
    if not ends:
        return None
    ends.sort(key=lambda match: -match.value)
    if len(ends) > 1 and way is not None and ends[0].value - ends[1].value < _TIE:
        ends.sort(
            key=lambda match: (
                -float(np.cos(match.parameters[2]) * way[0] + np.sin(match.parameters[2]) * way[1])
            )
        )
    return ends[0]
