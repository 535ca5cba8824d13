"""What the servos do in time: registers drive the motors, the shafts show in the registers.

Order of one look: physics is stepped to the time of the look (cut where a watchdog runs out or a
protection is due), and only then registers are read or written.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.bus.bank import CURRENT_POSITION_MODE, EXTENDED_MODE, POSITION_MODE, ServoBank
from sim.bus.motor import MOTORS, PWM_FULL, TICKS_PER_RAD, TICKS_PER_REV, make_drive, p_gain_per_rad
from sim.bus.registers import EXTENDED_RANGE_TICKS, WATCHDOG_TRIPPED
from sim.plant import Plant

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CENTRE_TICKS = 2048
"""Present Position(132) of a straight joint."""
VELOCITY_UNIT_RAD_S = 0.229 * 2.0 * np.pi / 60.0
"""Present Velocity(128): 0.229 rev/min a unit, e-manual."""
WATCHDOG_UNIT_S = 0.02
SLICE_S = 0.05
"""How often heat, supply and overload are looked at; the shafts are seen far more often."""
OVERLOAD_S = 1.0
"""How long a blocked motor at full output is borne (ours: "persistent load", e-manual)."""
REVERSE = 0x01
"""Drive Mode(10), bit 0."""
VOLTAGE_ERROR, OVERHEATING_ERROR, OVERLOAD_ERROR = 0x01, 0x04, 0x20
"""Bits of Hardware Error Status(70) and Shutdown(63)."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Supply and air."""

    supply_v: float = 12.0
    supply_ohm: float = 0.02
    """Of battery and cable together: the voltage sags with the current of all servos."""
    ambient_c: float = 25.0


