"""Postures of a complete film of one or two cameras: calibration, then tracking.

The last posture starts the next search; a lost fish is searched again in the complete frame.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.calibration import calibrate
from snakewalk.controller.animals.fish.initial_posture import midline_starts, rough_midline
from snakewalk.controller.animals.fish.matching import LEAST_VALUE, SilhouetteFrame
from snakewalk.controller.animals.fish.model import FishModel
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.animals.fish.side_view import SideCamera, SideView, align
from snakewalk.controller.animals.fish.top_view import Match, search

Film = Callable[[], Iterator[SilhouetteFrame]]
"""Function that opens a film from its start."""
SAMPLE = 9
"""Frames from which the model is calibrated."""
_HEIGHT_FACTORS = np.array([0.55, 0.75, 1.0, 1.33, 1.8])
_TIE = 0.05  # V by which one orientation must be better than the reversed one


@dataclass(frozen=True, slots=True)
class FilmMatch:
    """The postures of a film, and the model that was matched."""

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


@dataclass(frozen=True, slots=True)
class TrackedFrame:
    """The match of one frame, or the reason for its absence."""

    match: Match | None
    """Matched posture; None where the fish was not found: the frame is left out, not guessed."""
    reason: str = ""
    """Reason why a frame has no match."""


def match_film(
    top: Film,
    frames: int,
    model: FishModel,
    *,
    rate_hz: float,
    side: Film | None = None,
    length_m: float | None = None,
    name: str = "fish",
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> FilmMatch:
    """Calibrate the model on a few frames and match all of them.

    Args:
        top: the view from above.
        frames: how many there are.
        model: the build, ``fish_model``.
        rate_hz: frames a second.
        side: the view from the side, frame by frame at the same moments.
        length_m: length of the fish; without it the unit is the body length.
        name: of the recording.
        on_progress: called with the frames done, and in all.

    Raises:
        InputError: fewer than 2 frames, no body in the silhouettes, or views that do not fit.

    """
    if frames < 2:
        raise InputError(f"{name}: {frames} frames; a motion has at least 2")
    numbers = set(np.linspace(0, frames - 1, min(frames, SAMPLE)).astype(int).tolist())
    sample = [frame for k, frame in enumerate(top()) if k in numbers]
    model = calibrate(model, sample, name)
    camera = None
    side_view = None
    if side is not None:
        side_sample = [frame for k, frame in enumerate(side()) if k in numbers]
        if len(side_sample) != len(sample):
            raise InputError(f"{name}: the two films differ in length; both must show every moment")
        camera = align(sample, side_sample, name)
        model = _with_height(model, camera, sample, side_sample)
        side_view = SideView(model, camera)
    rows = []
    sides = []
    values = []
    lost: dict[str, int] = {}
    side_frames = side() if side is not None else None
    no_posture, no_side = np.full(3 + model.joints, np.nan), np.full(2, np.nan)
    for tracked in track_film(top(), model, travel=_travel(sample)):
        match = tracked.match
        rows.append(no_posture if match is None else match.parameters)
        values.append(np.nan if match is None else match.value)
        if match is None:
            lost[tracked.reason] = lost.get(tracked.reason, 0) + 1
        if side_view is not None and side_frames is not None:
            frame = next(side_frames, None)
            side_match = None
            if frame is not None and match is not None:
                side_match = side_view.search(frame, match.parameters)
            sides.append(no_side if side_match is None else side_match[0])
        on_progress(len(rows), frames)
    parameters = np.array(rows)
    if np.isfinite(parameters[:, 2]).sum() < 2:
        raise InputError(f"{name}: the model fits fewer than 2 of {len(rows)} frames")
    unit = (1.0 if length_m is None else length_m) / model.length_px
    side_found = np.array(sides) if sides else None
    height = None
    if side_found is not None and camera is not None:
        height = side_found[:, 0] * unit / camera.scale
    postures = Postures(
        base=parameters[:, :2] * unit,
        head_rad=_unwrapped_rad(parameters[:, 2]),
        angles_rad=parameters[:, 3:],
        joints_at=model.joints_at,
        rate_hz=rate_hz,
        length_m=length_m,
        height=height,
        pitch_rad=None if side_found is None else side_found[:, 1],
        value=np.array(values),
        name=name,
        model=model,
    )
    return FilmMatch(postures, model, parameters, side_found, camera, lost)


def track_film(
    frames: Iterable[SilhouetteFrame], model: FishModel, *, travel: Floats | None = None
) -> Iterator[TrackedFrame]:
    """Match every frame.

    A search starts from three postures: the last one moved by the last step ([TH]), the last one,
    and the silhouette's skeleton with its head at the same end. The third one finds a fish with a
    fast tail. Where V falls below ``LEAST_VALUE`` the head may be at either end again.

    Args:
        frames: grey pictures and silhouettes.
        model: the calibrated fish.
        travel: (2,) displacement of the fish in the first frames, x right and y up; it decides
            which end is the head where the build does not.

    """
    last: Floats | None = None
    moved = np.zeros(3)
    for frame in frames:
        line = None if frame.reason else rough_midline(frame.mask)
        if line is None:
            last = None
            yield TrackedFrame(None, frame.reason or "no silhouette")
            continue
        previous: Match | None = None
        starts = midline_starts(model, line)
        if last is not None:
            ahead = last.copy()
            ahead[:3] += moved
            aligned = [start for start in starts if np.cos(start[2] - last[2]) > 0.0]
            previous = search(frame, model, [ahead, last, *aligned], near=ahead[:2], from_level=1)
        if previous is None or previous.value < LEAST_VALUE:
            previous = _search_from_starts(frame, model, starts, travel if last is None else None)
        if previous is None or previous.value < LEAST_VALUE:
            last = None
            yield TrackedFrame(None, "no posture fits")
            continue
        parameters = previous.parameters.copy()
        if last is not None:
            parameters[2] = last[2] + np.angle(np.exp(1j * (parameters[2] - last[2])))
            moved = (parameters - last)[:3]
        else:
            moved = np.zeros(3)
        last = parameters
        yield TrackedFrame(Match(parameters, previous.value))


def _search_from_starts(
    frame: SilhouetteFrame, model: FishModel, starts: list[Floats], travel: Floats | None
) -> Match | None:
    """Search with the head at either end; V decides, and the direction of travel only in a tie."""
    matches = [match for start in starts if (match := search(frame, model, [start])) is not None]
    if not matches:
        return None
    matches.sort(key=lambda match: -match.value)
    if len(matches) > 1 and travel is not None and matches[0].value - matches[1].value < _TIE:
        matches.sort(
            key=lambda match: (
                -float(
                    np.cos(match.parameters[2]) * travel[0]
                    + np.sin(match.parameters[2]) * travel[1]
                )
            )
        )
    return matches[0]


def _travel(sample: list[SilhouetteFrame]) -> Floats | None:
    """Displacement (2,) of the silhouette's centre between two frames, x right and y up."""
    centres = [
        np.array([columns.mean(), -rows.mean()])
        for rows, columns in (np.nonzero(frame.mask) for frame in sample)
        if len(rows)
    ]
    return centres[1] - centres[0] if len(centres) > 1 else None


