"""One body for a whole film: length, widths, blur and shadow are the same in every frame.

They are fitted together with the bends of a sample of frames by damped least squares on the grey
values. The frames' own parameters are eliminated, so the cost is linear in the frames. With the
body known, a frame fixes its place far better than its two blurred ends do.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.small_body.ribbon import (
    BENDS,
    BODY,
    FRAME,
    SHADOW,
    STATIONS,
    Grid,
    Ribbon,
    gram,
)

_ROUNDS = 14
_LEAST_GAIN = 1e-4  # of the cost
_LEARNING = 4  # rounds in which the noise is estimated
_LEAST_NOISE2 = 1.0
_LEVEL_SIGMA = 0.35  # prior standard deviation of the log of the mean width
_EVEN_SIGMA = 0.3  # of second differences of the logs of the widths
_TIP = (-0.55, 0.3)  # of the log of the width at a tip against the next: a round cap
_BLUR = 0.5  # of the log of the blur
_STIFF = 1.0  # rad, of second differences of the bends
_CONTRAST = 0.15  # of the contrast of one frame against the film's
_DIRECTIONS = 8
_STARTING_SHIFTS = (0.5, 1.0, 1.8, 3.0)  # of the greatest half width
_FITTED_FRAMES = 12  # frames
_WORTH = 30.0  # least gain of the fit, in squares of the noise
_UNSEEN = 1e-6  # of a parameter that no pixel shows: an error of 1,000


@dataclass(frozen=True, slots=True)
class Patch:
    """The part of a frame that shows the body."""

    picture: Floats
    """(h, w) signed contrast, above 0 where the body is."""
    use: Floats
    """(h, w) 1 where the picture counts, else 0."""


@dataclass(frozen=True, slots=True)
class Fit:
    """One frame fitted with a known body."""

    frame: Floats
    """(FRAME,) parameters of the body in the frame."""
    noise: float
    """Standard deviation of the residual, raised where its neighbouring pixels correlate."""
    inverse: Floats
    """(FRAME, FRAME) covariance of the parameters."""
    by_body: Floats
    """(FRAME, body) derivatives of the parameters by those of the body."""
    residual: Floats
    """(h, w) picture minus model."""


@dataclass(frozen=True, slots=True)
class FilmBody:
    """Parameters that all frames share."""

    values: Floats
    """Length, log of the blur, log half widths; with a shadow its four."""
    covariance: Floats
    grid: Grid
    contrast: float
    """Usual contrast of a frame."""


def _frame_prior(contrast: float) -> tuple[Floats, Floats]:
    """Prior rows (R, FRAME) and their target values, in their standard deviations."""
    bend = np.zeros((BENDS - 2, FRAME))
    bend[:, 2 : 2 + BENDS] = np.diff(np.eye(BENDS), 2, axis=0) / _STIFF
    level = np.zeros((3, FRAME))
    level[0, 2 + BENDS] = 1.0 / (_CONTRAST * contrast)
    level[1, -2] = level[2, -1] = 1.0 / (0.1 * contrast)
    target = np.zeros(BENDS + 1)
    target[BENDS - 2] = 1.0 / _CONTRAST
    return np.vstack([bend, level]), target


def _body_prior(start: Floats, size: int) -> tuple[Floats, Floats]:
    stations = len(STATIONS)
    even = np.zeros((stations - 4, size))
    even[:, 2:BODY] = np.diff(np.eye(stations), 2, axis=0)[1:-1] / _EVEN_SIGMA
    rows = np.zeros((4, size))
    rows[0, 2:BODY] = 1.0 / stations / _LEVEL_SIGMA
    rows[1, 1] = 1.0 / _BLUR
    rows[2, [2, 3]] = rows[3, [BODY - 1, BODY - 2]] = np.array([1.0, -1.0]) / _TIP[1]
    target = np.concatenate(
        [
            np.zeros(stations - 4),
            [start[2:BODY].mean() / _LEVEL_SIGMA, start[1] / _BLUR],
            [_TIP[0] / _TIP[1]] * 2,
        ]
    )
    if size > BODY:
        shade = np.zeros((SHADOW, size))
        shade[0, BODY] = 0.01
        shade[[1, 2], [BODY + 1, BODY + 2]] = 0.2
        shade[3, BODY + 3] = 2.0
        rows = np.vstack([rows, shade])
        target = np.concatenate([target, [0.0, 0.0, 0.0, 2.0 * (start[1] + 0.3)]])
    return np.vstack([even, rows]), target


def fit_frame(patch: Patch, start: Floats, body: FilmBody, rounds: int = 8) -> Fit:
    """Fit one frame; damped least squares from ``start`` (FRAME,)."""
    ribbon = Ribbon(body.grid)
    prior, target = _frame_prior(body.contrast)
    shape = patch.picture.shape
    use = patch.use.ravel()
    used_px = max(float(use.sum()), 1.0)
    noise2 = 0.0
    values = start
    kept = start
    best = np.inf
    damp = 1e-3
    normal = np.eye(FRAME)
    push = np.zeros(FRAME)
    for turn in range(rounds):
        shown, slopes = ribbon.picture(values, body.values, shape, shared=False)
        rest = (patch.picture - shown).ravel() * use
        squares = float(rest @ rest)
        soft = target - prior @ values
        if turn == 0:
            noise2 = max(squares / used_px, _LEAST_NOISE2)
        cost = squares / noise2 + float(soft @ soft)
        if cost < best:
            done = best - cost < _LEAST_GAIN * cost
            if turn < _LEARNING:  # the residual is noise only near the end
                noise2 = max(squares / used_px, _LEAST_NOISE2)
                cost = squares / noise2 + float(soft @ soft)
            best = cost
            kept = values
            damp = 0.3 * damp
            products = gram(np.vstack([slopes.reshape(FRAME, -1) * use, rest])) / noise2
            normal = _solvable(products[:-1, :-1] + prior.T @ prior)
            push = products[:-1, -1] + prior.T @ soft
            if done:
                break
        else:
            damp *= 10.0
        values = kept + np.linalg.solve(normal + damp * np.diag(np.diag(normal)), push)
    shown, slopes = ribbon.picture(kept, body.values, shape)
    residual = (patch.picture - shown) * patch.use
    raised = _correlation(residual, float(np.exp(body.values[1])))
    products = gram(slopes.reshape(len(slopes), -1) * use) / noise2
    inverse = np.linalg.inv(_solvable(products[:FRAME, :FRAME] + prior.T @ prior))
    moved = -inverse @ products[:FRAME, FRAME:]
    return Fit(kept, float(np.sqrt(noise2 * raised)), np.asarray(inverse * raised), moved, residual)


def _correlation(residual: Floats, spot: float) -> float:
    """Variance of the blurred residual, divided by equally strong white noise's; at least 1."""
    # of white noise a Gaussian leaves 1 / (4 pi spot^2); less blur than that of a pixel does not
    # count
    spot = max(spot, 0.8)
    smooth = gaussian_filter(residual, spot, mode="constant")
    white = float((residual**2).mean()) / (4.0 * np.pi * spot * spot)
    return max(1.0, float((smooth**2).mean()) / max(white, 1e-12))


