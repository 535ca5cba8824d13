"""The deformable fish: a rigid head, a spine of a few angles, elliptic sections.

[TH] 3.2.2 has five skeleton pieces, the angles A0..A3, and a skin of NURBS. Here each angle is
spread evenly over the piece length around its joint: the tangent of a quadratic B-spline, of
constant length and linear in the angles.
"""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError

STATIONS = 41
"""Places along the body at which its sections are given, both ends included."""
PECTORAL = (0.225, 0.3)
"""Places along the body between which a pectoral fin is rooted (ours)."""
_FIN_ASIDE = 0.75
_FIN_BACK = 0.66  # where it points, from above
_CARP = ((0.0, 0.01), (0.03, 0.035), (0.1, 0.06), (0.22, 0.085), (0.33, 0.09), (0.5, 0.075),
         (0.7, 0.042), (0.83, 0.022), (0.9, 0.012), (1.0, 0.006))  # fmt: skip
_CARP_HIGH = ((0.0, 0.015), (0.05, 0.06), (0.2, 0.12), (0.35, 0.145), (0.5, 0.125), (0.7, 0.07),
              (0.82, 0.045), (0.9, 0.085), (0.97, 0.12), (1.0, 0.1))  # fmt: skip
_EEL = ((0.0, 0.012), (0.03, 0.024), (0.1, 0.034), (0.3, 0.036), (0.6, 0.03), (0.85, 0.018),
        (1.0, 0.004))  # fmt: skip


@dataclass(frozen=True)
class FishModel:
    """Size and build of one fish; all but ``length_px`` in body lengths, snout to tail."""

    length_px: float
    """Length of the straight fish in the top view."""
    joints_at: tuple[float, ...]
    """(J,) where the spine bends; the first is the base of the head and the fish's position."""
    half_width: Floats
    """(STATIONS,) half width in the top view."""
    half_height: Floats
    """(STATIONS,) half height in the side view."""
    build: str = ""
    """Name of the build of a fish (``fish_model``)."""
    fin: float = 0.0
    """Length of the pectoral fins as seen from above, stiff plates on the body; 0: none."""
    _turns: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_turns", turn_shares(self.joints_at, STATIONS - 1))

    @property
    def joints(self) -> int:
        """J, spine angles."""
        return len(self.joints_at)

    def sized(self, length_px: float, width: float = 1.0, height: float = 1.0) -> Self:
        """Return the same build at another length, with sections scaled."""
        return replace(
            self,
            length_px=length_px,
            half_width=self.half_width * width,
            half_height=self.half_height * height,
        )

    def tangents_rad(self, head_rad: float, angles_rad: Floats) -> Floats:
        """(STATIONS - 1,) direction of travel of each piece of the midline, head first."""
        return head_rad - self._turns @ angles_rad

    def midline(
        self, base_px: Floats, head_rad: float, angles_rad: Floats, pitch_rad: float = 0.0
    ) -> Floats:
        """(STATIONS, 3) points of the spine, snout first: x, y of the top view, and height.

        ``base_px`` (2,) or (3,) is the base of the head; pitch lifts the head, and turns
        the whole fish about its base.
        """
        tangents = self.tangents_rad(head_rad, angles_rad)
        piece = self.length_px / (STATIONS - 1)
        points = np.zeros((STATIONS, 3))
        points[1:, 0] = -np.cumsum(np.cos(tangents)) * piece
        points[1:, 1] = -np.cumsum(np.sin(tangents)) * piece
        place = self.joints_at[0] * (STATIONS - 1)
        low = int(place)
        points -= points[low] * (low + 1 - place) + points[low + 1] * (place - low)
        points = pitched(points[:, :2], np.array(head_rad), np.array(pitch_rad))
        points[:, : len(base_px)] += base_px
        return points

    def with_fins(self, length: float) -> Self:
        """Return the same body with pectoral fins; between their ends its width is interpolated."""
        first, last = (round(station * (STATIONS - 1)) for station in PECTORAL)
        wide = self.half_width.copy()
        if length > 0.0:
            ends = [first - 2, last + 2]
            wide[first - 2 : last + 3] = np.interp(np.arange(first - 2, last + 3), ends, wide[ends])
        return replace(self, half_width=wide, fin=length)

    def outline(self, midline_px: Floats) -> Floats:
        """(n, 2) outline in the top view of a midline (STATIONS, 2 or 3)."""
        flat = midline_px[:, :2]
        along = np.empty_like(flat)
        along[1:-1] = flat[:-2] - flat[2:]
        along[0], along[-1] = flat[0] - flat[1], flat[-2] - flat[-1]
        along /= np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)[:, None]
        left = np.column_stack([-along[:, 1], along[:, 0]])
        across = left * (self.half_width * self.length_px)[:, None]
        side_line, other = flat + across, flat - across
        if self.fin > 0.0:
            first, last = (round(station * (STATIONS - 1)) for station in PECTORAL)
            k = (first + last) // 2
            reach = self.fin * self.length_px
            side_line, other = (
                np.concatenate([side[: first + 1], side[[first, last]] + tip, side[last:]])
                for side, tip in (
                    (side_line, reach * (_FIN_ASIDE * left[k] - _FIN_BACK * along[k])),
                    (other, reach * (-_FIN_ASIDE * left[k] - _FIN_BACK * along[k])),
                )
            )
        return np.concatenate([side_line, other[::-1]])


def pitched(points: Floats, head_rad: Floats, pitch_rad: Floats) -> Floats:
    """(..., P, 3) places of a level body (..., P, 2) about its base, its head lifted by a pitch."""
    ahead = np.stack([np.cos(head_rad), np.sin(head_rad)], axis=-1)[..., None, :]
    along = (points * ahead).sum(axis=-1)
    lean = np.asarray(pitch_rad)[..., None]
    level = points + (along * (np.cos(lean) - 1.0))[..., None] * ahead
    return np.concatenate([level, (along * np.sin(lean))[..., None]], axis=-1)


def turn_shares(joints_at: tuple[float, ...], pieces: int) -> Floats:
    """(pieces, J) share of each spine angle that has been turned at the middle of each piece."""
    places = np.array(joints_at)
    spread = np.gradient(places) if len(places) > 1 else np.array([0.2])
    middle = (np.arange(pieces) + 0.5) / pieces
    return np.asarray(np.clip((middle[:, None] - places) / spread + 0.5, 0.0, 1.0))


def fish_model(build: str, length_px: float = 1.0) -> FishModel:
    """Return a build by name: ``carp`` ([TH]: A0..A3 behind a rigid head) or ``eel`` (8 angles).

    [TH] 3.3.1 cuts the skeleton into seven equal parts and joins points 2, 3, 4, 5 and the ends.
    An eel bends from its head on; 4 angles leave 6 to 10 degrees of real midlines unexplained (rms,
    lamprey and prickleback), 8 leave 2 to 3.

    Raises:
        InputError: no such build.

    """
    stations = np.linspace(0.0, 1.0, STATIONS)

    def profile(knots: tuple[tuple[float, float], ...]) -> Floats:
        place, size = np.array(knots).T
        return np.asarray(np.interp(stations, place, size))

    if build == "carp":
        joint_places = tuple(k / 7 for k in range(2, 6))
        return FishModel(length_px, joint_places, profile(_CARP), profile(_CARP_HIGH), build)
    if build == "eel":
        joint_places = tuple(k / 9 for k in range(1, 9))
        return FishModel(length_px, joint_places, profile(_EEL), profile(_EEL) * 1.3, build)
    raise InputError(f"{build}: no such build of a fish; there are carp and eel")
