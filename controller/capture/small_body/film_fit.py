"""Small bodies of a film fitted to its grey values, with one body for all frames.

A frame's expected error follows from the residual of its picture and from the error of the shared
body; above a hundredth of the length the frame is ``ROUGH``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.capture.small_body.blur_estimate import axis_error_px
from snakewalk.controller.capture.small_body.crop import Crop, View, Workspace, reversed_body
from snakewalk.controller.capture.small_body.film_body import (
    FilmBody,
    Fit,
    Patch,
    film_body,
    fit_frame,
    with_shadow,
)
from snakewalk.controller.capture.small_body.ribbon import (
    BENDS,
    BODY,
    STATIONS,
    Ribbon,
    curve_of,
    curve_slopes,
)
from snakewalk.controller.capture.small_body.tip_profile import beyond_tips_px, tips_error_px
from snakewalk.controller.capture.staged_film import evenly_chosen
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, in_equal_chords, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SAMPLE_PX = 30000.0  # working pixels in all frames of the sample
_FEWEST_SAMPLES = 8
_MOST_SAMPLES = 40
_PASSES = 2
_FORM = 0.004  # of the length: possible error of the model of the tips
_UNLIKE_MISFIT = (
    10.0  # times misfit and blur: error of the shared parameters; measured on rendered films
)
_SHARP = 62.0  # times the blur: the medial axis of a longer body is as good
_LONG_BODY = 50.0
_WIDE_BODY = 2.4  # times the blur: as is that of a wide body, by length and half width
_BY_BLUR = 0.6  # of the blur of all of the body, the blur at its edges: ``edge_blur_px``
_LOST = 2.0  # times the median noise: the picture shows something else
_MOST_NOISE = 1.5  # the same for a frame that had no skeleton
_CONTRAST_TOLERANCE = 0.3  # of the usual contrast
_DOUBT = 0.35  # margin of the ends under which both directions are tried
_NEIGHBOUR_FRAMES = 3  # frames for which the margin of the ends counts: one may have no body
_EVIDENCE = 9.0  # squares of the noise: three standard deviations of the grey values
_TRIED_FRAMES = 5  # frames of a stretch between doubts
_LEAST_COVER = 0.03  # of the body's cover: less is ground
_WITHOUT_TIPS = 0.85  # of the error of a medial axis: its tips are measured
_PRIOR_FRAMES = 2.0  # weight of the surroundings of a place, in frames


@dataclass(frozen=True, slots=True)
class FittedFilm:
    """A film's skeletons after the fit."""

    skeletons: tuple[Skeleton, ...]
    expected_px: Floats
    """(T,) expected mean error of a point; NaN without a fit."""
    body: FilmBody | None
    """Body of the film; None without a fit: the bodies are long against their blur, or too few."""


