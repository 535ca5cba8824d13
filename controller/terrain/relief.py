"""Relief: elevation variance and slope of the ground over a window, and their risk.

[PT] 2.6.1 and [KP] 4.3 call a point safe if the elevation around it varies little. A bound on slope
is also needed, or a snake rolls over. Both are windowed, because a body bridges smaller features.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import binary_dilation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import PlannerConfig
from snakewalk.controller.terrain.keep_off import KeepOff
from snakewalk.drivers.compiling import compiled, inlined, readonly_array

EDGE_TOLERANCE_M = 1e-9
"""Distance beyond the margin at which a point still counts as on it."""
_UNKNOWN_RISK = 1e9
"""Risk of samples next to one that was not measured: never safe; finite, as it is interpolated."""


class Relief:
    """Windowed elevation variance and slope of a height field.

    Both are exact on the field's samples, up to its border, and bilinear between them.
    """

    def __init__(
        self,
        ground: HeightField,
        config: PlannerConfig,
        *,
        unknown_risk: float = _UNKNOWN_RISK,
        keep_off: KeepOff | None = None,
    ) -> None:
        """Give samples next to an unknown one the risk ``unknown_risk``; 0 makes them passable."""
        self._obstacle_risk, self.obstacle_cost = np.zeros((2, *ground.z_m.shape))
        if keep_off is not None:
            self._obstacle_risk, self.obstacle_cost = keep_off.layers(ground)
        self.ground = ground
        self.config = config
        self._variance = elevation_variance_m2(ground, config.variance_window_m)
        self._slope = fitted_slope_rad(ground, config.slope_window_m)
        # The maximum, interpolated, is never below either one interpolated: it keeps both limits.
        self._risk = self._ground_risk(1.0, 1.0)
        self._unknown = np.zeros(ground.z_m.shape)
        if ground.known is not None:
            # A slope is known if its whole window is: filled samples prove nothing.
            _, _, disc = _disc(ground, config.slope_window_m)
            self._unknown[binary_dilation(~ground.known, disc > 0.0)] = 1.0
        self._risk = np.where(self._unknown > 0.0, unknown_risk, self._risk)

    @property
    def layers(self) -> Floats:
        """(rows, columns, 2) risk without the edge margin, and elevation variance."""
        return np.stack([self._risk, self._variance], axis=-1)

    def risk_at_samples(
        self, *, slope_factor: float, variance_factor: float, filled: bool = False
    ) -> Floats:
        """(rows, columns) risk with both limits multiplied by factors; without the margin.

        With ``filled``, filled samples count as measured.
        """
        risk = self._ground_risk(slope_factor, variance_factor)
        return risk if filled else np.where(self._unknown > 0.0, self._risk, risk)

    def _ground_risk(self, slope_factor: float, variance_factor: float) -> Floats:
        variance = self._variance / (variance_factor * self.config.variance_limit_m2)
        slope = self._slope / (slope_factor * self.config.slope_limit_rad)
        return np.asarray(np.maximum(np.maximum(variance, slope), self._obstacle_risk))

    def variance_m2(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Elevation variance within ``variance_window_m`` of each point."""
        return self._field_at(self._variance, x_m, y_m)

    def slope_rad(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Inclination of the plane fitted within ``slope_window_m`` of each point."""
        return self._field_at(self._slope, x_m, y_m)

    def risk(self, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        """Larger of variance and slope over their limits; infinite beyond the edge margin."""
        x, y = np.asarray(x_m, float), np.asarray(y_m, float)
        return np.where(self.within(x, y), self._field_at(self._risk, x, y), np.inf)

    def safe(self, x_m: ArrayLike, y_m: ArrayLike) -> Bools:
        """Whether points keep both limits and the margin."""
        return self.risk(x_m, y_m) <= 1.0

    def is_obstructed(self, x_m: float, y_m: float) -> bool:
        """Whether an obstacle is nearer than the radius of the body."""
        return bool(self._field_at(self._obstacle_risk, x_m, y_m) > 1.0)

    def known(self, x_m: ArrayLike, y_m: ArrayLike) -> Bools:
        """Whether the slope window around points is fully measured."""
        return self._field_at(self._unknown, x_m, y_m) <= 1.0 / _UNKNOWN_RISK

    def within(self, x_m: ArrayLike, y_m: ArrayLike) -> Bools:
        """Whether points lie on the field, ``edge_margin_m`` or more from its border."""
        return self.ground.contains(x_m, y_m, self.config.edge_margin_m - EDGE_TOLERANCE_M)

    def _field_at(self, field: Floats, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
        return interpolated(self.ground, field, x_m, y_m)


def interpolated(ground: HeightField, field: Floats, x_m: ArrayLike, y_m: ArrayLike) -> Floats:
    """Bilinear values of a field (rows, columns, ...) on the samples of a ground.

    Beyond the border the nearest value holds. The result has the points' shape, then the field's
    further axes.
    """
    x, y = np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float))
    layers = np.ascontiguousarray(field.reshape(*field.shape[:2], -1))
    values = np.empty((x.size, layers.shape[2]))
    _interpolate(layers, ground.x0_m, ground.y0_m, ground.spacing_m, x.ravel(), y.ravel(), values)
    return values.reshape((*x.shape, *field.shape[2:]))


@inlined
def write_bilinear(layers: Floats, x: float, y: float, values: Floats) -> None:
    """Write the values (k,) of layers (rows, columns, k) at one point, in samples."""
    rows, columns, count = layers.shape
    u = min(max(x, 0.0), columns - 1.0)
    v = min(max(y, 0.0), rows - 1.0)
    i, j = min(int(u), columns - 2), min(int(v), rows - 2)
    fu, fv = u - i, v - j
    for k in range(count):
        low = layers[j, i, k] * (1.0 - fu) + layers[j, i + 1, k] * fu
        high = layers[j + 1, i, k] * (1.0 - fu) + layers[j + 1, i + 1, k] * fu
        values[k] = low * (1.0 - fv) + high * fv


@compiled(
    f"void({readonly_array(dimensions=3, layout='C')}, float64, float64, float64,"
    f" {readonly_array(layout='C')}, {readonly_array(layout='C')}, float64[:, ::1])"
)
def _interpolate(
    layers: Floats, x0: float, y0: float, spacing: float, x: Floats, y: Floats, values: Floats
) -> None:
    """Write bilinear values (n, k) of layers (rows, columns, k) at n points."""
    for p in range(len(x)):
        write_bilinear(layers, (x[p] - x0) / spacing, (y[p] - y0) / spacing, values[p])


def elevation_variance_m2(ground: HeightField, radius_m: float) -> Floats:
    """(rows, columns) variance of the elevation in a disc around each sample ([PT] 2.6.1).

    The disc is cut at the border, and contains at least the neighbouring samples.
    """
    z = ground.z_m - ground.z_m.mean()  # centred first, because the variance is a small difference
    mean = windowed_mean(ground, z, radius_m)
    return np.maximum(windowed_mean(ground, z * z, radius_m) - mean**2, 0.0)


def windowed_mean(ground: HeightField, values: Floats, radius_m: float) -> Floats:
    """(rows, columns) mean of values in a disc around each sample, cut at the border."""
    _, _, disc = _disc(ground, radius_m)
    return _window_sum(values, disc) / _window_sum(np.ones_like(values), disc)


def fitted_slope_rad(ground: HeightField, radius_m: float) -> Floats:
    """(rows, columns) inclination of the least-squares plane in a disc around each sample."""
    return np.arctan(np.hypot(*fitted_gradient(ground, radius_m)))


def fitted_gradient(ground: HeightField, radius_m: float) -> tuple[Floats, Floats]:
    """(rows, columns) ``dz/dx`` and ``dz/dy`` of the least-squares plane around each sample."""
    dx, dy, disc = _disc(ground, radius_m)
    z = ground.z_m - ground.z_m.mean()
    ones = np.ones_like(z)
    count = _window_sum(ones, disc)
    x, y = _window_sum(ones, disc * dx) / count, _window_sum(ones, disc * dy) / count
    xx = _window_sum(ones, disc * dx * dx) / count - x * x
    yy = _window_sum(ones, disc * dy * dy) / count - y * y
    xy = _window_sum(ones, disc * dx * dy) / count - x * y
    mean = _window_sum(z, disc) / count
    zx = _window_sum(z, disc * dx) / count - mean * x
    zy = _window_sum(z, disc * dy) / count - mean * y
    determinant = xx * yy - xy * xy
    return (zx * yy - zy * xy) / determinant, (zy * xx - zx * xy) / determinant


def _disc(ground: HeightField, radius_m: float) -> tuple[Floats, Floats, Floats]:
    """Offsets in x and y of a window's samples, and 1 within the radius."""
    # A plane needs the diagonal neighbours. Samples exactly on the radius belong to the disc; the
    # margin covers the rounding of the quotient.
    cells = max(radius_m / ground.spacing_m, 1.5) + 1e-9
    # the window need not exceed the field
    up, across = (min(int(cells), count - 1) for count in ground.z_m.shape)
    row, column = np.mgrid[-up : up + 1, -across : across + 1]
    inside = (np.hypot(column, row) <= cells).astype(float)
    return column * ground.spacing_m, row * ground.spacing_m, inside


def _window_sum(values: Floats, weight: Floats) -> Floats:
    """Sum of ``values`` around each sample, weighted by offset; 0 beyond the border.

    Like ``scipy.signal.fftconvolve``, whose import costs more time than all the sums.
    """
    sizes = zip(values.shape, weight.shape, strict=True)
    shape = [next_fast_len(n + m - 1, True) for n, m in sizes]
    sums = irfft2(rfft2(values, shape) * rfft2(weight[::-1, ::-1], shape), shape)
    (rows, columns), (up, left) = values.shape, ((m - 1) // 2 for m in weight.shape)
    return sums[up : up + rows, left : left + columns]
