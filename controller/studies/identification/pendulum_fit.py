"""Constants of a servo fitted to recordings of a pendulum, each with an interval.

The recording is computed from its first angle alone, so a fit reproduces the motion, not only the
next sample. Many starts find the basin of the minimum, steps from the best ones the minimum.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import t as student

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.studies.identification.pendulum_log import PendulumLog
from snakewalk.controller.studies.identification.pendulum_swing import (
    FINE_S,
    robot_swing_rad,
    swing_rad,
)
from snakewalk.controller.studies.identification.servo_constants import (
    FITTED,
    NAMES,
    ServoConstants,
    ranges,
)

BACKLASHES_RAD = (0.003, 0.008, 0.017, 0.035)
"""First backlashes of the search: 0.2 to 2 degrees (ours)."""
STARTS = 24
HOPS = 60
_COARSE_S = 2e-3
_COARSE_TURNS = 25
_FINE_TURNS = 100
_SPREAD = 0.4
"""Spread of the starts, as a factor's logarithm."""
_BEST_FITS = 4
"""Best fits that hops begin from."""
_OUTLIER_RAD = 0.02
"""Errors above this count linearly, as in a mean absolute error."""
_TURN = 1e-3
"""Share of a constant's range: step of the search's derivatives."""
_BACKLASH_TURN = 0.02
"""Step as a share of the backlash; a smaller one is lost at the contacts of the teeth (ours)."""
_FINE_TURN = 1e-4
"""Step of the intervals' derivatives, as a share of a constant or of a hundredth of its range. For
constants that compensate each other, a long step's error would look like knowledge."""
_BLOCK_S = 0.5
"""Errors within this time count as one in the intervals (ours)."""
_COVERAGE = 0.95
_LEAST_SHARE = 0.01
"""Least relative error of a constant: mass, arm and supply are known to a per cent (ours)."""
_FACTOR = 1.05
"""Step along constants that move a servo alike (ours)."""
_CHI_SQUARE = 3.84
"""Threshold of one constant: less likely than 5 %."""
_TORQUE_CONSTANT = NAMES.index("torque_constant_n_m_a")
_RESISTANCE = NAMES.index("resistance_ohm")
_BACKLASH = NAMES.index("backlash_rad")
_P_UNIT = NAMES.index("p_unit_per_rad")
_SLOW_TERMS = ("stribeck_n_m", "by_motor_slow", "by_load_slow")


def error_deg(constants: ServoConstants, log: PendulumLog) -> float:
    """Mean absolute error of the angle over a log, in degrees."""
    return float(np.degrees(np.abs(swing_rad(constants.values, log) - log.position_rad).mean()))


def robot_error_deg(robot: RobotConfig, log: PendulumLog, bench: ServoConstants) -> float:
    """Mean absolute angle error of a robot's simulated servo over a log, in degrees."""
    return float(np.degrees(np.abs(robot_swing_rad(robot, log, bench) - log.position_rad).mean()))