class Firmware:
    """Servos of ``bank`` on the shafts of ``plant``, in the order of the bank's rows."""

    def __init__(
        self, bank: ServoBank, plant: Plant, surroundings: Surroundings | None = None
    ) -> None:
        joints = len(bank)
        self.bank = bank
        self.plant = plant
        self.around = surroundings if surroundings is not None else Surroundings()
        self.motor = MOTORS[bank.model]
        self.drive = make_drive([self.motor] * joints, self.around.supply_v)
        self.temperature_c = np.full(joints, self.around.ambient_c)
        self._start_s = self._time_s = plant.time_s
        self._slice_s = self._time_s + SLICE_S
        self._heard_s = self._time_s
        self._watchdog_s = np.inf
        self._heat_j = np.zeros(joints)
        self._blocked_s = np.zeros(joints)
        self._turns = np.zeros(joints)
        self._was_on = np.zeros(joints, bool)
        self._was_mode = bank["Operating Mode"].copy()
        self._held = np.zeros(joints, bool)
        self.changed()
        self.power_up(np.arange(joints))

    # time

    def advance(self, until_s: float) -> None:
        """Step physics, watchdog, heat and protections to ``until_s``."""
        while self._time_s < until_s:
            stop_s = min(until_s, self._slice_s, self._watchdog_s)
            self.plant.advance(stop_s, self.drive)
            amps = self.drive.current_a
            self._heat_j += amps * amps * ((stop_s - self._time_s) * self.motor.resistance_ohm)
            self._time_s = stop_s
            if stop_s >= self._watchdog_s:
                self._trip_watchdog()
            if stop_s >= self._slice_s:
                self._protect()
                self._slice_s += SLICE_S

    def heard(self, time_s: float) -> None:
        """Feed the watchdogs: any instruction packet does, whoever it is for (e-manual)."""
        self._heard_s = time_s
        self._arm_watchdog()

    # registers to motors

    def changed(self) -> None:
        """Take over registers after a write of anything but goal positions alone."""
        bank, drive = self.bank, self.drive
        mode = bank["Operating Mode"]
        on = bank["Torque Enable"] == 1
        again = (mode == POSITION_MODE) & ((on & ~self._was_on) | (mode != self._was_mode))
        self._sign = np.where(bank["Drive Mode"] & REVERSE, -1.0, 1.0)
        if again.any():
            self._forget_turns(again)
        self._zero = CENTRE_TICKS + bank["Homing Offset"] - TICKS_PER_REV * self._turns
        self._was_on, self._was_mode = on, mode.copy()
        tripped = bank["Bus Watchdog"] == WATCHDOG_TRIPPED
        self._held &= tripped
        driven = np.isin(mode, (POSITION_MODE, EXTENDED_MODE, CURRENT_POSITION_MODE))
        drive.torque_on[:] = on & driven
        drive.p_gain_per_rad[:] = p_gain_per_rad(bank["Position P Gain"], self.motor)
        drive.pwm_limit[:] = np.abs(bank["Goal PWM"]) / PWM_FULL
        limited = mode == CURRENT_POSITION_MODE
        goal_a = np.abs(bank["Goal Current"]) * self.motor.current_unit_a
        drive.current_limit_a[:] = np.where(limited, goal_a, np.inf)
        single = mode == POSITION_MODE
        low = np.where(single, bank["Min Position Limit"].astype(int), -EXTENDED_RANGE_TICKS)
        high = np.where(single, bank["Max Position Limit"].astype(int), EXTENDED_RANGE_TICKS)
        self._low = np.where(tripped, EXTENDED_RANGE_TICKS + 1, low)
        self._high = np.where(tripped, -EXTENDED_RANGE_TICKS - 1, high)
        self._aim()
        self._arm_watchdog()

    def write_goals(self, rows: NDArray[np.intp] | slice, ticks: NDArray[np.int32]) -> None:
        """Goal Position(116) of many servos at once; values out of limits are refused."""
        goal = self.bank["Goal Position"]
        taken = (ticks >= self._low[rows]) & (ticks <= self._high[rows])
        goal[rows] = ticks if taken.all() else np.where(taken, ticks, goal[rows])
        self._aim()

    def reboot(self, row: int, factory_keeping: tuple[str, ...] | None = None) -> None:
        """Restart one servo; with ``factory_keeping``, first reset all but these registers."""
        rows = np.array([row])
        if factory_keeping is None:
            self.bank.reset(rows, keep=(), ram_only=True)
        else:
            self.bank.reset(rows, keep=factory_keeping)
        self.power_up(rows)

    def power_up(self, rows: NDArray[np.intp]) -> None:
        """After power-on or reboot: one turn of position, goal = present, protections cleared."""
        self._forget_turns(np.isin(np.arange(len(self.bank)), rows))
        self._blocked_s[rows] = 0.0
        self._was_on[rows] = False
        self.changed()
        self.refresh()
        self.bank["Goal Position"][rows] = self.bank["Present Position"][rows]
        self._aim()

    def clear_turns(self, row: int) -> bool:
        """Clear instruction: position back into one turn; refused (False) while moving."""
        if abs(self.plant.velocity_rad_s[row]) > self._moving_rad_s()[row]:
            return False
        self._forget_turns(np.arange(len(self.bank)) == row)
        self.changed()
        return True

    # shafts to registers

    def refresh_motion(self) -> None:
        """Present Current, Velocity and Position(126, 128, 132)."""
        bank, sign = self.bank, self._sign
        scale = sign / self.motor.current_unit_a
        bank["Present Current"][:] = np.rint(self.drive.current_a * scale)
        bank["Present Velocity"][:] = np.rint(
            self.plant.velocity_rad_s * (sign / VELOCITY_UNIT_RAD_S)
        )
        bank["Present Position"][:] = np.rint(
            self.plant.position_rad * (sign * TICKS_PER_RAD) + self._zero
        )

    def refresh(self) -> None:
        """All present values."""
        bank = self.bank
        self.refresh_motion()
        bank["Present PWM"][:] = np.rint(self.drive.pwm * self._sign * PWM_FULL)
        bank["Position Trajectory"][:] = bank["Goal Position"]
        bank["Present Input Voltage"][:] = np.rint(self.drive.supply_v * 10.0)
        bank["Present Temperature"][:] = np.clip(np.rint(self.temperature_c), 0, 255)
        bank["Moving"][:] = np.abs(self.plant.velocity_rad_s) > self._moving_rad_s()
        bank["Realtime Tick"][:] = int((self._time_s - self._start_s) * 1e3) % 32_768

    # inside

    def _moving_rad_s(self) -> Floats:
        return np.asarray(self.bank["Moving Threshold"] * VELOCITY_UNIT_RAD_S)

    def _aim(self) -> None:
        goal = (self.bank["Goal Position"] - self._zero) * (self._sign / TICKS_PER_RAD)
        if self._held.any():
            goal = np.where(self._held, self.drive.goal_rad, goal)
        self.drive.goal_rad[:] = goal

    def _forget_turns(self, which: NDArray[np.bool_]) -> None:
        ticks = np.rint(self.plant.position_rad * self._sign * TICKS_PER_RAD) + CENTRE_TICKS
        self._turns[which] = np.floor(ticks / TICKS_PER_REV)[which]

    def _arm_watchdog(self) -> None:
        dog = self.bank["Bus Watchdog"]
        armed = (dog > 0) & (dog < WATCHDOG_TRIPPED) & self._was_on
        self._watchdog_s = (
            self._heard_s + WATCHDOG_UNIT_S * float(dog[armed].min()) if armed.any() else np.inf
        )

    def _trip_watchdog(self) -> None:
        dog = self.bank["Bus Watchdog"]
        late = (dog > 0) & (dog < WATCHDOG_TRIPPED) & self._was_on
        late &= self._heard_s + WATCHDOG_UNIT_S * dog <= self._time_s + 1e-9
        dog[late] = WATCHDOG_TRIPPED
        self._held |= late
        self.drive.goal_rad[late] = self.plant.position_rad[late]
        self.changed()

    def _protect(self) -> None:
        bank, drive, motor = self.bank, self.drive, self.motor
        decay = np.exp(-SLICE_S / motor.thermal_time_s)
        target = self.around.ambient_c + motor.winding_k_per_w * self._heat_j / SLICE_S
        self.temperature_c += (target - self.temperature_c) * (1.0 - decay)
        self._heat_j[:] = 0.0
        drawn_a = float(np.abs(drive.pwm * drive.current_a).sum()) + motor.standby_a * len(bank)
        volts = self.around.supply_v - self.around.supply_ohm * drawn_a
        drive.supply_v[:] = volts
        full = np.abs(drive.pwm) >= 0.98 * drive.pwm_limit
        yielding_rad_s = np.sign(drive.pwm) * self.plant.velocity_rad_s
        blocked = full & (yielding_rad_s < 0.05 * motor.no_load_rad_s)
        self._blocked_s = np.where(blocked & (drive.torque_on > 0), self._blocked_s + SLICE_S, 0.0)
        tenths = round(volts * 10.0)
        outside = (tenths < bank["Min Voltage Limit"]) | (tenths > bank["Max Voltage Limit"])
        errors = (
            VOLTAGE_ERROR * outside
            | OVERHEATING_ERROR * (np.rint(self.temperature_c) > bank["Temperature Limit"])
            | OVERLOAD_ERROR * (self._blocked_s >= OVERLOAD_S)
        )
        if errors.any():
            status = bank["Hardware Error Status"]
            status |= errors.astype(np.uint8)
            shut = (status & bank["Shutdown"]) != 0
            bank["Torque Enable"][shut] = 0
            self.changed()
