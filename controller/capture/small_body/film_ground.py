"""The pattern of the ground where the body was not: what the background does not know of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.small_body.film_body import FilmBody, Fit
from snakewalk.controller.capture.small_body.film_view import View
from snakewalk.controller.capture.small_body.ribbon import Ribbon

_FREE = 0.03  # of the body's cover: less than that is ground
_BELIEVED = 2.0  # frames that must have seen a place before it is half believed


@dataclass(frozen=True, slots=True)
class FilmGround:
    """Contrast of the bare ground of a film on the working grid."""

    pattern: Floats
    """(H, W)"""
    first: tuple[int, int]
    """x, y of its first pixel."""

    @classmethod
    def of(cls, views: Mapping[int, View], fits: Mapping[int, Fit], body: FilmBody) -> "FilmGround":
        """Take the mean of what is left where the body was not, of all frames that have a fit."""
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
            free = (cover < _FREE) * view.use
            x, y = np.subtract(view.first, low)
            window = (slice(y, y + shape[0]), slice(x, x + shape[1]))
            total[window] += free * (view.picture - shown)
            count[window] += free
        # seldom seen: less believed; never seen: what is around it
        around = gaussian_filter(total, 1.0) / (gaussian_filter(count, 1.0) + 1.0)
        pattern = (total + _BELIEVED * around) / (count + _BELIEVED)
        return cls(np.asarray(pattern), (int(low[0]), int(low[1])))

    def beside(self, view: View, fit: Fit, body: FilmBody) -> Floats:
        """(h, w) what of the pattern a frame shows beside the body."""
        x, y = np.subtract(view.first, self.first)
        rows, columns = view.picture.shape
        cover = Ribbon(body.grid).cover(fit.frame, body.values, view.picture.shape)
        seen = self.pattern[y : y + rows, x : x + columns]
        return np.asarray(seen * np.clip(1.0 - cover, 0.0, 1.0))
