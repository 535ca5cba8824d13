"""Small bodies, as thin as their own blur: fit a curve whose blurred picture is the image's.

The ridge of a blurred bend lies inside the bend, and blur hides tips. A line of Gaussian spots
along a cubic spline is fitted to the contrast by damped least squares. The parameters are control
points, thickness at a few stations, and one width of the spots.
"""

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import block_diag

from snakewalk.config.arrays import Floats, Singles
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.drivers.compiling import compiled

THIN_PX = 6.0
"""Width below which a body is fitted."""
_SPOTS = 60
_CONTROLS = 9
_STATIONS = 5
_ROUNDS = 12
_STIFF = 0.02  # weight of second differences of the controls
_EVEN_SIGMA = 0.3  # weight of differences in thickness
_LEAST_WIDTH = 0.5  # px, of a spot
_FAR_SPOTS = 5.5  # standard deviations: limit of a spot
_TAPER = 0.02  # share of the length at each end that tapers and is too faint for the fit
_MISFIT = 0.25  # of the picture's own strength: a larger residual rejects the fit


def spline_basis(place: Floats, count: int) -> Floats:
    """(P, count) cubic B-splines at ``place`` (P,), from 0 at one end to 1 at the other."""
    knots = np.concatenate([[0.0] * 3, np.linspace(0.0, 1.0, count - 2), [1.0] * 3])
    return np.asarray(BSpline.design_matrix(place, knots, 3).toarray(), dtype=float)


_SPOT_BASIS = spline_basis(np.linspace(0.0, 1.0, _SPOTS), _CONTROLS)
_FINE_BASIS = spline_basis(np.linspace(0.0, 1.0, 401), _CONTROLS)
_HATS = np.stack(
    [
        np.interp(np.linspace(0.0, 1.0, _SPOTS), np.linspace(0.0, 1.0, _STATIONS), row)
        for row in np.eye(_STATIONS)
    ],
    axis=1,
)
_BY_VALUES = np.zeros((3, 2 * _CONTROLS + _STATIONS, _SPOTS))
"""Slopes of the places and weights of the spots by all values but the last."""
_BY_VALUES[0, :_CONTROLS] = _BY_VALUES[1, _CONTROLS : 2 * _CONTROLS] = _SPOT_BASIS.T
_BY_VALUES[2, 2 * _CONTROLS :] = _HATS.T
_BEND = np.diff(np.eye(_CONTROLS), 2, axis=0)


def fitted(line: Floats, level: Singles, width: float) -> tuple[Floats, float] | None:
    """Curve (403, 2) from tip to tip whose blurred picture is closest to ``level``.

    Args:
        line: (P, 2) x, y in pixels of ``level``, a first guess with equal steps.
        level: (h, w) contrast of one body.
        width: of the body with its blur, px.

    Returns:
        The curve and the residual as a share of the picture's strength; None if the fit is bad.

    """
    picture = np.asarray(level, dtype=float)
    start = np.stack(
        [np.interp(np.linspace(0, 1, 401), np.linspace(0, 1, len(line)), v) for v in line.T]
    )
    controls = np.linalg.lstsq(_FINE_BASIS, start.T, rcond=None)[0]
    length = float(arc_lengths(line)[-1])
    spot = max(0.4 * width, 1.0)
    weights = np.full(_STATIONS, picture.sum() / _SPOTS)
    values = np.concatenate([controls.T.ravel(), weights, [spot]])
    damp = 1e-3
    worst = np.inf
    kept = values
    scale = np.concatenate([np.ones(2 * _CONTROLS), np.full(_STATIONS, weights[0]), [1.0]])
    strong = float(np.abs(picture).max())
    stiff = strong * block_diag(
        _STIFF * _BEND,
        _STIFF * _BEND,
        _EVEN_SIGMA / weights[0] * np.diff(np.eye(_STATIONS), axis=0),
        np.zeros((1, 1)),
    )
    normal = np.eye(len(values))
    push = np.zeros(len(values))
    for _ in range(_ROUNDS):
        shown, slopes = _picture(values, picture.shape)
        rest = (picture - shown).ravel()
        soft = stiff @ values
        cost = float(rest @ rest + soft @ soft)
        if cost < worst:
            done = worst - cost < 1e-4 * cost
            worst = cost
            kept = values
            damp = 0.3 * damp
            slopes = slopes * scale
            stiffness = stiff * scale
            normal = slopes.T @ slopes + stiffness.T @ stiffness
            push = slopes.T @ rest - stiffness.T @ soft
            if done:
                break
        else:
            damp *= 10.0
        step = np.linalg.solve(normal + damp * np.diag(np.diag(normal) + 1e-9), push)
        values = kept + np.clip(step, -1.0, 1.0) * scale
        values[-1] = max(values[-1], _LEAST_WIDTH)
    curve = _FINE_BASIS @ kept[: 2 * _CONTROLS].reshape(2, -1).T
    shown, _ = _picture(kept, picture.shape)
    left = float(np.linalg.norm(picture - shown) / max(float(np.linalg.norm(picture)), 1e-9))
    grown = float(arc_lengths(curve)[-1]) / length
    reach = _TAPER * length
    ends = [
        reach * (a - b) / float(np.hypot(*(a - b))) for a, b in (curve[[0, 8]], curve[[-1, -9]])
    ]
    curve = np.vstack([curve[0] + ends[0], curve, curve[-1] + ends[1]])
    if left > _MISFIT or not 0.7 < grown < 1.5:
        return None
    return curve, left


