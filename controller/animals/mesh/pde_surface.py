"""A skin: the elliptic PDE surface of order 2N through closed curves, in closed form ([GC] 1.3).

    (d2/du2 + a2 d2/dv2)^N X = 0,   X = A_0(u) + sum_n [A_n(u) cos(nv) + B_n(u) sin(nv)] + R(u, v)

The surface meets ``2N`` closed curves, each as a place of the surface or as its slope, curvature,
... along u. Four places with N = 2 are the biharmonic surface of the paper. Places and slopes at
both ends join patches without a crease, and six conditions with N = 3 also with even curvature.

The functions of mode n are ``e^(-a n (1 - u))``, ``e^(-a n u)``, and both times powers. The printed
``e^(a n u)`` (Eq. 4) grows to 1e13 at n = 30, which makes the system singular in practice
(condition 1e18; here 7e4). These are the same functions, scaled. The rest of a curve goes into the
remainder R, of mode ``M + 1`` (Eq. 8), so the curves are met exactly. ``A_0``, a polynomial, is the
spine.

The equation is printed (Eq. 1) without ``a2``, although its solution (Eq. 4) has ``a``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, perm

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError

TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class PdeSurface:
    """The surface through 2N curves of C points; ``u`` from 0 to 1, ``v`` from 0 to 2 pi."""

    spread: float
    """Parameter a: the rate at which the detail of a curve fades from it."""
    at: tuple[float, ...]
    """(2N,) where along u the curves lie."""
    slopes: tuple[int, ...]
    """(2N,) meaning of a curve: 0 the place, 1 the slope dX/du, 2 the second derivative, ..."""
    spine_terms: Floats
    """(2N, 3) of the polynomial ``A_0``, from the constant up."""
    cosine: Floats
    """(M, 2N, 3) of each mode's functions of u."""
    sine: Floats
    """(M, 2N, 3) coefficients of the sines."""
    left_out: Floats
    """(2N, C, 3) remainder's functions of u, at the curves' own samples of v."""

    @staticmethod
    def through(
        curves_m: ArrayLike,
        modes: int | None = None,
        spread: float = 1.0,
        ring_places: Sequence[float] | None = None,
        slopes: Sequence[int] | None = None,
    ) -> "PdeSurface":
        """Solve for 2N closed curves (2N, C, 3), sampled evenly in v without 2 pi.

        Args:
            curves_m: metres; of slopes, metres per unit of u.
            modes: M of the series; None uses all, without a remainder.
            spread: a.
            ring_places: (2N,) default: evenly from 0 to 1.
            slopes: (2N,) default: all places.

        Raises:
            InputError: no even number of curves, a last sample that repeats the first, too many
                modes, conditions that do not determine a surface.

        """
        curves = np.asarray(curves_m, dtype=float)
        if curves.ndim != 3 or curves.shape[0] % 2 or not curves.size or curves.shape[2] != 3:
            raise InputError(
                "curves: a PDE surface needs an array of shape (2 N, points, 3), not "
                f"{curves.shape}"
            )
        number, count = curves.shape[:2]
        places = (
            np.linspace(0.0, 1.0, number)
            if ring_places is None
            else np.array(ring_places, dtype=float)
        )
        kinds = [0] * number if slopes is None else [int(kind) for kind in slopes]
        if len(places) != number or len(kinds) != number:
            raise InputError(
                f"curves: a PDE surface needs a place and a kind for each of {number} curves"
            )
        rising = list(zip(places, kinds, strict=True))
        if rising != sorted(set(rising)) or min(kinds) < 0 or max(kinds) >= number:
            raise InputError(
                "curves: a PDE surface needs increasing places, and increasing slopes at one place"
            )
        if not np.isfinite(curves).all() or spread <= 0.0 or kinds.count(0) == 0:
            raise InputError(
                "curves: a PDE surface needs finite points, a > 0 and at least one place"
            )
        size = np.ptp(curves, axis=1).max(axis=1)
        again = np.abs(curves[:, -1] - curves[:, 0]).max(axis=1) <= 1e-9 * size
        if (again & (size > 0.0) & (np.array(kinds) == 0)).any():
            raise InputError("a curve's last point repeats its first: leave out the one at 2 pi")
        if modes is not None and not 0 <= modes < (count + 1) // 2:
            raise InputError(f"{modes} modes need more than {2 * modes} points a curve: {count}")
        kept = count // 2 if modes is None else modes
        series = np.fft.rfft(curves, axis=1)[:, : kept + 1] / count
        double = np.where(2 * np.arange(kept + 1) == count, 1.0, 2.0)  # the last mode has no pair
        spine = np.linalg.solve(_conditions(places, kinds, 0.0), series[:, 0].real)
        basis = _conditions(places, kinds, spread * np.arange(1, kept + 1)[:, None])
        by_mode = series[:, 1:].transpose(1, 0, 2)
        cosine = np.linalg.solve(basis, double[1:, None, None] * by_mode.real)
        sine = np.linalg.solve(basis, -2.0 * by_mode.imag)
        if 2 * kept == count:
            sine[kept - 1 :] = 0.0
        left_out = np.zeros((number, count, 3))
        if modes is not None:
            v = np.arange(count) * TURN / count
            terms = np.exp(1j * np.arange(kept + 1)[:, None] * v)
            coefficients = np.einsum("jnx,n,nv->jvx", series, np.r_[1.0, double[1:]], terms).real
            fading = _conditions(places, kinds, spread * (kept + 1))
            left_out = np.linalg.solve(fading, (curves - coefficients).reshape(number, -1))
        return PdeSurface(
            spread=spread,
            at=tuple(places.tolist()),
            slopes=tuple(kinds),
            spine_terms=spine,
            cosine=cosine,
            sine=sine,
            left_out=np.asarray(left_out, dtype=float).reshape(number, count, 3),
        )

    def spine_m(self, u: ArrayLike) -> Floats:
        """(U, 3) the zeroth term: the spine."""
        return _basis(np.atleast_1d(np.asarray(u, float)), 0.0, self._order, 0) @ self.spine_terms

    def points_m(self, u: ArrayLike, v: ArrayLike, along: int = 0, around: int = 0) -> Floats:
        """(U, V, 3) at all pairs, or the derivative there; the remainder is linear between samples.

        ``along`` and ``around`` are the orders of the derivative by u (U,) and v (V,).
        """
        us, vs = np.atleast_1d(np.asarray(u, float)), np.atleast_1d(np.asarray(v, float))
        out = np.zeros((len(us), len(vs), 3))
        if around == 0:
            out += (_basis(us, 0.0, self._order, along) @ self.spine_terms)[:, None]
        quarter = around * 0.5 * np.pi  # a derivative of cos and sin is a quarter turn
        n: Floats = np.arange(1.0, len(self.cosine) + 1)[:, None]
        basis = _basis(us, self.spread * n, self._order, along) * n[..., None] ** around
        turned = n * vs + quarter
        out += np.tensordot(basis @ self.cosine, np.cos(turned), (0, 0)).transpose(0, 2, 1)
        out += np.tensordot(basis @ self.sine, np.sin(turned), (0, 0)).transpose(0, 2, 1)
        if around < 2 and self.left_out.any():
            out += self._remainder(us, vs, along, around)
        return out

    def moved_m(self, u: ArrayLike, v: ArrayLike, shift_m: ArrayLike) -> Floats:
        """(U, V, 3) with the spine moved by (U, 3); as printed, nothing turns."""
        return np.asarray(self.points_m(u, v) + np.asarray(shift_m, dtype=float)[:, None])

    @property
    def _order(self) -> int:
        return len(self.at) // 2

    def _remainder(self, us: Floats, vs: Floats, along: int, around: int) -> Floats:
        """(U, V, 3) of R or its derivative."""
        count = self.left_out.shape[1]
        place = np.mod(vs, TURN) / TURN * count
        before = np.floor(place).astype(int)
        left, right = self.left_out[:, before % count], self.left_out[:, (before + 1) % count]
        share = (place - before)[None, :, None]
        rest = (1 - share) * left + share * right if around == 0 else (right - left) * count / TURN
        fading = _basis(us, self.spread * (len(self.cosine) + 1), self._order, along)
        return np.asarray(np.einsum("ub,bvx->uvx", fading, rest))


