"""The mean picture of a resting animal: its own frame and those before and after it."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, repeat

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage, Singles
from snakewalk.controller.images.silhouette import Silhouette

Neighbours = Iterable[Iterable[DeepImage]]
"""Frames before a frame, and those after it; the nearest first."""

_EACH_SIDE = 4  # frames
_RESTING = 0.1  # of the contrast: root mean square of the change of a resting body (ours)
_NEAR_PX = 5  # side of a square around each pixel of the body
_BLUR_PX = 1.0  # averages the noise of single pixels


def with_neighbours(
    frames: Callable[[int], Iterable[DeepImage]], first: int = 0
) -> Iterator[tuple[DeepImage, Neighbours]]:
    """Yield each frame from number ``first`` on with its neighbours of the same size.

    ``frames`` returns the frames from a number on.
    """
    size = 2 * _EACH_SIDE + 1
    window: deque[DeepImage | None] = deque([None] * size, size)
    start = max(0, first - _EACH_SIDE)
    ahead = chain(frames(start), repeat(None, _EACH_SIDE))
    for number, newest in enumerate(ahead, start=start - _EACH_SIDE):
        window.append(newest)
        frame = window[_EACH_SIDE]
        if frame is not None and number >= first:
            near = list(window)
            sides = near[_EACH_SIDE - 1 :: -1], near[_EACH_SIDE + 1 :]
            yield (
                frame,
                [
                    [other for other in side if other is not None and other.shape == frame.shape]
                    for side in sides
                ],
            )


def resting_mean(
    image: DeepImage, neighbours: Neighbours, body: Silhouette, window: tuple[slice, slice]
) -> Singles | None:
    """Return a window of the mean picture; None if the animal moves before and after the frame.

    A neighbour counts while the body is the same in it and in all frames between.

    Args:
        image: (H, W[, C]) the frame.
        neighbours: frames of the same size, the animal alone in them.
        body: silhouette of the frame.
        window: rows and columns of the image.

    """
    box = body.window()
    is_near = cv2.dilate(body.mask.astype(np.uint8), np.ones((_NEAR_PX, _NEAR_PX), np.uint8)) > 0
    alike = [image[window]]
    for side in neighbours:
        for other in side:
            change = cv2.subtract(other[box], image[box], dtype=cv2.CV_32F)
            change = cv2.GaussianBlur(change, (0, 0), _BLUR_PX)[is_near]
            change = change if change.ndim == 1 else change.mean(axis=1)
            if np.sqrt(np.mean(change**2)) > _RESTING * 2.0 * body.threshold:
                break
            alike.append(other[window])
    return np.mean(alike, axis=0, dtype=np.float32) if len(alike) > 1 else None