def fit_pendulum(
    logs: Sequence[PendulumLog],
    start: ServoConstants | None = None,
    *,
    seed: int = 0,
    starts: int = STARTS,
    hops: int = HOPS,
    backlash: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> ServoConstants:
    """Fit the constants to all logs; the squares of M6 stay as ``start`` has them.

    The backlash stays, too, unless it is to be estimated: then it is 0 where the logs do not show
    one, and the interval ends at the smallest one that they would have shown.

    Args:
        logs: of one servo.
        start: constants to begin with; by default the middle of the usual range of such servos.
        seed: of the starts and steps.
        starts: fits from constants drawn around the start.
        hops: fits from constants drawn around the best ones.
        backlash: estimate the backlash.
        on_progress: called with the number of fits done, and of all.

    """
    rng = np.random.default_rng(seed)
    searched = ranges(logs[0].actuator)
    given = searched.start if start is None else start.values
    first = given[:FITTED]
    squares = given[FITTED:]
    width = (searched.high - searched.low)[:FITTED]
    total = starts + hops + 1 + backlash * len(BACKLASHES_RAD)
    pool: list[OptimizeResult] = []
    for k in range(starts):
        factor = np.exp(rng.normal(0.0, _SPREAD, len(first)))
        shift = rng.normal(size=len(first))
        drawn = first if k == 0 else first * factor + 0.02 * width * shift
        pool.append(_fit(logs, drawn, squares, _COARSE_S, _COARSE_TURNS))
        on_progress(k + 1, total)
    pool.sort(key=lambda fit: float(fit.cost))
    for k in range(hops):
        best = pool[rng.integers(min(_BEST_FITS, len(pool)))].x if rng.random() < 0.3 else pool[0].x
        other = pool[rng.integers(min(2 * _BEST_FITS, len(pool)))].x
        size = 0.15 * np.maximum(np.abs(best), 0.01 * width) * (rng.random(len(best)) < 0.4)
        drawn = best + rng.normal(size=len(best)) * size
        drawn = drawn + (rng.random() < 0.3) * 0.3 * (other - best)
        pool.append(_fit(logs, drawn, squares, _COARSE_S, _COARSE_TURNS))
        pool.sort(key=lambda fit: float(fit.cost))
        on_progress(starts + k + 1, total)
    best = pool[0].x
    most_rad = 0.0
    if backlash:
        best, squares, most_rad = _with_backlash(
            logs, pool[0], squares, lambda done: on_progress(starts + hops + done, total)
        )
    values = np.asarray(_fit(logs, best, squares, FINE_S, _FINE_TURNS).x)
    on_progress(total, total)
    least, most = _inseparable_factors(logs, values, squares)
    chosen = float(np.clip(first[_P_UNIT] / values[_P_UNIT], least, most))
    smallest = _scaled_constants(values, least)
    greatest = _scaled_constants(values, most)
    values = _scaled_constants(values, chosen)
    low, high = _intervals(logs, values, squares)
    unknown = np.full(len(squares), np.nan)
    low = np.append(np.minimum(low, smallest), unknown)
    high = np.append(np.maximum(high, greatest), unknown)
    if most_rad > 0.0:
        low[_BACKLASH], high[_BACKLASH] = 0.0, most_rad
    return ServoConstants(np.append(values, squares), low, high, logs[0].actuator)


def _with_backlash(
    logs: Sequence[PendulumLog],
    rigid: OptimizeResult,
    kept: Floats,
    on_progress: Callable[[int], None],
) -> tuple[Floats, Floats, float]:
    """Constants with a backlash, those that stay, and the end of the interval of a backlash of 0.

    A backlash is accepted if the errors fall by more than chance explains.
    """
    pool = []
    for done, backlash_rad in enumerate(BACKLASHES_RAD, 1):
        first = np.append(rigid.x, backlash_rad)
        pool.append(_fit(logs, first, kept[1:], _COARSE_S, _COARSE_TURNS))
        on_progress(done)
    best = min(pool, key=lambda fit: float(fit.cost))
    limit = float(rigid.cost) / (1.0 + _CHI_SQUARE / _blocks(logs))
    if best.cost < limit:
        return np.asarray(best.x), kept[1:], 0.0
    none = np.append(0.0, kept[1:])
    most_rad = next(
        (
            backlash_rad
            for backlash_rad in BACKLASHES_RAD
            if _cost(rigid.x, logs, np.append(backlash_rad, kept[1:]))
            > _cost(rigid.x, logs, none) * (1.0 + _CHI_SQUARE / _blocks(logs))
        ),
        float(ranges(logs[0].actuator).high[_BACKLASH]),
    )
    return np.asarray(rigid.x), none, most_rad


def _blocks(logs: Sequence[PendulumLog]) -> int:
    return sum(math.ceil(log.time_s[-1] / _BLOCK_S) for log in logs)


def _cost(values: Floats, logs: Sequence[PendulumLog], kept: Floats) -> float:
    """Sum of the errors, as a fit minimises it."""
    errors = _errors(values, logs, kept, FINE_S) / _OUTLIER_RAD
    return float((np.sqrt(1.0 + errors**2) - 1.0).sum())


def _errors(values: Floats, logs: Sequence[PendulumLog], squares: Floats, step_s: float) -> Floats:
    """(M,) errors of all logs, one after the other."""
    residuals = np.append(values, squares)
    return np.concatenate([swing_rad(residuals, log, step_s) - log.position_rad for log in logs])


def _fit(
    logs: Sequence[PendulumLog], values: Floats, squares: Floats, step_s: float, turns: int
) -> OptimizeResult:
    searched = ranges(logs[0].actuator)
    low, high = searched.low[: len(values)], searched.high[: len(values)]
    width = high - low
    inside = np.clip(values, low + 1e-6 * width, high - 1e-6 * width)
    turn = [_TURN] if len(values) == FITTED else [*[_TURN] * FITTED, _BACKLASH_TURN]
    return least_squares(
        _errors,
        inside,
        bounds=(low, high),
        args=(logs, squares, step_s),
        x_scale=width,
        diff_step=turn,
        loss="soft_l1",
        f_scale=_OUTLIER_RAD,
        max_nfev=turns,
    )


def _scaled_constants(values: Floats, factor: float) -> Floats:
    """Return the constants with torque constant and P unit times a factor, resistance its square.

    Where the output never comes to its limit, such a servo moves in the same way: with less
    current, by more volts.
    """
    out = values.copy()
    out[[_TORQUE_CONSTANT, _P_UNIT]] *= factor
    out[_RESISTANCE] *= factor**2
    return out


def _searched(logs: Sequence[PendulumLog], values: Floats) -> tuple[Floats, Floats]:
    """Ends of the ranges of the first values."""
    searched = ranges(logs[0].actuator)
    return searched.low[: len(values)], searched.high[: len(values)]


def _inseparable_factors(
    logs: Sequence[PendulumLog], values: Floats, squares: Floats
) -> tuple[float, float]:
    """Range of the factor of ``_scaled_constants`` that the recordings do not separate from 1."""
    lowest, highest = _searched(logs, values)
    limit = _cost(values, logs, squares) * (1.0 + _CHI_SQUARE / _blocks(logs))
    ends = []
    for step in (1.0 / _FACTOR, _FACTOR):
        factor = 1.0
        while True:
            further = _scaled_constants(values, factor * step)
            inside = (further >= lowest).all() and (further <= highest).all()
            if not inside or _cost(further, logs, squares) > limit:
                break
            factor *= step
        ends.append(factor)
    return ends[0], ends[1]


def _intervals(
    logs: Sequence[PendulumLog], values: Floats, squares: Floats
) -> tuple[Floats, Floats]:
    """Ends of the 95 % intervals, by blocks of errors (a sandwich), within the ranges.

    A model that is wrong leaves errors that last: within a block they count as one, so that the
    intervals grow with the blocks' sums, not shrink with the number of samples. Values that the
    logs do not determine have an interval as wide as their range.
    """
    lowest, highest = _searched(logs, values)
    width = highest - lowest
    steps = _FINE_TURN * np.maximum(np.abs(values), 0.01 * width)
    steps[FITTED:] = _BACKLASH_TURN * values[FITTED:]
    jacobian = (
        width
        / (2.0 * steps)
        * np.stack(
            [
                _errors(values + turn, logs, squares, FINE_S)
                - _errors(values - turn, logs, squares, FINE_S)
                for turn in np.diag(steps)
            ],
            axis=1,
        )
    )  # of each constant in units of its range
    errors = _errors(values, logs, squares, FINE_S)
    weight = 1.0 / np.sqrt(1.0 + (errors / _OUTLIER_RAD) ** 2)
    blocks = np.concatenate(
        [1000 * k + (log.time_s / _BLOCK_S).astype(int) for k, log in enumerate(logs)]
    )
    sums = np.stack(
        [
            (jacobian[block] * (weight[block] * errors[block])[:, None]).sum(axis=0)
            for block in (blocks == block for block in np.unique(blocks))
        ]
    )
    # a prior as wide as the range keeps undetermined values from inflating the rest
    curvature = (jacobian * weight[:, None]).T @ jacobian
    noise = float((weight * errors**2).mean())
    bread = np.linalg.inv(curvature + noise * np.eye(len(values)))
    degrees = max(len(sums) - len(values), 1)
    score_covariance = sums.T @ sums * len(sums) / degrees + noise * np.eye(len(values)) * noise
    spread = np.sqrt(np.diag(bread @ score_covariance @ bread)) * width
    reach = float(student.ppf(0.5 + 0.5 * _COVERAGE, degrees)) * spread
    reach = np.maximum(reach, _LEAST_SHARE * np.abs(values))
    low, high = np.maximum(values - reach, lowest), np.minimum(values + reach, highest)
    if not low[[NAMES.index(name) for name in _SLOW_TERMS]].any():
        # whether friction grows when the shaft is slow is open, so how slow is open, too
        shape = [NAMES.index(name) for name in ("stribeck_rad_s", "stribeck_exponent")]
        low[shape], high[shape] = lowest[shape], highest[shape]
    return low, high
