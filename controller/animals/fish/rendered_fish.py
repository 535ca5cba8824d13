"""Rendered views of a fish whose midline is known: marks, shadow, uneven light, blur and noise.

Drawn by distance to the midline, not by ``raster``, so that matching is not tested on its own
drawing.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, shift
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats, Image

_FINE_POINTS = 240  # places along the body at which it is drawn


@dataclass(frozen=True, slots=True)
class FilmConditions:
    """How a scene is lit and filmed; grey values 0 to 255."""

    ground: float = 175.0
    fish: float = 70.0
    light: float = 25.0
    """Additional brightness of one corner of the tank over its middle."""
    marks: float = 10.0
    """Standard deviation of the pattern of the ground and of the back."""
    shadow: float = 18.0
    blur_px: float = 0.8
    noise: float = 4.0


class FishScene:
    """One fixed camera: a ground and what moves over it."""

    def __init__(
        self, rows: int, columns: int, seed: int = 0, conditions: FilmConditions | None = None
    ) -> None:
        """Lay the ground.

        Args:
            rows: height of the frame, px.
            columns: its width, px.
            seed: of pattern and noise.
            conditions: light and camera.

        """
        self.conditions = conditions or FilmConditions()
        self._rng = np.random.default_rng(seed)
        y, x = np.mgrid[0:rows, 0:columns]
        light = self.conditions.light * (x / columns + y / rows - 1.0)
        pattern = gaussian_filter(self._rng.normal(size=(rows, columns)), 2.0)
        self._ground = (
            self.conditions.ground + light + self.conditions.marks * pattern / pattern.std()
        )
        self._back = gaussian_filter(self._rng.normal(size=(64, _FINE_POINTS)), 3.0)
        self._back *= self.conditions.marks / self._back.std()

    def background(self) -> Image:
        """(H, W) the empty scene, filmed once."""
        return self._film(self._ground)

    def top(self, midline_px: Floats, half_width_px: Floats, fin_px: float = 0.0) -> Image:
        """(H, W) the fish from above: midline (P, 2), x right and y up; half widths (S,).

        ``fin_px`` is the length of the pectoral fins, which lie flat behind the head.
        """
        points, width = _fine_midline(midline_px, half_width_px)
        image = self._ground.copy()
        rows, columns = _box(image.shape, points, width.max() + 3.0 + fin_px)
        y, x = np.mgrid[rows, columns]
        pixels = np.column_stack([x.ravel(), -y.ravel()]).astype(float)
        far, near = cKDTree(points).query(pixels)
        covered = np.clip(width[near] - far + 0.5, 0.0, 1.0).reshape(x.shape)
        for root, tip in _fin_ends(points, width, fin_px):
            covered = np.maximum(covered, _blade(pixels, root, tip).reshape(x.shape))
        across = np.clip(far / np.maximum(width[near], 1e-9) * 31.0, 0, 63).astype(int)
        grey = self.conditions.fish + self._back[across, near].reshape(x.shape)
        return self._composite(image, rows, columns, covered, grey)

    def side(self, midline_px: Floats, half_wide_px: Floats, half_high_px: Floats) -> Image:
        """(H, W) the fish from the side: spine (P, 2) in x and height; half axes (P,) of sections.

        Each section appears as an ellipse, ``half_wide_px`` along x.
        """
        points, wide = _fine_midline(midline_px, half_wide_px)
        spacing_px = np.hypot(*np.diff(points[::2], axis=0).T).max()
        wide = np.maximum(wide, max(0.7, 1.5 * float(spacing_px)))  # no gaps between sections
        high = _fine_midline(midline_px, half_high_px)[1]
        image = self._ground.copy()
        rows, columns = _box(image.shape, points, max(high.max(), wide.max()) + 3.0)
        y, x = np.mgrid[rows, columns]
        inside = np.full(x.shape, -np.inf)
        for (cx, cz), a, b in zip(points[::2], wide[::2], high[::2], strict=True):
            reach = np.sqrt(((x - cx) / a) ** 2 + ((-y - cz) / b) ** 2)
            slope = np.sqrt((x - cx) ** 2 / a**4 + (-y - cz) ** 2 / b**4)
            inside = np.maximum(inside, reach * (1.0 - reach) / np.maximum(slope, 1e-9))
        covered = np.clip(inside + 0.5, 0.0, 1.0)
        return self._composite(
            image, rows, columns, covered, np.full(x.shape, self.conditions.fish)
        )

    def _composite(
        self, image: Floats, rows: slice, columns: slice, covered: Floats, grey: Floats
    ) -> Image:
        full_cover = np.zeros_like(image)
        full_cover[rows, columns] = covered
        if self.conditions.shadow:
            soft = shift(gaussian_filter(full_cover, 6.0), (7.0, 5.0), order=1)
            image = image - self.conditions.shadow * soft
        image[rows, columns] += covered * (grey - image[rows, columns])
        return self._film(image)

    def _film(self, image: Floats) -> Image:
        noisy = (
            gaussian_filter(image, self.conditions.blur_px) if self.conditions.blur_px else image
        )
        noisy = noisy + self._rng.normal(size=image.shape) * self.conditions.noise
        return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _fin_ends(points: Floats, width: Floats, length: float) -> list[tuple[Floats, Floats]]:
    """Root and tip of both pectoral fins, outwards and back from behind the head; none of 0."""
    k = round(0.26 * (len(points) - 1))
    ahead = points[k - 1] - points[k + 1]
    ahead = ahead / np.hypot(*ahead)
    ends = []
    for side in (np.array([-ahead[1], ahead[0]]), np.array([ahead[1], -ahead[0]])):
        root = points[k] + 0.9 * width[k] * side
        ends.append((root, root + length * (0.8 * side - 0.6 * ahead)))
    return ends if length > 0.0 else []


def _blade(places: Floats, root: Floats, tip: Floats) -> Floats:
    """(n,) how much of each pixel a fin covers, which widens a little to its round tip."""
    length = float(np.hypot(*(tip - root)))
    direction = (tip - root) / length
    away = places - root
    on = np.clip(away @ direction, 0.0, length)
    gap = np.hypot(*(away - on[:, None] * direction).T)
    return np.asarray(np.clip(length * (0.14 + 0.08 * on / length) - gap + 0.5, 0.0, 1.0))


def _fine_midline(points: Floats, size: Floats) -> tuple[Floats, Floats]:
    place = np.linspace(0.0, 1.0, _FINE_POINTS)
    stations = np.linspace(0.0, 1.0, len(points))
    fine = np.column_stack([np.interp(place, stations, points[:, k]) for k in range(2)])
    return fine, np.interp(place, np.linspace(0.0, 1.0, len(size)), size)


def _box(shape: tuple[int, ...], points: Floats, margin: float) -> tuple[slice, slice]:
    low = np.floor(points.min(axis=0) - margin).astype(int)
    high = np.ceil(points.max(axis=0) + margin).astype(int)
    rows = slice(max(-int(high[1]), 0), max(min(-int(low[1]) + 1, shape[0]), 1))
    columns = slice(max(int(low[0]), 0), max(min(int(high[0]) + 1, shape[1]), 1))
    return rows, columns