def fit_film(
    skeletons: Sequence[Skeleton],
    crops: Mapping[int, Crop],
    margin: Floats,
    expected_px: Floats,
    *,
    fixed: bool,
) -> FittedFilm:
    """Fit all frames that have a crop.

    Args:
        skeletons: (T) the same end first in all.
        crops: by frame.
        margin: (T,) certainty of the ends: ``identity.margins``.
        expected_px: (T,) error of frames without a fit, NaN where unknown.
        fixed: the ground is still, so its pattern is learnt from all frames.

    """
    good = [k for k in crops if skeletons[k].status is FrameStatus.GOOD]
    if len(good) < 2:
        return FittedFilm(tuple(skeletons), expected_px, None)
    length = float(np.median([skeletons[k].length_px for k in good]))
    radius = float(np.median([np.median(skeletons[k].radius_px) for k in good]))
    space = Workspace.of([crops[k] for k in good[:: max(1, len(good) // 20)]], length)
    views = {k: View.of(crops[k], skeletons[k].points_px, radius, space) for k in good}
    sample = _spread(good, views)
    start = _first_body([views[k] for k in sample], length * space.scale)
    starts = {k: views[k].start for k in good}
    patches = {k: Patch(view.picture, view.use) for k, view in views.items()}
    for turn in range(_PASSES):
        body, frames = film_body([patches[k] for k in sample], [starts[k] for k in sample], start)
        blur = space.blur_px(float(np.exp(body.values[1])))
        wide = float(np.exp(body.values[2:BODY].max())) / space.scale
        if turn == 0 and (
            length > _SHARP * blur or (length > _LONG_BODY * blur and wide > _WIDE_BODY * blur)
        ):
            errors_px = expected_px.copy()
            errors_px[good] = axis_error_px(_BY_BLUR * blur, length)
            return FittedFilm(tuple(skeletons), errors_px, None)
        if len(body.values) == BODY:
            shaded = with_shadow(body, frames, [patches[k] for k in sample])
            body = body if shaded is None else shaded[0]
        fits = {k: fit_frame(patches[k], starts[k], body) for k in starts}
        if turn == 0:
            _reverse_wrong_stretches(fits, patches, body, margin)
            _recover_lost(fits, views, crops, body, radius, space)
            ground = FilmGround.of(views, fits, body) if fixed else None
            for k, fit in fits.items():
                visible = 0.0 if ground is None else ground.visible(views[k], fit, body)
                patches[k] = Patch(views[k].picture - visible, views[k].use)
        start = body.values
        starts = {k: fit.frame for k, fit in fits.items()}
    out = list(skeletons)
    expected = expected_px.copy()
    usual = float(np.median([fit.noise for fit in fits.values()]))
    unlike_px = _UNLIKE_MISFIT * misfit(list(fits.values()), body) * float(np.exp(body.values[1]))
    for k, fit in fits.items():
        if fit.noise > _LOST * usual:
            out[k] = replace(out[k], status=FrameStatus.ROUGH) if k in good else out[k]
            continue
        expected[k] = float(np.hypot(expected_error(fit, body), unlike_px)) / space.scale
        line = space.to_px(curve_of(fit.frame, float(body.values[0])) + views[k].first)
        out[k] = _skeleton(line, body, space)
    return FittedFilm(tuple(out), expected, body)


def with_tip_errors(film: FittedFilm, ends_px: Sequence[Floats], solved: Bools) -> FittedFilm:
    """Return the film with the error of the tips in its expected errors.

    The profile across the body shows where a body ends below the noise or the blur. A shared length
    has the same error in all frames, so the median over the frames counts. It is fitted to both
    tips, so only a body beyond them counts. Without a shared length, the noise of one frame's
    profile is larger than its tips' error.

    Args:
        film: the fitted film, the same end first in all frames.
        ends_px: (T) (2, 3) by ``profile_ends``, NaN where unknown.
        solved: (T,) frames of coils, whose error is known.

    """
    expected = film.expected_px.copy()
    out = film.skeletons
    finite_values = [
        k
        for k, ends in enumerate(ends_px)
        if out[k].status.has_points
        and np.isfinite(expected[k])
        and np.isfinite(ends).all()
        and not solved[k]
    ]
    if not finite_values:
        return film
    beyond = np.array([beyond_tips_px(out[k].points_px, ends_px[k]) for k in finite_values])
    usual = np.median(beyond, axis=0)
    share = 1.0
    if film.body is None:
        share = _WITHOUT_TIPS
        tips = tips_error_px(usual)
    else:
        tips = tips_error_px(np.maximum(usual, 0.0))
    for k in finite_values:
        expected[k] = np.hypot(share * expected[k], tips)
    return replace(film, expected_px=expected)


def expected_error(fit: Fit, body: FilmBody) -> float:
    """Expected error of a point, mean along the body, working pixels."""
    length = float(body.values[0])
    slopes = curve_slopes(fit.frame, length)
    frame_slopes = slopes[:, :, :-1]
    size = 2 + BENDS
    shared = np.einsum("kij,jm->kim", frame_slopes, fit.by_body[:size])
    shared[:, :, 0] += slopes[:, :, -1]
    square = np.einsum("kij,jl,kil->k", frame_slopes, fit.inverse[:size, :size], frame_slopes)
    square += np.einsum("kij,jl,kil->k", shared, body.covariance, shared)
    return float(np.sqrt(np.maximum(square, 0.0) + (_FORM * length) ** 2).mean())


def misfit(fits: Sequence[Fit], body: FilmBody) -> float:
    """Difference of the body's picture from its model, of its contrast: median over the frames.

    A stronger residual on the body and at its edge than around it (a saturated ground, the blocks
    of a JPEG, stains) shifts it alike in all frames, which no covariance shows.
    """
    ribbon = Ribbon(body.grid)
    misfits = []
    for fit in fits:
        cover = ribbon.cover(fit.frame, body.values, fit.residual.shape)
        near = cover > _LEAST_COVER
        is_off_body = (cover < _LEAST_COVER / 3.0) & (fit.residual != 0.0)
        if near.any() and is_off_body.any():
            squares = fit.residual**2
            more = float(squares[near].mean() - squares[is_off_body].mean())
            misfits.append(np.sqrt(max(more, 0.0)) / body.contrast)
    return float(np.median(misfits)) if misfits else 0.0


def _reverse_wrong_stretches(
    fits: dict[int, Fit], patches: Mapping[int, Patch], body: FilmBody, margin: Floats
) -> None:
    """Reverse stretches whose grey values fit the reversed body better."""
    stretches: list[list[int]] = []
    for k in sorted(fits):
        joined = stretches and k - stretches[-1][-1] <= _NEIGHBOUR_FRAMES and margin[k] >= _DOUBT
        if joined:
            stretches[-1].append(k)
        else:
            stretches.append([k])
    if len(stretches) == 1:
        return
    for stretch in stretches:
        worse = []
        for k in stretch[:: max(1, len(stretch) // _TRIED_FRAMES)]:
            other = fit_frame(patches[k], reversed_body(fits[k].frame), body)
            squares = float((other.residual**2).sum() - (fits[k].residual ** 2).sum())
            worse.append(squares / max(fits[k].noise, 1e-9) ** 2)
        if np.sum(worse) < -_EVIDENCE:
            for k in stretch:
                fits[k] = fit_frame(patches[k], reversed_body(fits[k].frame), body)


def _recover_lost(
    fits: dict[int, Fit],
    views: dict[int, View],
    crops: Mapping[int, Crop],
    body: FilmBody,
    radius: float,
    space: Workspace,
) -> None:
    """Fit frames without a skeleton from their neighbour's place; keep equally good ones."""
    usual = float(np.median([fit.noise for fit in fits.values()]))
    lost = sorted(set(crops) - set(fits))
    for step, order in ((-1, lost), (1, lost[::-1])):
        for k in order:
            if k in fits or k + step not in fits:
                continue
            near = fits[k + step].frame
            line = curve_of(near, float(body.values[0]), SEGMENTS) + views[k + step].first
            if not crops[k].shows(space.to_px(line)):
                continue
            view = View.of(crops[k], space.to_px(line), radius, space)
            first = near.copy()
            first[:2] += np.subtract(views[k + step].first, view.first)
            fit = fit_frame(Patch(view.picture, view.use), first, body, rounds=16)
            strange = abs(fit.frame[2 + BENDS] / body.contrast - 1.0) > _CONTRAST_TOLERANCE
            if fit.noise < _MOST_NOISE * usual and not strange:
                fits[k], views[k] = fit, view


def _spread(good: list[int], views: Mapping[int, View]) -> list[int]:
    picture_px = float(np.median([views[k].picture.size for k in good]))
    most = int(np.clip(_SAMPLE_PX / picture_px, _FEWEST_SAMPLES, _MOST_SAMPLES))
    return evenly_chosen(good, most)


def _first_body(views: Sequence[View], length: float) -> Floats:
    wide = np.median([(v.picture * v.use).sum() / v.start[2 + BENDS] / length for v in views])
    half = max(0.5 * float(wide), 0.3)
    return np.concatenate([[length, np.log(1.2)], np.full(len(STATIONS), np.log(half))])


def _skeleton(line: Floats, body: FilmBody, space: Workspace) -> Skeleton:
    place = np.linspace(0.0, 1.0, SEGMENTS + 1)
    radius = np.interp(place, STATIONS, np.exp(body.values[2:BODY])) / space.scale
    fitted = in_equal_chords(line, radius)
    return no_skeleton(FrameStatus.BLOB) if fitted is None else fitted


@dataclass(frozen=True, slots=True)
class FilmGround:
    """Contrast of the bare ground of a film on the working grid."""

    pattern: Floats
    """(H, W) contrast of the bare ground."""
    first: tuple[int, int]
    """Position x, y of the pattern's first pixel."""

    @classmethod
    def of(cls, views: Mapping[int, View], fits: Mapping[int, Fit], body: FilmBody) -> "FilmGround":
        """Compute the mean residual where the body was not, over all fitted frames."""
        firsts = np.array([views[k].first for k in fits])
        lasts = np.array([np.add(views[k].first, views[k].picture.shape[::-1]) for k in fits])
        low, high = firsts.min(axis=0), lasts.max(axis=0)
        total = np.zeros((high[1] - low[1], high[0] - low[0]))
        count = np.zeros_like(total)
        ribbon = Ribbon(body.grid)
        for k, fit in fits.items():
            view = views[k]
            shape = view.picture.shape
            cover = ribbon.cover(fit.frame, body.values, shape)
            shown, _ = ribbon.picture(fit.frame, body.values, shape, shared=False)
            free = (cover < _LEAST_COVER) * view.use
            x, y = np.subtract(view.first, low)
            window = (slice(y, y + shape[0]), slice(x, x + shape[1]))
            total[window] += free * (view.picture - shown)
            count[window] += free
        # a place seen in few frames is weighted less; one never seen gets the value of its
        # surroundings
        around = gaussian_filter(total, 1.0) / (gaussian_filter(count, 1.0) + 1.0)
        pattern = (total + _PRIOR_FRAMES * around) / (count + _PRIOR_FRAMES)
        return cls(np.asarray(pattern), (int(low[0]), int(low[1])))

    def visible(self, view: View, fit: Fit, body: FilmBody) -> Floats:
        """(h, w) the part of the pattern visible outside the body."""
        x, y = np.subtract(view.first, self.first)
        rows, columns = view.picture.shape
        cover = Ribbon(body.grid).cover(fit.frame, body.values, view.picture.shape)
        visible_pattern = self.pattern[y : y + rows, x : x + columns]
        return visible_pattern * np.clip(1.0 - cover, 0.0, 1.0)
