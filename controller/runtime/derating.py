"""Slows a motion before a servo trips: heat, current, supply and lag against the limits.

The rate is 1 normally and falls to ``LEAST`` near a limit, so a motion continues slower, cooler and
with less current. It falls quickly and recovers slowly. The safety layer is unchanged.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.link import LoadEstimate
from snakewalk.drivers.types import JointState

LEAST = 0.25
"""Lowest rate; a motion that stands still looks like one that hangs."""
HEAT_BAND_C = 10.0
"""Range of temperatures below the limit in which the rate falls, and its end ``HEAT_EDGE_C`` below
the limit."""
HEAT_EDGE_C = 2.0
CURRENT_START, CURRENT_END = 0.75, 0.98
"""Shares of the current limit."""
VOLTAGE_BAND, VOLTAGE_EDGE = 1 / 15, 1 / 60
"""Shares of the supply, above the least one: 0.8 and 0.2 V of 12 V."""
FALL_S, RISE_S = 0.4, 6.0
"""Time constants of the rate."""
LAG_START, LAG_END = 0.6, 0.95
"""Shares of the following error's limit; a healthy lag uses half of it at most. A current-limited
joint does not count: the ground may hold it off at any rate."""
AVERAGE_S = 0.2
"""Averaging time of current and lag: a peak is not a load."""
WINDING_BAND_C, WINDING_EDGE_C = 25.0, 5.0
"""Range of winding temperatures below the limit in which the rate falls, and its end below the
limit."""
REPORT_BELOW, REPORT_ABOVE = 0.95, 0.99


@dataclass(frozen=True, slots=True)
class Allowed:
    """Rate that a state allows."""

    rate: float
    """Rate of the motion, from 1 down to ``LEAST``."""
    reason: str
    """Limiting quantity, one line; empty at 1."""


UNLIMITED = Allowed(1.0, "")


def allowed(
    state: JointState,
    current_a: Floats,
    lag_rad: Floats,
    safety: SafetyConfig,
    robot: RobotConfig,
) -> Allowed:
    """Return the rate that a state allows; values that were not read yet (NaN) limit nothing.

    Args:
        state: of the servos.
        current_a: (J,) averaged magnitudes.
        lag_rad: (J,) averaged distances from the goals.
        safety: the limits at which servos are stopped.
        robot: names the joints.

    """
    heat = state.temperature_c
    amps = current_a
    volts = state.voltage_v
    limit_c = safety.temperature_limit_c
    limit_a = safety.current_limit_of_a(robot)
    voltage_min_v = safety.voltage_limits_v(robot.servo)[0]
    limit_rad = _lag_limits_rad(safety, robot)
    band_v, edge_v = VOLTAGE_BAND * robot.servo.supply_v, VOLTAGE_EDGE * robot.servo.supply_v
    ratings = (
        (_falling(heat, limit_c - HEAT_BAND_C, limit_c - HEAT_EDGE_C), heat, "{:.0f} C", limit_c),
        (
            _falling(amps, CURRENT_START * limit_a, CURRENT_END * limit_a),
            amps,
            "{:.2f} A",
            limit_a,
        ),
        (
            _falling(-volts, -voltage_min_v - band_v, -voltage_min_v - edge_v),
            volts,
            "{:.1f} V",
            voltage_min_v,
        ),
        (
            _falling(lag_rad, LAG_START * limit_rad, LAG_END * limit_rad),
            lag_rad,
            "{:.2f} rad from its goal",
            limit_rad,
        ),
    )
    rates, values, unit, limit = min(ratings, key=lambda rating: float(rating[0].min()))
    joint = int(np.argmin(rates))
    rate = LEAST + (1.0 - LEAST) * float(rates[joint])
    if rate >= 1.0:
        return UNLIMITED
    reached = unit.format(values[joint])
    most = unit.format(np.full(len(rates), limit)[joint]).removesuffix(" from its goal")
    return Allowed(rate, f"{robot.joint_label(joint)} at {reached}, limit {most}")


def _lag_limits_rad(safety: SafetyConfig, robot: RobotConfig) -> Floats:
    """(J,) limits of the following error; inf where the current is limited."""
    limited = np.isfinite(robot.current_limits_a)
    return np.where(limited, np.inf, safety.following_limits_rad(robot))


@compiled(
    f"boolean(float64[::1], float64[::1], {', '.join([readonly_array()] * 3)}, float64,"
    f" {', '.join([readonly_array()] * 3)}, float64, float64, float64)",
    makes_arrays=False,
)
def _needs_no_limit(
    mean_a: Floats,
    lag_rad: Floats,
    current_a: Floats,
    goal_rad: Floats,
    position_rad: Floats,
    share: float,
    heat_c: Floats,
    voltage_v: Floats,
    lag_max_rad: Floats,
    current_max_a: float,
    temperature_max_c: float,
    voltage_min_v: float,
) -> bool:
    """Average ``mean_a`` and ``lag_rad`` on; return whether ``allowed`` finds nothing to limit.

    Values that were not read yet (NaN) limit nothing; a mean current that is NaN is not well.
    """
    well = True
    for joint in range(len(mean_a)):
        mean_a[joint] += share * (abs(current_a[joint]) - mean_a[joint])
        lag_rad[joint] += share * (abs(goal_rad[joint] - position_rad[joint]) - lag_rad[joint])
        if (
            not mean_a[joint] <= current_max_a
            or heat_c[joint] > temperature_max_c
            or voltage_v[joint] < voltage_min_v
            or lag_rad[joint] > lag_max_rad[joint]
        ):
            well = False
    return well


def _falling(values: Floats, start: Floats | float, end: Floats | float) -> Floats:
    """1 up to ``start``, 0 from ``end`` on, a line between; 1 for NaN and where ``end`` is inf."""
    with np.errstate(invalid="ignore"):
        share = np.clip((end - values) / np.subtract(end, start), 0.0, 1.0)
    return np.where(np.isnan(share), 1.0, share)


class Derating:
    """Call ``update`` in every cycle; multiplies the rate of whatever moves."""

    def __init__(
        self,
        safety: SafetyConfig,
        robot: RobotConfig,
        on_event: Callable[[str, str], None] = lambda kind, text: None,
        load: LoadEstimate | None = None,
    ) -> None:
        self.rate = 1.0
        self.least = 1.0
        """Lowest rate of the motion so far."""
        self._safety = safety
        self._robot = robot
        self._load = load
        power = robot.power
        self._fuse_a = math.inf if power is None or power.fuse_a is None else power.fuse_a
        servo = robot.servo
        self._current_start_a = CURRENT_START * safety.current_limit_of_a(robot)
        self._voltage_low_v = safety.voltage_limits_v(servo)[0] + VOLTAGE_BAND * servo.supply_v
        self._on_event = on_event
        self._lag_start_rad = LAG_START * _lag_limits_rad(safety, robot)
        self._current_a = self._lag_rad = np.zeros(0)
        self._is_reported = False

    def update(self, state: JointState, goal_rad: Floats, dt_s: float) -> float:
        """Process a state and the goals before it; return the rate, LEAST to 1.

        ``on_event`` receives large changes.
        """
        safety = self._safety
        if len(self._current_a) != len(state.current_a):
            self._current_a = np.zeros(len(state.current_a))
            self._lag_rad = np.zeros(len(state.current_a))
        unlimited = _needs_no_limit(
            self._current_a,
            self._lag_rad,
            state.current_a,
            goal_rad,
            state.position_rad,
            min(1.0, dt_s / AVERAGE_S),
            state.temperature_c,
            state.voltage_v,
            self._lag_start_rad,
            self._current_start_a,
            safety.temperature_limit_c - HEAT_BAND_C,
            self._voltage_low_v,
        )
        means = self._current_a, self._lag_rad
        now = UNLIMITED if unlimited else allowed(state, *means, safety, self._robot)
        if self._load is not None:
            now = min(
                now, self._allowed_by_load(self._load, state), key=lambda allowance: allowance.rate
            )
        if now.rate == self.rate:
            return self.rate
        time_s = FALL_S if now.rate < self.rate else RISE_S
        self.rate += min(1.0, dt_s / time_s) * (now.rate - self.rate)
        if now.rate == 1.0 and self.rate > 0.999:
            self.rate = 1.0
        self.least = min(self.least, self.rate)
        if not self._is_reported and self.rate < REPORT_BELOW:
            self._is_reported = True
            self._on_event("derating", f"slowing down: {now.reason}")
        elif self._is_reported and self.rate > REPORT_ABOVE:
            self._is_reported = False
            self._on_event("derating", "at full rate again")
        return self.rate

    def _allowed_by_load(self, load: LoadEstimate, state: JointState) -> Allowed:
        """Return the rate that the supply's fuse and the windings allow."""
        fuse_a = self._fuse_a
        limit_c = self._safety.winding_limit_c
        if (
            load.current_a <= CURRENT_START * fuse_a
            and not load.hottest_c > limit_c - WINDING_BAND_C
        ):
            return UNLIMITED
        windings_c = load.winding_c(state)
        rates = _falling(windings_c, limit_c - WINDING_BAND_C, limit_c - WINDING_EDGE_C)
        joint = int(np.argmin(rates))
        by_fuse = 1.0
        if math.isfinite(fuse_a):
            amps = np.array([load.current_a])
            by_fuse = float(_falling(amps, CURRENT_START * fuse_a, CURRENT_END * fuse_a)[0])
        rate = LEAST + (1.0 - LEAST) * min(by_fuse, float(rates[joint]))
        if by_fuse <= rates[joint]:
            return Allowed(rate, f"the chain at {load.current_a:.1f} A, fuse {fuse_a:g} A")
        name = self._robot.joint_label(joint)
        return Allowed(rate, f"winding of {name} at {windings_c[joint]:.0f} C, limit {limit_c:g} C")
