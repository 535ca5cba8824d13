"""Advice for points that no safe path joins: the planner setting that would join them."""

from bisect import bisect_left
from collections.abc import Callable

import numpy as np
from scipy.ndimage import label

from snakewalk.config.arrays import Floats
from snakewalk.controller.terrain.relief import Relief

_MOST_STEEPER, _MOST_VARIANCE = 4.0, 20.0
"""Factors of the limits of slope and of variance that are still proposed (ours): a plane of 30
degrees has 19 times the default limit of variance."""
_STEPS = 1000
_MOST_SLOPE_RAD = 1.49
_MOVE = "move a waypoint; no higher limit joins them"


def route_advice(relief: Relief, points_m: Floats) -> str:
    """Return the change that joins points (n, 2), or that no change of a limit does.

    Each proposed value was tried on the samples of the ground.
    """
    config = relief.config

    def joins(slope_factor: float, variance_factor: float) -> bool:
        risk = relief.risk_at_samples(slope_factor=slope_factor, variance_factor=variance_factor)
        return _are_joined(relief, risk, config.edge_margin_m, points_m)

    most_slope = min(_MOST_STEEPER, _MOST_SLOPE_RAD / config.slope_limit_rad)
    variance = _least_factor(_MOST_VARIANCE, lambda factor: joins(most_slope, factor))
    slope = _least_factor(most_slope, lambda factor: joins(factor, variance))
    if variance < np.inf:
        words = [
            f"--set world.planner.{key}={_rounded_up(factor * getattr(config, key))}"
            for key, factor in (("slope_limit_rad", slope), ("variance_limit_m2", variance))
            if factor > 1.0
        ]
        return " ".join(words) or _MOVE
    risk = relief.risk_at_samples(slope_factor=1.0, variance_factor=1.0)
    for margin_m in config.edge_margin_m * np.array([0.75, 0.5, 0.25, 0.0]):
        if _are_joined(relief, risk, float(margin_m), points_m):
            return f"--set world.planner.edge_margin_m={margin_m:.2g}"
    risk = relief.risk_at_samples(slope_factor=1.0, variance_factor=1.0, filled=True)
    if _are_joined(relief, risk, config.edge_margin_m, points_m):
        return "the world's map does not know the ground between them; map it or move a waypoint"
    return _MOVE


def _least_factor(most: float, joins: Callable[[float], bool]) -> float:
    """Smallest factor of a limit, at most ``most``, that joins the points; else infinity."""
    factors: list[float] = [*np.geomspace(1.0, most, _STEPS).tolist(), np.inf]
    return factors[bisect_left(factors, True, hi=_STEPS, key=joins)]


def _are_joined(relief: Relief, risk: Floats, margin_m: float, points_m: Floats) -> bool:
    """Whether samples of ``risk`` (rows, columns) up to 1 join points (n, 2).

    Samples within ``margin_m`` of the border do not count.
    """
    ground = relief.ground
    x, y = ground.axes_m
    inside = ground.contains(x[None, :], y[:, None], margin_m - 1e-9)
    parts, count = label((risk <= 1.0) & inside)
    if count == 0:
        return False
    joined = set()
    for px, py in points_m:
        gap = np.where(parts > 0, (x[None, :] - px) ** 2 + (y[:, None] - py) ** 2, np.inf)
        nearest = int(np.argmin(gap))
        if gap.flat[nearest] > 2.0 * ground.spacing_m**2:
            return False
        joined.add(parts.flat[nearest])
    return len(joined) == 1


def _rounded_up(value: float) -> str:
    unit = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return f"{np.ceil(value / unit - 1e-6) * unit:.2g}"