def _conditions(places: Floats, kinds: Sequence[int], rate: float | Floats) -> Floats:
    """(2N, 2N) conditions on the functions of u; (M, 2N, 2N) for rates (M, 1)."""
    order = len(places) // 2
    return np.stack(
        [_basis(places[k : k + 1], rate, order, kind)[..., 0, :] for k, kind in enumerate(kinds)],
        axis=-2,
    )


def _basis(u: Floats, rate: float | Floats, order: int, along: int) -> Floats:
    """(U, 2N) functions of a mode that fades at ``rate``, differentiated ``along`` times.

    Powers of u for the rate 0; else ``(1 - u)^k e^(-w (1 - u))`` and ``u^k e^(-w u)`` for k < N;
    (M, U, 2N) for rates (M, 1).
    """
    if np.ndim(rate) == 0 and rate == 0.0:
        return np.stack([_power(u, k, along) for k in range(2 * order)], axis=1)
    sign = -1.0 if along % 2 else 1.0
    rising = [sign * _fading_derivatives(1.0 - u, rate, k, along) for k in range(order)]
    return np.stack(
        [*rising, *(_fading_derivatives(u, rate, k, along) for k in range(order))], axis=-1
    )


def _power(u: Floats, k: int, times: int) -> Floats:
    """``u^k``, differentiated."""
    return np.zeros_like(u) if times > k else perm(k, times) * u ** (k - times)


def _fading_derivatives(u: Floats, rate: float | Floats, k: int, times: int) -> Floats:
    """``u^k e^(-w u)``, differentiated by Leibniz' rule."""
    parts = [
        comb(times, j) * (-rate) ** (times - j) * _power(u, k, j) for j in range(min(times, k) + 1)
    ]
    return sum(parts) * np.exp(-rate * u)
