"""A skin of PDE patches: a tube through many closed curves, and fins that grow out ([GC] 1.3).

The paper makes one patch of four curves; two such patches meet in a curve with a crease. Here a
patch spans two curves, and shares the slope along the body at both with its neighbour; of order 3,
the curvature too.

A fin is a patch of its own: its first curve is drawn on the tube, three more stand above it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from snakewalk.config.animal import FinConfig
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.pde_surface import TURN, PdeSurface

FIN_CURVES = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Heights of a fin's curves over its span."""
_FIN_POINTS = 24


@dataclass(frozen=True, slots=True)
class Tube:
    """A body's skin: patches from curve to curve, head first."""

    patches: tuple[PdeSurface, ...]
    """(K - 1,) patches between the curves."""
    stations: Floats
    """(K,) places of the curves along the body, 0 to 1."""

    @staticmethod
    def through(curves_m: Floats, stations: Floats, order: int = 2, spread: float = 1.0) -> "Tube":
        """Join curves (K, C, 3) at rising stations (K,); a tip is a curve of one place.

        Raises:
            InputError: too few curves for the slopes, an unknown order, or curves that coincide.

        """
        if not 1 <= order <= 3:
            raise InputError(f"a skin is of order 1 (creased), 2 or 3, not {order}")
        if len(curves_m) < 4 or len(stations) != len(curves_m) or np.any(np.diff(stations) <= 0.0):
            raise InputError(
                f"curves: a skin needs 4 or more at increasing stations, not {len(curves_m)}"
            )
        # over the skin, not along the body, where the radius of a round tip rises without bound
        span = np.linalg.norm(np.diff(curves_m, axis=0), axis=-1).mean(axis=1)
        if not span.all():
            raise InputError("curves: two of the skin coincide; leave one out")
        run_m = np.concatenate([[0.0], np.cumsum(span)])
        given = [CubicSpline(run_m, curves_m)(run_m, k) for k in range(order)]
        given[0] = np.asarray(curves_m, dtype=float)
        ends = np.repeat([0.0, 1.0], order)
        slopes = [*range(order)] * 2
        patches = tuple(
            PdeSurface.through(
                np.array(
                    [
                        derivatives[k] * span[i] ** n
                        for k in (i, i + 1)
                        for n, derivatives in enumerate(given)
                    ]
                ),
                spread=spread,
                ring_places=ends.tolist(),
                slopes=slopes,
            )
            for i in range(len(curves_m) - 1)
        )
        return Tube(patches, np.asarray(stations, dtype=float))

    def points_m(self, s: Floats, v: Floats) -> Floats:
        """(S, V, 3) at places along the body (S,) in 0 to 1 and around it (V,)."""
        patch, u = self._patch_and_u(s)
        out = np.empty((len(s), len(v), 3))
        for k in np.unique(patch):
            out[patch == k] = self.patches[k].points_m(u[patch == k], v)
        return out

    def rows(self, rows_per_patch: int) -> Floats:
        """Places (S,) along the body: ``rows_per_patch`` to a patch, all curves among them."""
        even = np.linspace(0.0, len(self.patches), rows_per_patch * len(self.patches) + 1)
        return np.interp(even, np.arange(len(self.stations)), self.stations)

    def spine_m(self, s: Floats) -> Floats:
        """(S, 3) the zeroth term of the patches."""
        patch, u = self._patch_and_u(s)
        return np.array([self.patches[k].spine_m(x)[0] for k, x in zip(patch, u, strict=True)])

    def _patch_and_u(self, s: Floats) -> tuple[Ints, Floats]:
        """Patch and its u of places (S,)."""
        place = np.interp(s, self.stations, np.arange(len(self.stations)))
        patch = np.minimum(place.astype(np.int64), len(self.patches) - 1)
        return patch, place - patch


@dataclass(frozen=True, slots=True)
class Fin:
    """A fin's patch, and where its first curve lies on the tube."""

    surface: PdeSurface
    root_s: Floats
    """(C,) place along the body of the first curve, at its own samples."""
    root_v: Floats
    """(C,) place around the body."""


def fin(tube: Tube, build: FinConfig) -> Fin:
    """Grow a fin: curves of one shape, from the one on the tube to the tip.

    ``at`` and ``chord`` place the first curve along the body, ``around_deg`` around it: 90 is the
    back, 0 the left side. It stands out radially there, leaning back by ``sweep``.

    Raises:
        InputError: its root does not lie on the body.

    """
    low, high = build.at - 0.5 * build.chord, build.at + 0.5 * build.chord
    if low < 0.0 or high > 1.0:
        raise InputError(f"fin at {build.at:g}: its root, {low:g} to {high:g}, leaves the body")
    length = float(np.ptp(tube.spine_m(np.array([0.0, 1.0]))[:, 0]))
    turn = np.arange(_FIN_POINTS) * TURN / _FIN_POINTS
    v0 = np.radians(build.around_deg)
    root_s = build.at + 0.5 * build.chord * np.cos(turn)  # the first sample is the rearmost
    middle = tube.points_m(
        np.array([build.at]), np.array([v0, v0 + 0.5 * np.pi, v0 - 0.5 * np.pi])
    )[0]
    breadth = max(float(np.linalg.norm(middle[1] - middle[2])), 1e-9 * length)
    half = build.thickness * length
    root_v = v0 + np.arcsin(min(2.0 * half / breadth, 0.9)) * np.sin(turn)
    root = np.array(
        [
            tube.points_m(np.array([s]), np.array([v]))[0, 0]
            for s, v in zip(root_s, root_v, strict=True)
        ]
    )
    out = np.array([0.0, np.cos(v0), np.sin(v0)])
    side = np.array([0.0, -np.sin(v0), np.cos(v0)])
    heel = tube.points_m(np.array([build.at]), np.array([v0]))[0, 0]
    curves = [root]
    for h in FIN_CURVES[1:]:
        chord = build.chord * length * (1.0 + (build.tip_chord - 1.0) * h)
        middle_m = heel + build.span * length * h * out
        middle_m = middle_m - [build.sweep * length * h, 0.0, 0.0]
        thick = half * (1.0 - 0.9 * h)
        curves.append(
            middle_m
            - 0.5 * chord * np.cos(turn)[:, None] * [1.0, 0.0, 0.0]
            + thick * np.sin(turn)[:, None] * side
        )
    return Fin(PdeSurface.through(np.array(curves)), root_s, root_v)


def fins(tube: Tube, builds: Sequence[FinConfig]) -> tuple[Fin, ...]:
    """Grow all fins of a body."""
    return tuple(fin(tube, build) for build in builds)
