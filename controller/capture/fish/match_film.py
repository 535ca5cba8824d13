"""A whole film, one camera or two, to postures."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.fish.calibrate import calibrate
from snakewalk.controller.capture.fish.matching import EDGE_WEIGHT, SilhouetteFrame
from snakewalk.controller.capture.fish.model import FishModel
from snakewalk.controller.capture.fish.postures import Postures
from snakewalk.controller.capture.fish.side_view import SideCamera, SideView, align
from snakewalk.controller.capture.fish.tracking import track_film

Film = Callable[[], Iterator[SilhouetteFrame]]
"""Opens a film from its start."""
SAMPLE = 9
"""Frames from which the model is calibrated."""


@dataclass(frozen=True, slots=True)
class FilmMatch:
    """What matching a film gave."""

    postures: Postures
    model: FishModel
    """The calibrated fish; lengths in pixels of the top view."""
    parameters: Floats
    """(T, 3 + J) base x, y (px, y up), head direction, spine angles; NaN where not found."""
    side: Floats | None
    """(T, 2) height of the base (px of the side view, up) and pitch (rad)."""
    camera: SideCamera | None
    lost: dict[str, int]
    """Frames without a posture, by reason."""


def match_film(
    top: Film,
    frames: int,
    model: FishModel,
    *,
    rate_hz: float,
    side: Film | None = None,
    length_m: float | None = None,
    weight: float = EDGE_WEIGHT,
    name: str = "fish",
    tick: Callable[[], None] = lambda: None,
) -> FilmMatch:
    """Calibrate the model on a few frames and match all of them.

    Args:
        top: the view from above.
        frames: how many there are.
        model: the build, ``fish_model``.
        rate_hz: frames a second.
        side: the view from the side, frame by frame at the same moments.
        length_m: length of the fish; without it the unit is the body length.
        weight: W of Eq. 3.
        name: of the recording.
        tick: called after every frame.

    Raises:
        InputError: fewer than 2 frames, no body in the silhouettes, or views that do not fit.

    """
    if frames < 2:
        raise InputError(f"{name}: {frames} frames; a motion has at least 2")
    at = set(np.linspace(0, frames - 1, min(frames, SAMPLE)).astype(int).tolist())
    sample = [seen for k, seen in enumerate(top()) if k in at]
    model = calibrate(model, sample, weight, name)
    way, camera, looking = _way(sample), None, None
    if side is not None:
        beside = [seen for k, seen in enumerate(side()) if k in at]
        if len(beside) != len(sample):
            raise InputError(f"{name}: the two films differ in length; both must show every moment")
        camera = align(sample, beside, name)
        looking = SideView(_tall(model, camera, sample, beside, weight), camera, weight)
    rows, sides, values = [], [], []
    lost: dict[str, int] = {}
    flank = side() if side is not None else None
    nothing, no_side = np.full(3 + model.joints, np.nan), np.full(2, np.nan)
    for step in track_film(top(), model, way=way, weight=weight):
        rows.append(nothing if step.match is None else step.match.parameters)
        values.append(np.nan if step.match is None else step.match.value)
        if step.match is None:
            lost[step.reason] = lost.get(step.reason, 0) + 1
        if looking is not None and flank is not None:
            beside_now = next(flank, None)
            seen_aside = (
                looking.find(beside_now, rows[-1])
                if beside_now is not None and step.match is not None
                else None
            )
            sides.append(no_side if seen_aside is None else seen_aside[0])
        tick()
    parameters = np.array(rows)
    if int(np.isfinite(parameters[:, 2]).sum()) < 2:
        raise InputError(f"{name}: the model fits fewer than 2 of {len(rows)} frames")
    unit = (1.0 if length_m is None else length_m) / model.length_px
    aside = np.array(sides) if sides else None
    postures = Postures(
        base=parameters[:, :2] * unit,
        head_rad=_unwrapped(parameters[:, 2]),
        angles_rad=parameters[:, 3:],
        joints_at=model.joints_at,
        rate_hz=rate_hz,
        length_m=length_m,
        height=None if aside is None or camera is None else aside[:, 0] * unit / camera.scale,
        pitch_rad=None if aside is None else aside[:, 1],
        value=np.array(values),
        name=name,
    )
    return FilmMatch(postures, model, parameters, aside, camera, lost)


def _way(sample: list[SilhouetteFrame]) -> Floats | None:
    """Where the silhouette's centre goes over the sample, x right and y up."""
    centres = [
        np.array([columns.mean(), -rows.mean()])
        for rows, columns in (np.nonzero(seen.mask) for seen in sample)
        if len(rows)
    ]
    return centres[1] - centres[0] if len(centres) > 1 else None


def _tall(
    model: FishModel,
    camera: SideCamera,
    top: list[SilhouetteFrame],
    side: list[SilhouetteFrame],
    weight: float,
) -> FishModel:
    """Scale the model's height to the side view ([TH] 3.2.3)."""
    steps = [
        (step.match.parameters, beside)
        for seen, beside in zip(top, side, strict=True)
        for step in track_film([seen], model, weight=weight)
        if step.match is not None
    ]
    factors = np.array([0.55, 0.75, 1.0, 1.33, 1.8])
    steps = steps[::3]

    first = [SideView(model, camera, weight).find(seen, at) for at, seen in steps]

    def worth(factor: float) -> float:
        view = SideView(model.sized(model.length_px, height=factor), camera, weight)
        values = []
        for (at, seen), begun in zip(steps, first, strict=True):
            view.last = None if begun is None else begun[0]
            found = view.find(seen, at)
            values.append(-np.inf if found is None else found[1])
        return float(np.median(values or [-np.inf]))

    scores = np.array([worth(float(factor)) for factor in factors])
    k = int(scores.argmax())
    if 0 < k < len(factors) - 1 and np.isfinite(scores[k - 1 : k + 2]).all():
        curve = np.polyfit(np.log(factors[k - 1 : k + 2]), scores[k - 1 : k + 2], 2)
        return model.sized(model.length_px, height=float(np.exp(-curve[1] / (2.0 * curve[0]))))
    return model.sized(model.length_px, height=float(factors[k]))


def _unwrapped(angle_rad: Floats) -> Floats:
    """Turn jumps of 2 pi out, also across missing frames."""
    out = angle_rad.copy()
    known = np.isfinite(out)
    out[known] = np.unwrap(out[known])
    return out