def _with_height(
    model: FishModel,
    camera: SideCamera,
    top: list[SilhouetteFrame],
    side: list[SilhouetteFrame],
) -> FishModel:
    """Scale the model's height to the side view ([TH] 3.2.3)."""
    pairs = [
        (tracked.match.parameters, side_frame)
        for above, side_frame in zip(top, side, strict=True)
        for tracked in track_film([above], model)
        if tracked.match is not None
    ][::3]
    first = [SideView(model, camera).search(frame, parameters) for parameters, frame in pairs]

    def median_value(factor: float) -> float:
        view = SideView(model.sized(model.length_px, height=factor), camera)
        values = []
        for (parameters, frame), start in zip(pairs, first, strict=True):
            view.last = None if start is None else start[0]
            side_match = view.search(frame, parameters)
            values.append(-np.inf if side_match is None else side_match[1])
        return float(np.median(values or [-np.inf]))

    factors = _HEIGHT_FACTORS
    scores = np.array([median_value(float(factor)) for factor in factors])
    k = int(scores.argmax())
    if 0 < k < len(factors) - 1 and np.isfinite(scores[k - 1 : k + 2]).all():
        curve = np.polyfit(np.log(factors[k - 1 : k + 2]), scores[k - 1 : k + 2], 2)
        return model.sized(model.length_px, height=float(np.exp(-curve[1] / (2.0 * curve[0]))))
    return model.sized(model.length_px, height=float(factors[k]))


def _unwrapped_rad(angle_rad: Floats) -> Floats:
    """Turn jumps of 2 pi out, also across missing frames."""
    out = angle_rad.copy()
    is_known = np.isfinite(out)
    out[is_known] = np.unwrap(out[is_known])
    return out
