"""Films in memory of a fish whose every angle is known."""

import numpy as np
from numpy.typing import NDArray

from snakewalk.controller.animals.fish.matching import SilhouetteFrame
from snakewalk.controller.animals.fish.model import FishModel, fish_model
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.animals.fish.rendered_fish import FilmConditions, FishScene
from snakewalk.controller.animals.fish.silhouettes import silhouette_frame
from snakewalk.controller.images.silhouette import Polarity

Floats = NDArray[np.float64]


def film(
    truth: Postures,
    frames: range,
    length_px: float = 90.0,
    build: str = "carp",
    conditions: FilmConditions | None = None,
    seed: int = 0,
    fins: float = 0.0,
) -> tuple[list[SilhouetteFrame], FishModel, Floats]:
    """Frames from above, the model that was drawn, and the base (n, 2) in pixels."""
    model = fish_model(build, length_px)
    spine = truth.points()[list(frames)] * length_px
    low, high = spine.min(axis=(0, 1)), spine.max(axis=(0, 1))
    columns, rows = (int(np.ceil(side)) for side in high - low + 0.6 * length_px)
    shift = np.array([columns, -rows]) / 2 - 0.5 * (low + high)
    scene = FishScene(rows, columns, seed, conditions)
    empty = scene.background()
    half = model.half_width * length_px
    images = [scene.top(body + shift, half, fins * length_px) for body in spine]
    top = [silhouette_frame(image, empty, Polarity.DARK) for image in images]
    return top, model, truth.base[list(frames)] * length_px + shift


def side_film(
    truth: Postures, frames: range, model: FishModel, base_px: Floats, columns: int
) -> list[SilhouetteFrame]:
    """The same moments from the side, at the same scale, column by column."""
    rows = round(2.2 * model.length_px)
    scene = FishScene(rows, columns, 7)
    empty = scene.background()
    assert truth.height is not None
    assert truth.pitch_rad is not None
    found = []
    for k, base in zip(frames, base_px, strict=True):
        height = truth.height[k] * model.length_px - 0.5 * rows
        line = model.midline(
            np.array([*base, height]), truth.head_rad[k], truth.angles_rad[k], truth.pitch_rad[k]
        )
        step = np.gradient(line, axis=0)
        wide = np.abs(step[:, 1]) / np.hypot(step[:, 0], step[:, 1])
        wide *= model.half_width * model.length_px
        image = scene.side(line[:, [0, 2]], wide, model.half_height * model.length_px)
        found.append(silhouette_frame(image, empty, Polarity.DARK))
    return found