def film_body(
    patches: Sequence[Patch], starts: Sequence[Floats], start: Floats
) -> tuple[FilmBody, list[Floats]]:
    """Fit the shared body and every frame of a sample.

    Args:
        patches: the frames of the sample.
        starts: (FRAME,) of each.
        start: (BODY,) or, with a shadow, (BODY + SHADOW,).

    """
    size = len(start)
    ribbon = Ribbon(Grid.of(start))
    body_rows, body_target = _body_prior(start, size)
    body = kept_body = start
    frames = kept = [frame.copy() for frame in starts]
    contrast = float(np.median([frame[2 + BENDS] for frame in starts]))
    best = np.inf
    damp = 1e-2
    noise2 = 0.0
    blocks: list[tuple[Floats, Floats, Floats]] = []
    hss = np.eye(size)
    gs = np.zeros(size)
    raised = 1.0
    used_px = sum(float(patch.use.sum()) for patch in patches)
    for turn in range(_ROUNDS):
        prior, target = _frame_prior(contrast)
        rows = [
            _rows(ribbon, frame, body, patch) for frame, patch in zip(frames, patches, strict=True)
        ]
        squares = sum(float(row[-1] @ row[-1]) for row in rows)
        if turn == 0:
            noise2 = max(squares / used_px, _LEAST_NOISE2)
        soft_body = body_target - body_rows @ body
        softs = [target - prior @ frame for frame in frames]
        softness = float(soft_body @ soft_body) + sum(float(v @ v) for v in softs)
        cost = squares / noise2 + softness
        if cost < best:
            done = best - cost < _LEAST_GAIN * cost and turn > _LEARNING
            if turn < 2 * _LEARNING:
                noise2 = max(squares / used_px, _LEAST_NOISE2)
                cost = squares / noise2 + softness
            best = cost
            kept_body = body
            kept = frames
            damp = 0.3 * damp
            hss = body_rows.T @ body_rows
            gs = body_rows.T @ soft_body
            blocks = []
            for row, soft in zip(rows, softs, strict=True):
                products = gram(row) / noise2
                frame_block = _solvable(products[:FRAME, :FRAME] + prior.T @ prior)
                push = products[:FRAME, -1] + prior.T @ soft
                blocks.append((frame_block, products[:FRAME, FRAME:-1], push))
                hss = hss + products[FRAME:-1, FRAME:-1]
                gs = gs + products[FRAME:-1, -1]
            spot = float(np.exp(body[1]))
            noises = [
                _correlation(row[-1].reshape(patch.picture.shape), spot)
                for row, patch in zip(rows, patches, strict=True)
            ]
            raised = float(np.mean(noises))
            if done:
                break
            contrast = float(np.median([frame[2 + BENDS] for frame in frames]))
        else:
            damp *= 10.0
        step, steps = _eliminated_step(hss, gs, blocks, damp)
        body = kept_body + np.clip(step, -0.7, 0.7) * np.where(
            np.arange(size) == 0, max(1.0, 0.05 * start[0]), 1.0
        )
        frames = [frame + move for frame, move in zip(kept, steps, strict=True)]
    reduced = hss.copy()
    for hff, hfs, _ in blocks:
        reduced = reduced - hfs.T @ np.linalg.solve(hff, hfs)
    covariance = np.asarray(np.linalg.inv(reduced) * raised, dtype=float)
    contrast = float(np.median([frame[2 + BENDS] for frame in kept]))
    return FilmBody(kept_body, covariance, ribbon.grid, contrast), kept


