"""The picture that a small, blurred body leaves, and its derivatives by the body.

A ribbon of half width ``h(s)`` along a curve of fixed length is a few rows of Gaussian spots, so
bends, tips and width are blurred as by a camera. Its shadow is a second, wider ribbon that darkens
the ground where the body does not cover it. The model is ``I = A c + K t (1 - c) + b``, with the
covers ``c`` of the body and ``t`` of the shadow.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.images.thin_body_fit import draw_spots, spline_basis

BENDS = 10
"""Coefficients of the tangent angle."""
STATIONS = np.array([0.0, 0.04, 0.1, 0.2, 0.35, 0.5, 0.65, 0.78, 0.88, 0.95, 1.0])
"""Places along the body with a half width; linear between them."""
GROUND = 3
"""Coefficients of the ground: level and slopes."""
FRAME = 2 + BENDS + 1 + GROUND
"""Parameters of a frame: x, y of the middle of the body; its bends; contrast; ground."""
BODY = 2 + len(STATIONS)
"""Parameters of a body without a shadow: length, log of the blur, log half widths."""
SHADOW = 4
"""Further ones of a shadow: contrast, x, y relative to the body, log of its blur."""
_SPACING_WIDTHS = 1.2  # of the blur: distance of spots
_ROWS = 7


@dataclass(frozen=True, slots=True)
class Grid:
    """Places of spots along and across a body, chosen once for a film."""

    along: int
    across: int

    @classmethod
    def of(cls, body: Floats) -> "Grid":
        """Choose a grid as fine as the blur of ``body`` needs."""
        spacing = _SPACING_WIDTHS * float(np.exp(body[1]))
        wide = 2.0 * float(np.exp(body[2:BODY].max()))
        along = int(np.clip(np.ceil(float(body[0]) / spacing), 24, 120))
        return cls(along, int(np.clip(np.ceil(wide / spacing), 1, _ROWS)))


def headings(angle: Floats) -> tuple[Floats, Floats]:
    """(P, 2) unit vectors along tangent angles (P,), and to their left."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c, s], axis=1), np.stack([-s, c], axis=1)


def summed(steps: Floats) -> Floats:
    """(P + 1, ...) places from the head backwards, for steps (P, ...) towards the head."""
    return np.concatenate([np.zeros_like(steps[:1]), -np.cumsum(steps, axis=0)])


def curve_of(frame: Floats, length: float, pieces: int = 400) -> Floats:
    """(pieces + 1, 2) the body's middle line, head first, equal arcs."""
    middle = (np.arange(pieces) + 0.5) / pieces
    angle = spline_basis(middle, BENDS) @ frame[2 : 2 + BENDS]
    line = summed(headings(angle)[0] * (length / pieces))
    return np.asarray(line - 0.5 * (line[1:] + line[:-1]).mean(axis=0) + frame[:2])


def curve_slopes(frame: Floats, length: float, pieces: int = 40) -> Floats:
    """(pieces + 1, 2, 2 + BENDS + 1) derivatives of the line by x, y, bends and the length."""
    middle = (np.arange(pieces) + 0.5) / pieces
    basis = spline_basis(middle, BENDS)
    ahead, aside = headings(basis @ frame[2 : 2 + BENDS])
    turned = aside[:, :, None] * basis[:, None, :]
    line = summed(np.concatenate([turned * (length / pieces), ahead[:, :, None] / pieces], axis=2))
    line = line - 0.5 * (line[1:] + line[:-1]).mean(axis=0)
    place = np.broadcast_to(np.eye(2), (pieces + 1, 2, 2))
    return np.concatenate([place, line], axis=2)


