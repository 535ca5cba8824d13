"""Advice for points that no safe path joins: the planner setting that would join them."""

import numpy as np
from scipy.ndimage import label

from snakewalk.config.arrays import Floats
from snakewalk.controller.terrain.relief import Relief

_MOST_FACTOR = 4.0
"""Factor of a limit that is still proposed (ours); more is other ground, not another limit."""
_STEPS = 14
_MOST_SLOPE_RAD = 1.49


def route_advice(relief: Relief, points_m: Floats) -> str:
    """Return the change that joins points (2, 2), or that no change of a limit does.

    Each proposed value was tried on the samples of the ground.
    """
    config = relief.config
    most_slope = min(_MOST_FACTOR, _MOST_SLOPE_RAD / config.slope_limit_rad)
    slope = _least_factor(relief, points_m, most_slope, 1.0)
    if slope is not None:
        return f"set world.planner.slope_limit_rad to {_rounded_up(slope * config.slope_limit_rad)}"
    variance = _least_factor(relief, points_m, 1.0, _MOST_FACTOR)
    if variance is not None:
        limit = _rounded_up(variance * config.variance_limit_m2)
        return f"set world.planner.variance_limit_m2 to {limit}"
    both = _least_factor(relief, points_m, most_slope, _MOST_FACTOR)
    if both is not None:
        return (
            f"set world.planner.slope_limit_rad to "
            f"{_rounded_up(min(both, most_slope) * config.slope_limit_rad)} and "
            f"world.planner.variance_limit_m2 to {_rounded_up(both * config.variance_limit_m2)}"
        )
    risk = relief.risk_at_samples(slope_factor=1.0, variance_factor=1.0)
    for margin_m in config.edge_margin_m * np.array([0.75, 0.5, 0.25, 0.0]):
        if _are_joined(relief, risk, float(margin_m), points_m):
            return f"set world.planner.edge_margin_m to {margin_m:.2g}"
    risk = relief.risk_at_samples(slope_factor=1.0, variance_factor=1.0, filled=True)
    if _are_joined(relief, risk, config.edge_margin_m, points_m):
        return "the world's map does not know the ground between them; map it or move a waypoint"
    return "move a waypoint; no higher limit joins them"


def _least_factor(
    relief: Relief, points_m: Floats, slope_most: float, variance_most: float
) -> float | None:
    """Smallest factor, up to each limit's largest one, that joins the points, or None."""

    def joins(factor: float) -> bool:
        risk = relief.risk_at_samples(
            slope_factor=min(factor, slope_most), variance_factor=min(factor, variance_most)
        )
        return _are_joined(relief, risk, relief.config.edge_margin_m, points_m)

    low, high = 1.0, max(slope_most, variance_most)
    if not joins(high):
        return None
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if joins(middle) else (middle, high)
    return high


def _are_joined(relief: Relief, risk: Floats, margin_m: float, points_m: Floats) -> bool:
    """Whether samples of ``risk`` (rows, columns) up to 1 join points (2, 2).

    Samples within ``margin_m`` of the border do not count.
    """
    ground = relief.ground
    x, y = ground.axes_m
    w, h = ground.size_m
    inside = np.minimum(x - ground.x0_m, ground.x0_m + w - x)[None, :] >= margin_m - 1e-9
    inside = inside & (np.minimum(y - ground.y0_m, ground.y0_m + h - y)[:, None] >= margin_m - 1e-9)
    parts, count = label((risk <= 1.0) & inside)
    if count == 0:
        return False
    nearest = []
    for px, py in points_m:
        gap = (x[None, :] - px) ** 2 + (y[:, None] - py) ** 2
        nearest.append(parts.flat[int(np.argmin(np.where(parts > 0, gap, np.inf)))])
    return bool(nearest[0] == nearest[1])


def _rounded_up(value: float) -> str:
    unit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return f"{np.ceil(value / unit - 1e-6) * unit:.2g}"
