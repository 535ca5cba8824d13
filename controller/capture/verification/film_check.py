"""A film's skeletons checked against the pixels of their own frames."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.controller.capture.coil_film import COIL_LEAST
from snakewalk.controller.capture.identity import margin_of
from snakewalk.controller.capture.staged_film import StagedFilm, with_statuses
from snakewalk.controller.capture.verification.frame_store import FrameStore
from snakewalk.controller.capture.verification.judge import judged_error_px
from snakewalk.controller.capture.verification.profiles import (
    BodyProfile,
    body_profile,
    direction_of,
)
from snakewalk.controller.images.medial_axis import Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SMOOTH = 1.5  # chords
_TIGHTEST = 2.3  # rad over one width of the body; at half a width of radius it is 2
_SMALL_LOOP = 3.0  # widths along the body: a loop around nothing has pi of them


def possible_form(body: Skeleton) -> bool:
    """Whether no bend is tighter than half a width, and no loop smaller than the width.

    A body that is not known to lie on itself has no loop at all.
    """
    points = body.points_px
    wide = 2.0 * float(np.median(body.radius_px))
    step = np.diff(points, axis=0)
    chord = float(np.hypot(*step.T).mean())
    angle = gaussian_filter1d(np.unwrap(np.arctan2(step[:, 1], step[:, 0])), _SMOOTH)
    lag = max(1, round(wide / chord))
    if lag < len(angle):
        turn = np.abs(angle[lag:] - angle[:-lag])
        if turn.max() > _TIGHTEST * max(1.0, lag * chord / wide):
            return False
    loops = crossings(points)
    if not len(loops):
        return True
    if body.status is not FrameStatus.COIL:
        return False
    return bool((np.abs(loops[:, 1] - loops[:, 0]) * chord >= _SMALL_LOOP * wide).all())


def crossings(points: Floats) -> Ints:
    """(K, 2) numbers of the chords of a line (P, 2) that cross each other."""
    step = np.diff(points, axis=0)
    first = points[:-1]
    gap = first[None] - first[:, None]
    across = step[:, None, 0] * step[None, :, 1] - step[:, None, 1] * step[None, :, 0]
    safe = np.where(np.abs(across) < 1e-12, np.inf, across)
    along_first = (gap[..., 0] * step[None, :, 1] - gap[..., 1] * step[None, :, 0]) / safe
    other = (gap[..., 0] * step[:, None, 1] - gap[..., 1] * step[:, None, 0]) / safe
    number = np.arange(len(step))
    far = number[None] - number[:, None] > 1
    hit = far & (along_first > 0.0) & (along_first < 1.0) & (other > 0.0) & (other < 1.0)
    return np.asarray(np.argwhere(hit), dtype=np.int64)


REJECTED = {FrameStatus.EMPTY, FrameStatus.KNOT, FrameStatus.LENGTH}
"""Statuses of frames whose skeleton this module rejects."""
_SAMPLE = 60  # frames from which the usual contrast is learnt
_USUAL_PERCENTILE = 75.0  # percentile of the frames: some may lie on empty ground
_LEAST_LEVELS = 2.0  # grey levels between the body and the ground on either side, in the mean
_SHARE = 0.3  # of the usual contrast, in the mean on either side
_NOISE = 3.0  # standard errors of the ground's noise
_FAINT = 0.15  # of the usual contrast there: the body does not stand out
_STRETCH = 5  # stations that are averaged
_ONE_SIDE = 25
_BOTH_SIDES = 10  # stations of a stretch that does not stand out
_LEAST_KNOWN = 0.4  # of the stations: with fewer on ground a side is not judged
_LEVEL_BEYOND_TIP = 0.5  # of the contrast at a tip: with more beyond the tip the body continues
_FAINT_SAMPLE = 40
_FEWEST_FAINT = 6  # frames in which faint parts beyond a tip are searched
_FAINT_BEYOND = 0.035  # of the usual contrast: least contrast of a faint part beyond a tip
_SAME_TIP = 0.85  # of these frames: beyond the same tip
_FAINT_TAIL = 0.1  # of the length: expected error if something faint goes on beyond a tip
_LENGTH = 0.08
_SPREADS = 6.0  # of the usual length; standard deviations
_FEWEST = 5
_CONTRADICTS = 0.2  # margin of the ends from which one frame determines them
_NEIGHBOUR_FRAMES = 3  # largest number of frames between compared ends


@dataclass(frozen=True, slots=True)
class _Usual:
    """Usual values of the film's bodies."""

    direction: Floats
    """(C,) weights of the channels: the body is above 0."""
    contrast: Floats
    """(101,) along the body."""