class Ribbon:
    """Pictures of one body; stores the values that depend on the grid alone."""

    def __init__(self, grid: Grid) -> None:
        n, m = grid.along, grid.across
        self.grid = grid
        place = (np.arange(n) + 0.5) / n
        self.basis = spline_basis(place, BENDS)
        self.hats = np.stack([np.interp(place, STATIONS, row) for row in np.eye(len(STATIONS))], 1)
        sums = (np.tri(n, k=-1) + 0.5 * np.eye(n)) / n
        self.sums = sums - sums.mean(axis=0)
        self.side = (2.0 * np.arange(m) + 1.0 - m) / m

    def picture(
        self, frame: Floats, body: Floats, shape: tuple[int, ...], *, shared: bool = True
    ) -> tuple[Floats, Floats]:
        """Picture (h, w), and its slopes (FRAME + body, h, w); without ``shared`` (FRAME, h, w)."""
        places = self._places(frame, body, shared)
        cover, by = _spots(places, float(np.exp(body[1])), shape)
        contrast = float(frame[2 + BENDS])
        if len(body) == BODY:
            shown, by, by_shadow = contrast * cover, contrast * by, by[:0]
        else:
            strength = float(body[BODY])
            places = replace(places, x=places.x + body[BODY + 1], y=places.y + body[BODY + 2])
            shade, shade_by = _spots(places, float(np.exp(body[BODY + 3])), shape)
            bare = np.clip(1.0 - cover, 0.0, 1.0)
            shown = contrast * cover + strength * shade * bare
            by = (contrast - strength * shade) * by
            by[:-1] += strength * bare * shade_by[:-1]
            by_shadow = strength * bare * shade_by[[0, 0, 1, -1]]
            by_shadow[0] = shade * bare
        ground = _ground(shape)
        shown = shown + np.tensordot(frame[-GROUND:], ground, axes=1)
        bends = 2 + BENDS
        slopes = [by[:bends], cover[None], ground]
        if shared:
            slopes += [by[bends : bends + 1], by[-1:], by[bends + 1 : -1], by_shadow]
        return shown, np.concatenate(slopes)

    def cover(self, frame: Floats, body: Floats, shape: tuple[int, ...]) -> Floats:
        """(h, w) part of each pixel that the body covers, without its shadow."""
        places = self._places(frame, body, shared=False)
        return _spots(places, float(np.exp(body[1])), shape, slopes=False)[0]

    def shade(self, frame: Floats, body: Floats, shape: tuple[int, ...]) -> Floats:
        """(h, w) the shadow of strength 1 of a body (BODY + SHADOW,), where it covers all."""
        places = self._places(frame, body, shared=False)
        places = replace(places, x=places.x + body[BODY + 1], y=places.y + body[BODY + 2])
        return _spots(places, float(np.exp(body[BODY + 3])), shape, slopes=False)[0]

    def _places(self, frame: Floats, body: Floats, shared: bool) -> "_Places":
        length = float(body[0])
        angle = self.basis @ frame[2 : 2 + BENDS]
        c, s = np.cos(angle), np.sin(angle)
        width_at = np.exp(body[2:BODY])
        wide = self.hats @ width_at
        n, m = self.grid.along, self.grid.across
        sum_c, sum_s = self.sums @ c, self.sums @ s
        x, y = frame[0] - length * sum_c, frame[1] - length * sum_s
        off = wide[:, None] * self.side  # (n, m)
        count = 2 + BENDS + (1 + len(STATIONS) if shared else 0)
        x_by, y_by, area_by = (np.zeros((count, n, m)) for _ in range(3))
        x_by[0] = y_by[1] = 1.0
        turn_x = (self.sums @ (s[:, None] * self.basis)).T * length
        turn_y = (self.sums @ (c[:, None] * self.basis)).T * -length
        bends = slice(2, 2 + BENDS)
        x_by[bends] = turn_x[..., None] - (c * self.basis.T)[..., None] * off
        y_by[bends] = turn_y[..., None] - (s * self.basis.T)[..., None] * off
        area = 2.0 * wide * length / (n * m)
        if shared:
            k = 2 + BENDS
            x_by[k], y_by[k] = -sum_c[:, None], -sum_s[:, None]
            area_by[k] = (area / length)[:, None]
            slim = (self.hats * width_at).T  # of the half width by the logs
            x_by[k + 1 :] = -(s * slim)[..., None] * self.side
            y_by[k + 1 :] = (c * slim)[..., None] * self.side
            area_by[k + 1 :] = (2.0 * length / (n * m) * slim)[..., None]
        return _Places(
            x[:, None] - off * s[:, None],
            y[:, None] + off * c[:, None],
            np.broadcast_to(area[:, None], (n, m)),
            x_by,
            y_by,
            area_by,
        )


@dataclass(frozen=True, slots=True)
class _Places:
    """Spots along (n) and across (m) a body, and their slopes by P parameters."""

    x: Floats
    y: Floats
    area: Floats
    x_by: Floats
    y_by: Floats
    area_by: Floats


def _spots(
    spots: _Places, spot: float, shape: tuple[int, ...], *, slopes: bool = True
) -> tuple[Floats, Floats]:
    """Sum of Gaussian spots (h, w); its slopes (P + 1, h, w), the last by the log of ``spot``."""
    count = len(spots.x_by)
    cover = np.zeros(shape)
    by = np.zeros((count + 1 if slopes else 0, *shape))
    x, y, area = (v.flatten() for v in (spots.x, spots.y, spots.area))
    x_by, y_by, area_by = (v.reshape(count, -1) for v in (spots.x_by, spots.y_by, spots.area_by))
    draw_spots(x, y, area, x_by, y_by, area_by, spot, cover, by)
    return cover, by


@lru_cache(maxsize=64)
def _ground(shape: tuple[int, ...]) -> Floats:
    """(GROUND, h, w) a level and two slopes."""
    v, u = np.meshgrid(*(np.linspace(-1.0, 1.0, side) for side in shape), indexing="ij")
    return np.stack([np.ones(shape), u, v])


def gram(rows: Floats) -> Floats:
    """(K, K) products of ``rows`` (K, pixels) in blocks of pixels: no thread starts."""
    block = max(1, 200_000 // len(rows) ** 2)
    short = -rows.shape[1] % block
    parts = np.pad(rows, ((0, 0), (0, short))).reshape(len(rows), -1, block).transpose(1, 0, 2)
    return np.asarray((parts @ parts.transpose(0, 2, 1)).sum(axis=0))
