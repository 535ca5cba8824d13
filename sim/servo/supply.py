"""Supply voltage of the servos of a chain: source, leads, cables between neighbours."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Indices
from snakewalk.config.robot import PowerConfig, RobotConfig
from snakewalk.drivers.compiling import compiled, readonly_array

SOURCE_OHM = 0.02
"""Resistance of battery and cable together: the voltage sags with the current of all servos on it
(ours)."""
_ROW = readonly_array(layout="C")


class Supply:
    """Supply of S servos, by default ``usual_v`` (one, or (S,))."""

    def __init__(self, servos: int, usual_v: ArrayLike) -> None:
        self.usual_v: Floats = np.full(servos, usual_v, dtype=np.float64)
        self._volts = self.usual_v.copy()
        self._override_v = np.full(servos, np.nan)
        self._overridden = False

    @property
    def source_v(self) -> float:
        """Voltage of the common source."""
        return float(self._volts[0])

    def change(self, volts: float | None, rows: Indices | None = None) -> None:
        """Set another voltage for the chain, or for ``rows``; None: the usual voltage."""
        if rows is None:
            self._volts[:] = self.usual_v if volts is None else volts
            return
        self._override_v[rows] = np.nan if volts is None else volts
        self._overridden = not np.isnan(self._override_v).all()

    def feed(self, supply_v: Floats, drop_v: Floats | float = 0.0) -> None:
        """Set ``supply_v`` (S,) to the chain's voltage minus the cable's drop ``drop_v``."""
        np.subtract(self._volts, drop_v, out=supply_v)
        if self._overridden:
            is_derived = ~np.isnan(self._override_v)
            supply_v[is_derived] = self._override_v[is_derived]


@dataclass(frozen=True, slots=True)
class Cabling:
    """Power cables of S servos in the order of the chain.

    A cable's resistance is that of both conductors and all contacts.
    """

    cable_ohm: Floats
    """(S - 1,) of the cable behind each servo but the last."""
    lead_ohm: Floats
    """(S,) of the source's lead that ends at each servo; infinite where none does."""

    @staticmethod
    def of(robot: RobotConfig, power: PowerConfig) -> "Cabling":
        """Cables and leads of a robot from ``power``."""
        ids = robot.servo_ids
        cables_ohm = power.cables_ohm or (power.cable_ohm,) * (len(ids) - 1)
        is_fed = power.inject_ids or ids[:1]
        lead_ohm = [power.lead_ohm if servo_id in is_fed else math.inf for servo_id in ids]
        return Cabling(np.array(cables_ohm, dtype=np.float64), np.array(lead_ohm))

    def servo_v(
        self, source_v: float, source_ohm: float, drawn_a: ArrayLike, slope_s: ArrayLike = 0.0
    ) -> Floats:
        """(S,) voltage at the servos.

        Args:
            source_v: of the source without load.
            source_ohm: common resistance of all leads.
            drawn_a: (S,) current of each servo, linearly extrapolated to 0 V, A.
            slope_s: (S,) additional current per volt, siemens; 0: a constant current.

        """
        servos = len(self.lead_ohm)
        drawn = np.ascontiguousarray(np.broadcast_to(drawn_a, servos), dtype=np.float64)
        slope = np.ascontiguousarray(np.broadcast_to(slope_s, servos), dtype=np.float64)
        out = np.empty(servos)
        servo_voltages(source_v, source_ohm, drawn, slope, self.cable_ohm, self.lead_ohm, out)
        return out

    def cable_a(self, servo_v: Floats) -> Floats:
        """(S - 1,) current through each cable, positive away from the first servo."""
        return (servo_v[:-1] - servo_v[1:]) / self.cable_ohm


@compiled(f"void(float64, float64, {_ROW}, {_ROW}, {_ROW}, {_ROW}, float64[::1])")
def servo_voltages(
    source_v: float,
    source_ohm: float,
    drawn_a: Floats,
    slope_s: Floats,
    cable_ohm: Floats,
    lead_ohm: Floats,
    out: Floats,
) -> None:
    """Voltage at each servo of a ladder, into ``out``; arguments as ``Cabling.servo_v``.

    Kirchhoff's law at each servo is a row of a tridiagonal system (Thomas algorithm). The common
    resistance of the leads couples all rows by the rail voltage, in which the servos' voltages are
    linear. So the sweep runs for a rail of 0 V and for each volt of it.
    """
    servos = len(out)
    upper = np.empty(servos)
    per_volt = np.empty(servos)
    for k in range(servos):
        lead_s = 1.0 / lead_ohm[k]
        before_s = 1.0 / cable_ohm[k - 1] if k > 0 else 0.0
        behind_s = 1.0 / cable_ohm[k] if k + 1 < servos else 0.0
        pivot = lead_s + before_s + behind_s + slope_s[k]
        at_zero, at_volt = -drawn_a[k], lead_s
        if k > 0:
            pivot -= before_s * upper[k - 1]
            at_zero += before_s * out[k - 1]
            at_volt += before_s * per_volt[k - 1]
        upper[k] = behind_s / pivot
        out[k] = at_zero / pivot
        per_volt[k] = at_volt / pivot
    drawn_0, drawn_v = 0.0, 0.0  # of all servos at a rail of 0 V, and per volt
    for back in range(servos):
        k = servos - 1 - back
        if back > 0:
            out[k] += upper[k] * out[k + 1]
            per_volt[k] += upper[k] * per_volt[k + 1]
        drawn_0 += drawn_a[k] + slope_s[k] * out[k]
        drawn_v += slope_s[k] * per_volt[k]
    rail_v = (source_v - source_ohm * drawn_0) / (1.0 + source_ohm * drawn_v)
    for k in range(servos):
        out[k] += rail_v * per_volt[k]
