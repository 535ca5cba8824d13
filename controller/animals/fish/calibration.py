"""Size and sections of the model from the film, [TH] 3.2.3, for a moving fish.

The text grows a model on a straight fish. Here the posture is searched in a few frames, and the
width is measured on the silhouettes along these spines. Length, width and pectoral fins are scaled
to the largest V; all of it twice.
"""

from dataclasses import replace

import cv2
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.initial_posture import midline_starts, rough_midline
from snakewalk.controller.animals.fish.matching import SilhouetteFrame, Target
from snakewalk.controller.animals.fish.model import STATIONS, FishModel
from snakewalk.controller.animals.fish.pattern_search import pattern_search
from snakewalk.controller.animals.fish.top_view import Match, TopViewFit, search, window_of

SHORTEST_PX = 20.0
FINS = (0.0, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.17)
"""Lengths of the pectoral fins that are tried, body lengths."""


def calibrate(model: FishModel, sample: list[SilhouetteFrame], name: str = "film") -> FishModel:
    """Fit the build to a few frames of one fish.

    Args:
        model: the build to begin with; its length is not used.
        sample: frames, best of different postures.
        name: of the film, for faults.

    Raises:
        InputError: no frame holds a silhouette of a body, or the body is below 20 px.

    """
    reasons = sorted({frame.reason for frame in sample if frame.reason})
    midlines = [None if frame.reason else rough_midline(frame.mask) for frame in sample]
    usable = [
        (frame, line) for frame, line in zip(sample, midlines, strict=True) if line is not None
    ]
    if not usable:
        why = f" ({'; '.join(reasons)})" if reasons else ""
        raise InputError(
            f"{name}: no silhouette of one body in {len(sample)} frames{why}; a fish that hardly "
            "moves needs --background, a picture of the empty scene"
        )
    lengths = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for _, line in usable]
    length = float(np.median(lengths))
    if length < SHORTEST_PX:
        raise InputError(f"{name}: the body is {length:.0f} px long; at least {SHORTEST_PX:.0f}")
    model = model.sized(length)
    for _ in range(2):
        matches: list[tuple[SilhouetteFrame, Match]] = []
        for frame, line in usable:
            match = search(frame, model, midline_starts(model, line))
            if match is not None and np.isfinite(match.value):
                matches.append((frame, match))
        if not matches:
            raise InputError(f"{name}: no posture of the model fits any of {len(sample)} frames")
        matches.sort(key=lambda pair: -pair[1].value)
        good = matches[: max(1, (len(matches) + 1) // 2)]
        model = replace(model, half_width=_widths(model, good))
        sizes = np.array([_size(model, frame, match) for frame, match in good])
        grown = np.median(sizes, axis=0)
        model = model.sized(model.length_px * float(grown[0]), width=float(grown[1]))
        model = _with_fins(model, good)
    return model


def _with_fins(model: FishModel, good: list[tuple[SilhouetteFrame, Match]]) -> FishModel:
    """Fins of the largest V: fins that stand out from the body widen the measured outline."""
    variants = [model.with_fins(length) for length in FINS]
    return max(
        variants, key=lambda variant: float(np.median([_value(variant, *pair) for pair in good]))
    )


def _value(model: FishModel, frame: SilhouetteFrame, match: Match) -> float:
    """V of a fitted posture, with another model."""
    target = _target(model, frame, match)
    return float("-inf") if target is None else TopViewFit(target, model).value(match.parameters)


def _target(model: FishModel, frame: SilhouetteFrame, match: Match) -> Target | None:
    scale = min(1.0, 200.0 / model.length_px)
    window = window_of(frame, model, match.parameters[:2], scale)
    return None if window is None else Target(frame, window, 3)


def _widths(model: FishModel, good: list[tuple[SilhouetteFrame, Match]]) -> Floats:
    """(STATIONS,) half widths in body lengths: median over frames of the silhouette's depth."""
    rows = []
    for frame, match in good:
        parameters = match.parameters
        deep = cv2.distanceTransform(frame.mask.astype(np.uint8), cv2.DIST_L2, 5)
        line = model.midline(parameters[:2], float(parameters[2]), parameters[3:])
        column = np.clip(np.rint(line[:, 0]), 0, deep.shape[1] - 1).astype(int)
        row = np.clip(np.rint(-line[:, 1]), 0, deep.shape[0] - 1).astype(int)
        rows.append(deep[row, column])
    half_px = np.maximum(np.median(np.array(rows), axis=0), 0.5)
    soft = np.convolve(np.pad(half_px, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid")
    soft[[0, -1]] = np.minimum(soft[[0, -1]], 0.02 * model.length_px)
    return soft[:STATIONS] / model.length_px


def _size(model: FishModel, frame: SilhouetteFrame, match: Match) -> tuple[float, float]:
    """Factors of length and width of the largest V, the fish free to slide along its head."""
    target = _target(model, frame, match)
    if target is None:
        return 1.0, 1.0
    ahead = np.array([np.cos(match.parameters[2]), np.sin(match.parameters[2])])

    def value(size: Floats) -> float:
        if size[0] < 0.5 or size[1] < 0.3:
            return float("-inf")
        grown = model.sized(model.length_px * float(size[0]), width=float(size[1]))
        parameters = match.parameters.copy()
        parameters[:2] += ahead * size[2]
        return TopViewFit(target, grown).value(parameters)

    first = np.array([0.05, 0.1, 0.03 * model.length_px])
    size_values, _ = pattern_search(
        value, np.array([1.0, 1.0, 0.0]), first, halvings=4, evaluations=200
    )
    return float(size_values[0]), float(size_values[1])
