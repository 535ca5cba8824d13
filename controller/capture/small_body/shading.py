"""Whether the body throws a shadow beside itself, and which: the same in every frame of a film."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.small_body.film_body import FilmBody, Patch, film_body
from snakewalk.controller.capture.small_body.ribbon import BODY, Ribbon, gram

_WAYS = 8
_AWAY = (0.5, 1.0, 1.8, 3.0)  # of the greatest half width
_LOOKED_AT = 12  # frames
_WORTH = 30.0  # by how much the fit must gain, in squares of the noise


def with_shadow(
    body: FilmBody, frames: Sequence[Floats], patches: Sequence[Patch]
) -> tuple[FilmBody, list[Floats]] | None:
    """Fit again with a shadow where what is left looks like one; None where it does not."""
    best = _direction(body, frames, patches)
    if best is None:
        return None
    start = np.concatenate([body.values, best])
    return film_body(patches, frames, start)


def _direction(body: FilmBody, frames: Sequence[Floats], patches: Sequence[Patch]) -> Floats | None:
    ribbon = Ribbon(body.grid)
    spot = float(np.exp(body.values[1]))
    wide = float(np.exp(body.values[2:BODY].max()))
    soft = float(np.log(np.hypot(spot, 0.7 + 0.3 * wide)))
    tried = [
        np.array([1.0, away * wide * np.cos(way), away * wide * np.sin(way), soft])
        for away in _AWAY
        for way in np.linspace(0.0, 2.0 * np.pi, _WAYS, endpoint=False)
    ]
    gain, norm, squares, count = np.zeros(len(tried)), np.zeros(len(tried)), 0.0, 0.0
    every = max(1, len(frames) // _LOOKED_AT)
    for frame, patch in zip(frames[::every], patches[::every], strict=True):
        shape = patch.picture.shape
        shown, slopes = ribbon.picture(frame, body.values, shape)
        bare = np.clip(1.0 - ribbon.cover(frame, body.values, shape), 0.0, 1.0)
        shades = [
            bare * ribbon.shade(frame, np.concatenate([body.values, one]), shape) for one in tried
        ]
        rows = np.concatenate([slopes, (patch.picture - shown)[None], shades]) * patch.use
        products = gram(rows.reshape(len(rows), -1))
        known = len(slopes)
        # what the body itself could explain is taken away from the rest and from the shades
        own = products[:known, :known] + 1e-9 * np.trace(products[:known, :known]) * np.eye(known)
        others = products[known:, known:] - products[known:, :known] @ np.linalg.solve(
            own, products[:known, known:]
        )
        squares, count = squares + float(others[0, 0]), count + float(patch.use.sum())
        gain += others[0, 1:]
        norm += np.diag(others)[1:]
    strength = gain / np.maximum(norm, 1e-9)
    worth = gain * strength / max(squares / count, 1e-9)
    best = int(np.argmax(worth))
    if worth[best] < _WORTH:
        return None
    return np.concatenate([[strength[best]], tried[best][1:]])
