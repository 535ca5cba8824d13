"""A skin: the biharmonic surface through four closed curves, solved in closed form ([GC] 1.3).

    (d2/du2 + a2 d2/dv2)^2 X = 0,   X(u_j, v) = C_j(v) for j = 1..4,   X = A_0(u) + sum_n ... + R

Mode n of the curves' Fourier series is carried from curve to curve by ``e^(-a n (1 - u))``, the
same with ``u``, and both times a linear factor: the printed ``e^(a n u)`` (Eq. 4) grows to 1e13 at
n = 30, which makes the system singular in practice (condition 1e18; here 7e4): these are the same
functions, scaled. What the series leaves out of a curve goes into the remainder R, of mode ``M +
1`` (Eq. 8), so that all four curves are met exactly. ``A_0``, a cubic, is the spine.

The equation is printed (Eq. 1) without ``a2``, although its solution (Eq. 4) has ``a``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError

CURVES_AT = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Where along u the four curves lie."""
TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class PdeSurface:
    """The surface through four curves of N points; ``u`` from 0 to 1, ``v`` from 0 to 2 pi."""

    spread: float
    """a: how fast the detail of a curve fades from it."""
    at: tuple[float, float, float, float]
    spine_terms: Floats
    """(4, 3) of the cubic ``A_0``."""
    cosine: Floats
    """(M, 4, 3) of each mode's four functions of u."""
    sine: Floats
    """(M, 4, 3)"""
    left_out: Floats
    """(4, N, 3) remainder's four functions of u, at the curves' own samples of v."""

    @staticmethod
    def through(
        curves_m: ArrayLike,
        modes: int = 5,
        spread: float = 1.0,
        at: tuple[float, float, float, float] = CURVES_AT,
    ) -> "PdeSurface":
        """Solve for four closed curves (4, N, 3), sampled evenly in v without a last one at 2 pi.

        A sample at ``2 pi`` is that at 0 again: it would count double in every Fourier coefficient.

        Raises:
            InputError: not four curves, a last sample that repeats the first, too many modes.

        """
        curves = np.asarray(curves_m, dtype=float)
        if curves.ndim != 3 or curves.shape[0] != 4 or curves.shape[2] != 3:
            raise InputError(f"a PDE surface takes curves of shape (4, N, 3), not {curves.shape}")
        if not np.isfinite(curves).all() or list(at) != sorted(set(at)) or spread <= 0.0:
            raise InputError("a PDE surface takes finite points, rising places and a > 0")
        size = np.ptp(curves, axis=1).max(axis=1)
        again = np.abs(curves[:, -1] - curves[:, 0]).max(axis=1) <= 1e-9 * size
        if (again & (size > 0.0)).any():
            raise InputError("a curve's last point repeats its first: leave out the one at 2 pi")
        count = curves.shape[1]
        if not 0 <= modes < (count + 1) // 2:
            raise InputError(f"{modes} modes need more than {2 * modes} points a curve: {count}")
        places = np.array(at)
        series = np.fft.rfft(curves, axis=1)[:, : modes + 1] / count
        spine = np.linalg.solve(np.vander(places, 4, increasing=True), series[:, 0].real)
        cosine, sine = np.zeros((modes, 4, 3)), np.zeros((modes, 4, 3))
        for n in range(1, modes + 1):
            basis = _basis(places, spread * n)
            cosine[n - 1] = np.linalg.solve(basis, 2.0 * series[:, n].real)
            sine[n - 1] = np.linalg.solve(basis, -2.0 * series[:, n].imag)
        half = PdeSurface(spread, at, spine, cosine, sine, np.zeros((4, count, 3)))
        rest = curves - half.points_m(places, np.arange(count) * TURN / count)
        fading = _basis(places, spread * (modes + 1))
        left_out = np.asarray(np.linalg.solve(fading, rest.reshape(4, -1)), dtype=float)
        return PdeSurface(spread, at, spine, cosine, sine, left_out.reshape(4, -1, 3))

    def spine_m(self, u: ArrayLike) -> Floats:
        """(U, 3) the zeroth term: what the surface is wound around."""
        return np.asarray(np.vander(np.atleast_1d(u), 4, increasing=True) @ self.spine_terms)

    def points_m(self, u: ArrayLike, v: ArrayLike) -> Floats:
        """(U, V, 3) at all pairs; the remainder is linear in v between the curves' samples."""
        us, vs = np.atleast_1d(np.asarray(u, float)), np.atleast_1d(np.asarray(v, float))
        out = np.repeat(self.spine_m(us)[:, None], len(vs), axis=1)
        for n in range(1, len(self.cosine) + 1):
            basis = _basis(us, self.spread * n)
            out += np.cos(n * vs)[None, :, None] * (basis @ self.cosine[n - 1])[:, None]
            out += np.sin(n * vs)[None, :, None] * (basis @ self.sine[n - 1])[:, None]
        count = self.left_out.shape[1]
        place = np.mod(vs, TURN) / TURN * count
        before = np.floor(place).astype(int)
        share = (place - before)[None, :, None]
        left, right = self.left_out[:, before % count], self.left_out[:, (before + 1) % count]
        fading = _basis(us, self.spread * (len(self.cosine) + 1))
        return np.asarray(
            out + np.einsum("ub,bvx->uvx", fading, (1 - share) * left + share * right)
        )

    def moved_m(self, u: ArrayLike, v: ArrayLike, shift_m: ArrayLike) -> Floats:
        """(U, V, 3) with the spine moved by (U, 3): each point keeps its place beside it."""
        return np.asarray(self.points_m(u, v) + np.asarray(shift_m, dtype=float)[:, None])


def carry_over(mesh_m: ArrayLike, before_m: ArrayLike, after_m: ArrayLike) -> Floats:
    """(K, 3) a mesh whose points go where their nearest surface points went ([GC] 2.4).

    Args:
        mesh_m: (K, 3) aligned with the surface.
        before_m: (..., 3) points of the surface at rest.
        after_m: the same points, moved.

    """
    mesh, rest = np.asarray(mesh_m, float), np.asarray(before_m, float).reshape(-1, 3)
    nearest = cKDTree(rest).query(mesh)[1]
    return np.asarray(mesh + np.asarray(after_m, float).reshape(-1, 3)[nearest] - rest[nearest])


def _basis(u: Floats, rate: float) -> Floats:
    """(U, 4) ``e^(-w (1 - u))``, ``(1 - u)`` times it, ``e^(-w u)``, ``u`` times it: at most 1."""
    falling, rising = np.exp(-rate * u), np.exp(-rate * (1.0 - u))
    return np.stack([rising, (1.0 - u) * rising, falling, u * falling], axis=1)
