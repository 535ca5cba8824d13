"""Chain load: estimates of the chain's current, and of the motors' winding temperatures.

Servos report motor currents. A bridge draws less from the supply, by its duty: at the voltage V a
motor at the current I and the speed w has the duty (R I + K w) / V. The windings are hotter than
the housings, whose sensors react in minutes: the difference follows the loss R I^2 with a time
constant of seconds.
"""

import math

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.types import JointState

WINDING_SHARE = 1.0
"""Thermal resistance from winding to housing, of that from housing to air in the model's file
(ours). Catalogues of coreless motors of 16 mm give a quarter for the bare motor; in a servo the
case cools it, and nobody has measured a servo's winding here."""
WINDING_TIME_S = 12.0
"""Time constant of the winding (ours); catalogues of coreless motors of 16 mm give 5 to 15 s."""
LONGEST_STEP_S = 1.0
"""A pause between two states counts as this much, s (ours)."""
_FLOATS = readonly_array()


class ChainLoad:
    """Total current, charge and winding temperatures of J servos; ``update`` with every state."""

    def __init__(self, motor: Floats) -> None:
        """Start cold, with ``motor_columns`` (5, J).

        Rows: resistance, ohm; back-EMF, V s/rad; current at rest, A; heating of the housing, K/W;
        nominal voltage, V.
        """
        self._motor = motor
        self.winding_k = np.zeros(motor.shape[1])
        """(J,) by which the windings are hotter than their housings."""
        self.current_a = 0.0
        """Current that the chain draws now, A."""
        self.charge_ah = 0.0
        """Charge that the chain has drawn since the start, A h."""
        self.hottest_c = -math.inf
        """Temperature of the hottest winding; -inf before one is known."""
        self._time_s = math.inf

    def update(self, state: JointState) -> None:
        """Evaluate a state."""
        step_s = min(max(state.time_s - self._time_s, 0.0), LONGEST_STEP_S)
        self._time_s = state.time_s
        share = -math.expm1(-step_s / WINDING_TIME_S)
        self.current_a, self.hottest_c = _draw(
            state.current_a,
            state.velocity_rad_s,
            state.voltage_v,
            state.temperature_c,
            self._motor,
            WINDING_SHARE,
            share,
            self.winding_k,
        )
        self.charge_ah += self.current_a * step_s / 3600.0

    def winding_c(self, state: JointState) -> Floats:
        """(J,) winding temperatures; NaN if the housing's is unknown."""
        return state.temperature_c + self.winding_k


def motor_columns(robot: RobotConfig) -> Floats:
    """(5, J) motors of a robot for ``ChainLoad``; zeros for a model without a record."""
    columns = []
    for facts in robot.servo_records:
        motor = facts.motor
        if motor is None:
            columns.append((0.0, 0.0, 0.0, 0.0, robot.servo.supply_v))
            continue
        no_load_rad_s = motor.no_load_rpm * math.tau / 60.0
        columns.append(
            (
                motor.nominal_v / motor.stall_current_a,
                motor.nominal_v / no_load_rad_s,
                motor.standby_a,
                motor.winding_k_per_w,
                motor.nominal_v,
            )
        )
    return np.array(columns).T.copy()


@compiled(
    f"UniTuple(float64, 2)({', '.join([_FLOATS] * 4)}, float64[:, ::1], float64, float64,"
    " float64[::1])",
    makes_arrays=False,
)
def _draw(
    current_a: Floats,
    velocity_rad_s: Floats,
    voltage_v: Floats,
    temperature_c: Floats,
    motor: Floats,
    winding_share: float,
    time_share: float,
    winding_k: Floats,
) -> tuple[float, float]:
    """Supply current of all bridges, A, and temperature of the hottest winding.

    ``winding_k`` (J,) moves towards its equilibrium. An unread current or speed (NaN) counts as
    zero, a voltage as nominal; a winding without a temperature is ignored.
    """
    total_a = 0.0
    hottest_c = -np.inf
    for k in range(len(current_a)):
        resistance_ohm = motor[0, k]
        emf_v_s = motor[1, k]
        standby_a = motor[2, k]
        amps = current_a[k] if np.isfinite(current_a[k]) else 0.0
        speed = velocity_rad_s[k] if np.isfinite(velocity_rad_s[k]) else 0.0
        volts = voltage_v[k] if voltage_v[k] > 0.0 else motor[4, k]
        duty = min(abs(resistance_ohm * amps + emf_v_s * speed) / volts, 1.0)
        total_a += standby_a + duty * abs(amps)
        target_k = winding_share * motor[3, k] * resistance_ohm * amps * amps
        winding_k[k] += time_share * (target_k - winding_k[k])
        if temperature_c[k] + winding_k[k] > hottest_c:  # noqa: PLR1730  skips NaN
            hottest_c = temperature_c[k] + winding_k[k]
    return total_a, hottest_c