def _solvable(normal: Floats) -> Floats:
    """Normal equations that can be solved even if no pixel shows a parameter.

    A body that left its patch moves nothing in it: it stays, with an error of 1,000.
    """
    return np.asarray(normal + np.diag(np.where(np.diag(normal) < _UNSEEN, _UNSEEN, 0.0)))


def _rows(ribbon: Ribbon, frame: Floats, body: Floats, patch: Patch) -> Floats:
    """(FRAME + body + 1, pixels) slopes, and the residual last."""
    shown, slopes = ribbon.picture(frame, body, patch.picture.shape)
    rows = np.concatenate([slopes, (patch.picture - shown)[None]]) * patch.use
    return rows.reshape(len(rows), -1)


def _eliminated_step(
    hss: Floats, gs: Floats, blocks: list[tuple[Floats, Floats, Floats]], damp: float
) -> tuple[Floats, list[Floats]]:
    """Step of the shared and of each frame's parameters."""
    normal = hss + damp * np.diag(np.diag(hss))
    push = gs.copy()
    solved = []
    for hff, hfs, gf in blocks:
        factor = cho_factor(hff + damp * np.diag(np.diag(hff)))
        by = cho_solve(factor, hfs)
        solved_frame = cho_solve(factor, gf)
        normal = normal - hfs.T @ by
        push = push - hfs.T @ solved_frame
        solved.append((by, solved_frame))
    step = np.asarray(np.linalg.solve(normal, push), dtype=float)
    return step, [frame_step - by @ step for by, frame_step in solved]


def with_shadow(
    body: FilmBody, frames: Sequence[Floats], patches: Sequence[Patch]
) -> tuple[FilmBody, list[Floats]] | None:
    """Fit again with a shadow if the residual shows one; else None."""
    best = _shadow(body, frames, patches)
    if best is None:
        return None
    start = np.concatenate([body.values, best])
    return film_body(patches, frames, start)


def _shadow(body: FilmBody, frames: Sequence[Floats], patches: Sequence[Patch]) -> Floats | None:
    ribbon = Ribbon(body.grid)
    spot = float(np.exp(body.values[1]))
    wide = float(np.exp(body.values[2:BODY].max()))
    soft = float(np.log(np.hypot(spot, 0.7 + 0.3 * wide)))
    tried = [
        np.array([1.0, away * wide * np.cos(angle), away * wide * np.sin(angle), soft])
        for away in _STARTING_SHIFTS
        for angle in np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    ]
    gain = np.zeros(len(tried))
    norm = np.zeros(len(tried))
    squares = 0.0
    count = 0.0
    every = max(1, len(frames) // _FITTED_FRAMES)
    for frame, patch in zip(frames[::every], patches[::every], strict=True):
        shape = patch.picture.shape
        shown, slopes = ribbon.picture(frame, body.values, shape)
        bare = np.clip(1.0 - ribbon.cover(frame, body.values, shape), 0.0, 1.0)
        shades = [
            bare * ribbon.shade(frame, np.concatenate([body.values, body_values]), shape)
            for body_values in tried
        ]
        rows = np.concatenate([slopes, (patch.picture - shown)[None], shades]) * patch.use
        products = gram(rows.reshape(len(rows), -1))
        body_count = len(slopes)
        # subtract the part that the body could explain from the rest and from the shades
        body_products = products[:body_count, :body_count] + 1e-9 * np.trace(
            products[:body_count, :body_count]
        ) * np.eye(body_count)
        others = products[body_count:, body_count:] - products[
            body_count:, :body_count
        ] @ np.linalg.solve(body_products, products[:body_count, body_count:])
        squares = squares + float(others[0, 0])
        count = count + float(patch.use.sum())
        gain += others[0, 1:]
        norm += np.diag(others)[1:]
    strength = gain / np.maximum(norm, 1e-9)
    worth = gain * strength / max(squares / count, 1e-9)
    best = int(np.argmax(worth))
    if worth[best] < _WORTH:
        return None
    return np.concatenate([[strength[best]], tried[best][1:]])