class Verify:
    """Stage that compares each finished skeleton with its own frame."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film; contradicted frames have no points, unclear ones are rough."""
        detections = film.detections
        skeletons, judged_px = verified(film.skeletons, detections.store)
        judged_px[[*detections.tips]] = 0.0  # their tips have errors of their own
        expected = np.hypot(film.expected_px, np.where(film.solved, 0.0, judged_px))
        usual = expected[~film.solved & np.isfinite(expected)]
        least = COIL_LEAST * float(np.median(usual)) if usual.size else 0.0
        expected[film.solved] = np.maximum(expected[film.solved], least)
        expected[[not skeleton.status.has_points for skeleton in skeletons]] = np.nan
        goes_on = not detections.shows_tips(skeletons) and has_faint_continuation(
            skeletons, detections.store
        )
        if goes_on or detections.is_unclear(skeletons):
            expected = np.fmax(
                expected, [_FAINT_TAIL * skeleton.length_px for skeleton in film.skeletons]
            )
        return replace(film, skeletons=with_statuses(skeletons, expected), expected_px=expected)


def verified(skeletons: Sequence[Skeleton], store: FrameStore) -> tuple[list[Skeleton], Floats]:
    """Return the skeletons, and the error (T,) of each that its own frame shows.

    A contradicted one has no points, and its status gives the reason.

    Args:
        skeletons: (T) head first.
        store: the frames.

    """
    out = agreeing_ends(skeletons)
    used = [k for k, skeleton in enumerate(out) if skeleton.status.has_points]
    for k in used:
        if not possible_form(out[k]):
            out[k] = no_skeleton(FrameStatus.KNOT)
    _check_lengths(out)
    used = [k for k, skeleton in enumerate(out) if skeleton.status.has_points]
    shown = {k: profile for k in used if (profile := _profile(out[k], store, k)) is not None}
    usual = _usual([*shown.values()][:: max(1, len(shown) // _SAMPLE)])
    judged_px = np.zeros(len(out))
    if usual is None:
        return out, judged_px
    for k, profile in shown.items():
        judged_px[k] = judged_error_px(profile, out[k].length_px)
        status = _verdict(profile, usual)
        if status is not FrameStatus.GOOD:
            out[k] = no_skeleton(status)
    return out, judged_px


def has_faint_continuation(skeletons: Sequence[Skeleton], store: FrameStore) -> bool:
    """Whether something faint goes on beyond the same tip in most frames of a film.

    The check of a single frame finds only strong parts. Noise and stains are alike beyond both
    tips, so the difference between the tips over many frames shows a faint tail.

    Args:
        skeletons: (T) head first, those of ``verified``.
        store: the frames.

    """
    used = [k for k, skeleton in enumerate(skeletons) if skeleton.status.has_points]
    some = used[:: max(1, -(-len(used) // _FAINT_SAMPLE))]
    profiles = [profile for k in some if (profile := _profile(skeletons[k], store, k)) is not None]
    usual = _usual(profiles)
    if usual is None:
        return False
    beyond = np.array([_along_a_ray(profile.rings @ usual.direction) for profile in profiles])
    differences = (beyond[:, 1] - beyond[:, 0])[np.isfinite(beyond).all(axis=1)]
    if len(differences) < _FEWEST_FAINT:
        return False
    middle = float(np.median(differences))
    same_sign_share = float(np.mean(np.sign(differences) == np.sign(middle)))
    least = max(_LEAST_LEVELS, _FAINT_BEYOND * float(usual.contrast.mean()))
    return same_sign_share >= _SAME_TIP and abs(middle) > least


def _along_a_ray(rings: Floats) -> Floats:
    """(2,) contrast that goes on through all rings (2, rings, angles) in one direction."""
    is_known: Bools = np.asarray(np.isfinite(rings).any(axis=2))
    lowest = np.nanmin(np.where(is_known[..., None], rings, np.inf), axis=1)
    return np.where(is_known.sum(axis=1) >= 3, lowest.max(axis=1), np.nan)


def agreeing_ends(skeletons: Sequence[Skeleton]) -> list[Skeleton]:
    """Return the skeletons, reversed where head and tail surely contradict the frame before.

    A body does not change its ends from one frame to the next. The direction of most frames is
    kept.
    """
    used = [k for k, skeleton in enumerate(skeletons) if skeleton.status.has_points]
    sign = np.ones(len(skeletons), dtype=int)
    for before, k in pairwise(used):
        against = margin_of(skeletons[k], skeletons[before]) < -_CONTRADICTS
        sign[k] = -sign[before] if against and k - before <= _NEIGHBOUR_FRAMES else sign[before]
    wrong = -1 if sign[used].sum() >= 0 else 1
    return [
        skeleton.reversed() if skeleton.status.has_points and sign[k] == wrong else skeleton
        for k, skeleton in enumerate(skeletons)
    ]


def _check_lengths(bodies: list[Skeleton]) -> None:
    """Reject bodies whose length is outside the film's range."""
    length = np.array([body.length_px for body in bodies])
    good = np.array([body.status is FrameStatus.GOOD for body in bodies])
    if good.sum() < _FEWEST:
        return
    off = length / float(np.median(length[good])) - 1.0
    spread = 1.4826 * float(np.median(np.abs(off[good])))
    for k in np.flatnonzero(np.abs(off) > max(_LENGTH, _SPREADS * spread)):
        bodies[k] = no_skeleton(FrameStatus.LENGTH)


def _profile(body: Skeleton, store: FrameStore, number: int) -> BodyProfile | None:
    cut_out = store.get(number)
    return None if cut_out is None else body_profile(body, cut_out)


def _usual(profiles: Sequence[BodyProfile]) -> _Usual | None:
    if not profiles:
        return None
    mean = np.array([np.nanmean(profile.sides, axis=(0, 1)) for profile in profiles])
    mean = mean[np.isfinite(mean).all(axis=1)]
    if not len(mean):
        return None
    strong = mean[np.argsort(np.linalg.norm(mean, axis=1))[len(mean) // 2 :]]
    direction = direction_of(strong)
    with warnings.catch_warnings():  # a point may have no ground on either side
        warnings.simplefilter("ignore", RuntimeWarning)
        along = np.array([np.nanmean(profile.sides, axis=0) @ direction for profile in profiles])
        level = np.nanmean(along, axis=1)
    best = along[level >= np.nanpercentile(level, _USUAL_PERCENTILE) * 0.5]
    if not len(best):
        return None
    contrast = np.nanmedian(best, axis=0)
    contrast = np.where(np.isfinite(contrast), contrast, np.nanmedian(contrast))
    return _Usual(direction, contrast)


def _verdict(profile: BodyProfile, usual: _Usual) -> FrameStatus:
    sides = profile.sides @ usual.direction
    expected = float(usual.contrast.mean())
    for side in sides:
        is_known = np.isfinite(side)
        if is_known.mean() < _LEAST_KNOWN:
            continue
        standard_error = profile.noise / np.sqrt(max(1.0, 0.25 * is_known.sum()))
        least = max(_LEAST_LEVELS, _SHARE * expected, _NOISE * standard_error)
        if side[is_known].mean() < least:
            return FrameStatus.EMPTY
    is_visible = np.maximum(usual.contrast, 0.0) > max(_LEAST_LEVELS, 3.0 * profile.noise)
    faint = [_averaged_stations(side) < _FAINT * usual.contrast for side in sides]
    if _longest_run(faint[0] & faint[1] & is_visible) >= _BOTH_SIDES:
        return FrameStatus.EMPTY
    if any(_longest_run(faint_side & is_visible) >= _ONE_SIDE for faint_side in faint):
        return FrameStatus.EMPTY
    for tip, rings in enumerate(profile.rings @ usual.direction):
        near = usual.contrast[5:16] if tip == 0 else usual.contrast[-16:-5]
        strongest = np.nan_to_num(np.nanmax(np.nan_to_num(rings, nan=-np.inf), axis=1), neginf=0.0)
        if strongest.min() > max(_LEVEL_BEYOND_TIP * near.mean(), 4.0 * profile.noise):
            return FrameStatus.PART
    return FrameStatus.GOOD


def _averaged_stations(side: Floats) -> Floats:
    """(101,) averaged over a few stations; infinite without ground."""
    is_known = np.isfinite(side)
    weight = uniform_filter1d(is_known.astype(float), _STRETCH, mode="nearest")
    total = uniform_filter1d(np.where(is_known, side, 0.0), _STRETCH, mode="nearest")
    return np.where(is_known & (weight > 0.5), total / np.maximum(weight, 1e-9), np.inf)


def _longest_run(mask: Bools) -> int:
    """Length of the longest run."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))
