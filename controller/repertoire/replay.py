"""Kinematic replay of segments from any pose, and bridges between them ([YT] 4.1 and 4.2).

The replay is exact; Eq. 10-12 are corrected (``Segment``). The number of frames of a bridge depends
on the distance that the tail has to move.
"""

import math
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.segment import Segment


@dataclass(frozen=True, slots=True)
class Replayed:
    """A body's motion, frame by frame; the start is not among the frames."""

    rotation: Floats
    """(T, 3, 3) of the body frame in the world."""
    origin_m: Floats
    """(T, 3) origins of the body, m."""
    link_m: Floats
    """(T, L, 3) centres of the links in the world."""

    @property
    def end(self) -> Frame:
        """The last body frame."""
        return Frame(rotation=self.rotation[-1], origin_m=self.origin_m[-1])


def replay(segment: Segment, start: Frame, scale: float = 1.0) -> Replayed:
    """Play one cycle from ``start``.

    ``scale`` is the ratio of this body's size to the recorded one's. It scales the shape (Eq. 12)
    and the travel too: a body twice as long that made the recorded steps would slip.
    """
    turned, travelled_m = segment.travel()
    rotation = start.rotation @ turned[1:]
    origin = start.origin_m + scale * travelled_m[1:] @ start.rotation.T
    link = np.einsum("tij,tlj->tli", rotation, scale * segment.link_m) + origin[:, None]
    return Replayed(rotation, origin, link)


def tip_travel_m(before_m: Floats, after_m: Floats) -> float:
    """How far the tail goes in the body frame between shapes (L, 3)."""
    return float(np.linalg.norm(after_m[-1] - before_m[-1]))


def bridge_frames(travel_m: float, largest_m: float) -> int:
    """Return the frames between two shapes, so that no step of the tip is over ``largest_m``.

    n frames make n + 1 steps, so n is the least for which ``travel / (n + 1) <= largest``.

    Raises:
        ValueError: ``largest_m`` is not positive.

    """
    if largest_m <= 0.0:
        raise ValueError("the largest distance of the tip must be over 0")
    return max(0, math.ceil(travel_m / largest_m - 1e-9) - 1)


def bridge(before_m: Floats, after_m: Floats, largest_m: float) -> Floats:
    """(n, L, 3) shapes linear between ``before_m`` and ``after_m`` (L, 3), both left out."""
    count = bridge_frames(tip_travel_m(before_m, after_m), largest_m)
    share = np.arange(1, count + 1) / (count + 1.0)
    return before_m + share[:, None, None] * (after_m - before_m)
