"""A drawn larva: two dark eyes, a trunk, and a tail fainter than the noise of a pixel."""

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image

GROUND = 200.0
EYES = np.array([[40.0, 94.0], [40.0, 106.0]])
EYE = np.array([3.0, 0.0])
NOISE = 10.0


def _drawn(points: Floats, width_px: float) -> Floats:
    """(200, 240) coverage of a line."""
    fine = np.zeros((800, 960), dtype=np.uint8)
    line = np.rint((points + 0.5) * 4.0 - 0.5).astype(np.int32)
    cv2.polylines(fine, [line], False, 255, round(4.0 * width_px))
    return np.asarray(cv2.resize(fine, (240, 200), interpolation=cv2.INTER_AREA) / 255.0)


def tail_line(bend: float) -> Floats:
    """(80, 2) from the trunk at x = 70, y = 100; ``bend`` in rad over its length."""
    angle = bend * np.linspace(0.0, 1.0, 80) ** 2
    steps = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(np.array([70.0, 100.0]) + np.cumsum(steps, axis=0))


def larva(bend: float, seed: int = 0, tail_levels: float = 32.0) -> Image:
    """(200, 240) picture of a larva; ``bend`` of its tail in rad."""
    image = np.full((200, 240), GROUND)
    for eye in EYES:
        image -= 130.0 * _drawn(np.vstack([eye - EYE, eye + EYE]), 9.0)
    image -= 110.0 * _drawn(np.array([[42.0, 100.0], [72.0, 100.0]]), 8.0)
    image -= tail_levels * _drawn(tail_line(bend), 3.0)
    image = cv2.GaussianBlur(image, (0, 0), 0.8)
    image += np.random.default_rng(seed).normal(0.0, NOISE, image.shape)
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)
