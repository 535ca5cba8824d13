"""One animal of a film on its way through the stages of a capture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.identity import margins
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus

ROUGH = 0.01
"""Share of the length: a frame of larger expected error is ``ROUGH``."""


@dataclass(frozen=True, slots=True)
class StagedFilm:
    """Input and output of a stage."""

    detections: Detections
    """All T frames, as the detector found the body."""
    skeletons: tuple[Skeleton, ...]
    """(T,) of the last stage."""
    expected_px: Floats
    """(T,) expected mean error of a point; NaN where unknown."""
    solved: Bools
    """(T,) frames that the film's body model has solved."""
    rate_hz: float
    fixed: bool = True
    """Whether the camera stands still."""
    head_px: tuple[float, float] | None = None
    """Place near the head in the first usable frame."""
    head: tuple[float, str] = (0.0, "taper")
    """Certainty that the first end is the head, -1 to 1, and its clearest sign."""


def evenly_chosen(numbers: Sequence[int], most: int) -> list[int]:
    """Return at most ``most`` of some numbers, spread over them."""
    place = np.linspace(0, len(numbers) - 1, min(most, len(numbers)))
    return [numbers[round(k)] for k in place]


def arrays_of(skeletons: Sequence[Skeleton]) -> dict[str, Any]:
    """Return the arrays of a ``Capture`` that follow from its T skeletons."""
    return {
        "points_px": np.stack([skeleton.points_px for skeleton in skeletons]),
        "radius_px": np.stack([skeleton.radius_px for skeleton in skeletons]),
        "length_px": np.array([skeleton.length_px for skeleton in skeletons]),
        "status": tuple(skeleton.status for skeleton in skeletons),
        "margin": margins(skeletons),
    }


class Stage(Protocol):
    """A step of a capture."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film with better skeletons, or with reasons against them."""


def with_statuses(bodies: Sequence[Skeleton], error_px: Floats) -> tuple[Skeleton, ...]:
    """Return the bodies, ``ROUGH`` where the expected errors (T,) are too large."""
    return tuple(
        replace(body, status=FrameStatus.ROUGH)
        if body.status is FrameStatus.GOOD and error > ROUGH * body.length_px
        else body
        for body, error in zip(bodies, error_px.tolist(), strict=True)
    )