def _picture(values: Floats, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    x, y = _SPOT_BASIS @ values[:_CONTROLS], _SPOT_BASIS @ values[_CONTROLS : 2 * _CONTROLS]
    weights = _HATS @ values[2 * _CONTROLS : -1]
    spot = float(values[-1])
    shown = np.zeros(shape)
    by = np.zeros((len(values), *shape))
    x_by, y_by, weights_by = _BY_VALUES
    draw_spots(x, y, weights, x_by, y_by, weights_by, spot, shown, by)
    by[-1] /= spot
    return shown, by.reshape(len(values), -1).T


_VECTOR = "float64[::1]"
_MATRIX = "float64[:, ::1]"


@compiled(
    f"void({_VECTOR}, {_VECTOR}, {_VECTOR}, {_MATRIX}, {_MATRIX}, {_MATRIX}, float64, {_MATRIX},"
    " float64[:, :, ::1])"
)
def draw_spots(
    x: Floats,
    y: Floats,
    area: Floats,
    x_by: Floats,
    y_by: Floats,
    area_by: Floats,
    spot: float,
    cover: Floats,
    by: Floats,
) -> None:
    """Add Gaussian spots to a picture and to its slopes.

    Args:
        x: (S,) columns.
        y: (S,) rows.
        area: (S,) sum of a spot's picture.
        x_by: (P, S) slopes of ``x`` by the parameters.
        y_by: (P, S) slopes of ``y``.
        area_by: (P, S) slopes of ``area``.
        spot: standard deviation, px.
        cover: (h, w) the picture, changed.
        by: (P + 1, h, w) its slopes, changed; the last by the log of ``spot``; (0, h, w) to skip.

    """
    high, wide = cover.shape
    share = 1.0 / (np.sqrt(2.0 * np.pi) * spot)
    across = np.empty(wide)
    moved = np.empty(wide)
    spread = np.empty(wide)
    for k in range(len(x)):
        left = max(0, int(np.ceil(x[k] - _FAR_SPOTS * spot)))
        right = min(wide, int(np.floor(x[k] + _FAR_SPOTS * spot)) + 1)
        top = max(0, int(np.ceil(y[k] - _FAR_SPOTS * spot)))
        bottom = min(high, int(np.floor(y[k] + _FAR_SPOTS * spot)) + 1)
        for u in range(left, right):
            off = (u - x[k]) / spot
            across[u] = share * np.exp(-0.5 * off * off)
            moved[u] = across[u] * off / spot
            spread[u] = across[u] * (off * off - 1.0)
        for v in range(top, bottom):
            off = (v - y[k]) / spot
            down = share * np.exp(-0.5 * off * off)
            heavy = down * area[k]
            for u in range(left, right):
                cover[v, u] += heavy * across[u]
            for p in range(len(by) - 1):
                if x_by[p, k] == 0.0 and y_by[p, k] == 0.0 and area_by[p, k] == 0.0:
                    continue  # each spot depends on few values of a spline
                heavy_x = heavy * x_by[p, k]
                along = heavy * off / spot * y_by[p, k] + down * area_by[p, k]
                for u in range(left, right):
                    by[p, v, u] += heavy_x * moved[u] + along * across[u]
            if len(by) > 0:
                wider = heavy * (off * off - 1.0)
                for u in range(left, right):
                    by[-1, v, u] += heavy * spread[u] + wider * across[u]
