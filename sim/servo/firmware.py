"""The servos' firmware: registers drive the motors, and the shafts show in the registers.

Physics is first stepped to the time of an access (with stops for watchdogs and protections); only
then are registers read or written.
"""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Bools, Bytes, Indices
from snakewalk.config.servo_model import TABLE_BYTES
from snakewalk.drivers.protocol.registers import (
    CURRENT_MODE,
    CURRENT_POSITION_MODE,
    POSITION_MODE,
    PWM_MODE,
    REVERSE,
    TORQUE_ON_BY_GOAL,
    WATCHDOG_TRIPPED,
    WATCHDOG_UNIT_S,
)
from snakewalk.sim.plant import Mounting, Plant
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.blocked_shaft import BlockedShaft
from snakewalk.sim.servo.constant_readings import ConstantReadings
from snakewalk.sim.servo.control_loops import CONTROL_S, ControlLoops
from snakewalk.sim.servo.event_queue import EventQueue
from snakewalk.sim.servo.motor import (
    MotorColumns,
    MotorModel,
    make_drive,
)
from snakewalk.sim.servo.motor_output import MotorOutput
from snakewalk.sim.servo.present_values import PresentValues
from snakewalk.sim.servo.protection import SLICE_S, Protection, SupplyAndAmbient
from snakewalk.sim.servo.register_rules import PROFILE
from snakewalk.sim.servo.servo_loops import accept_goals
from snakewalk.sim.servo.simulated_servos import FaultyServos

ROUNDING_S = 1e-9
"""Largest difference between two times that count as the same."""


class Watchdog:
    """The watchdogs of all servos of a bank, fed until ``time_s``."""

    def __init__(self, bank: ServoBank, time_s: float) -> None:
        self._bank = bank
        self.fed_s = time_s
        """Time at which the servos' watchdogs were last fed."""
        self.timeout_s = np.inf
        """Shortest timeout of the servos' watchdogs."""
        self._watched = np.zeros(len(bank), bool)
        self.due_s = np.inf
        """Time at which the first watchdog expires."""

    def arm(self, on: Bools) -> None:
        """Read the register; ``on`` (S,) marks servos with torque."""
        dog = self._bank["Bus Watchdog"]
        self._watched = (dog > 0) & (dog < WATCHDOG_TRIPPED) & on
        watched = self._watched
        self.timeout_s = WATCHDOG_UNIT_S * float(dog[watched].min()) if watched.any() else np.inf
        self.due_s = self.fed_s + self.timeout_s

    def trip(self, time_s: float) -> Bools:
        """Put servos whose watchdog expired by ``time_s`` into the error state; return (S,)."""
        dog = self._bank["Bus Watchdog"]
        late = self._watched & (self.fed_s + WATCHDOG_UNIT_S * dog <= time_s + ROUNDING_S)
        dog[late] = WATCHDOG_TRIPPED
        return late


FAR_RAD = 1e9
"""Goal of a motor that only has to push: the output saturates at its limit."""
_BEYOND_GOALS = 1 << 40
"""Beyond every goal."""
STARTUP_TORQUE_ON = 0x01
STARTUP_RAM_RESTORE = 0x02
"""Startup Configuration(60)."""


class Firmware(FaultyServos):
    """Servos of ``bank`` on the shafts of ``plant``, in the order of the bank's rows.

    ``motors`` (S,) are by default those of the models.
    """

    protection: Protection

    def __init__(
        self,
        bank: ServoBank,
        plant: Plant,
        supply_and_ambient: SupplyAndAmbient | None = None,
        mounting: Mounting | None = None,
        motors: Sequence[MotorModel] | None = None,
    ) -> None:
        joints = len(bank)
        mounted = mounting or Mounting(np.ones(joints), np.zeros(joints))
        self._mounted_sign = mounted.sign
        # a whole number of positions, so that a mirrored servo's numbers are exact mirror images
        self._scales = scales = bank.scales
        self._mounted_ticks = np.rint(mounted.zero_rad * scales.positions_per_rad)
        self._extended = np.array([bank.range_of(row, "Goal Position") for row in range(joints)]).T
        self.bank = bank
        self.plant = plant
        if motors is None:
            motors = [MotorModel.of(fact) for fact in bank.facts]
        self._motor = motor = MotorColumns(motors)
        around = supply_and_ambient or SupplyAndAmbient()
        usual_v = motor.nominal_v if around.supply_v is None else around.supply_v
        self.drive = make_drive(motors, usual_v)
        self.blocked_shaft = BlockedShaft(self.drive)
        self._motor_output = MotorOutput(self.drive, self.blocked_shaft)
        self.protection = Protection(bank, self.drive, motor, around, self._motor_output)
        self._time_s = plant.time_s
        self._slice_s = self._time_s + SLICE_S
        self._watchdog = Watchdog(bank, self._time_s)
        self._turns = np.zeros(joints)
        self._last_on = np.zeros(joints, bool)
        self._last_mode = bank["Operating Mode"].copy()
        self._held = np.zeros(joints, bool)
        self.powered = np.ones(joints, bool)
        self.no_output = np.zeros(joints, bool)
        self._readings = ConstantReadings(bank.__getitem__)
        self.events = EventQueue()
        self.control_loops = ControlLoops(bank, self.drive, motor)
        self._goal = self.drive.goal_rad.copy()
        self._control_s = self._time_s + CONTROL_S
        self._goal_address = bank.register("Goal Position").address
        self._present_values = PresentValues(
            bank, plant, self.drive, motor, self._motor_output, self.control_loops, self.protection
        )
        self._accepted = np.zeros(joints, bool)
        self.apply_registers()
        self.power_up(np.arange(joints))

    # time

    def advance(self, until_s: float) -> None:
        """Step physics, watchdog, heat and protections to ``until_s``."""
        plant = self.plant
        drive = self.drive
        protection = self.protection
        dog = self._watchdog
        while self._time_s < until_s:
            stop_s = min(until_s, self._slice_s, dog.due_s, self.events.next_s)
            if self.control_loops.active:
                stop_s = min(stop_s, self._control_s)
            plant.advance(stop_s, drive)
            self._time_s = stop_s
            if self.control_loops.active and stop_s >= self._control_s:
                self._control_s = stop_s + CONTROL_S
                self.control_loops.tick(plant, self._goal, self._sign, self._held)
                if self.blocked_shaft.any:
                    loops = self.control_loops
                    self.blocked_shaft.hold(loops.position | loops.velocity)
            if stop_s >= self.events.next_s:
                self.events.run_due(stop_s)
                self.apply_registers()
            if stop_s >= dog.due_s:
                self._hold(dog.trip(stop_s))
            if stop_s >= self._slice_s:
                if protection.check(plant):
                    self.apply_registers()
                self._slice_s += SLICE_S

    def on_instruction(self, time_s: float) -> None:
        """Feed the watchdogs: any instruction packet feeds all of them (e-manual)."""
        dog = self._watchdog
        dog.fed_s, dog.due_s = time_s, time_s + dog.timeout_s

    # from registers to motors

    def apply_registers(self) -> None:
        """Apply the registers after a write of more than goal positions."""
        bank = self.bank
        drive = self.drive
        mode = bank["Operating Mode"]
        on = bank["Torque Enable"] == 1
        switched = np.flatnonzero(mode != self._last_mode)
        if len(switched):
            bank.switch_mode(switched)
        on &= self.powered
        restarted = (mode == POSITION_MODE) & ((on & ~self._last_on) | (mode != self._last_mode))
        reverse = np.where(bank["Drive Mode"] & REVERSE, -1.0, 1.0)
        self._sign = reverse * self._mounted_sign
        self._centre = self._scales.zero_position + reverse * self._mounted_ticks
        if restarted.any():
            self._reset_turns(restarted)
        offset = bank["Homing Offset"].astype(np.int64)
        offset[(mode == POSITION_MODE) & (np.abs(offset) > self._scales.homing_limit)] = 0
        self._zero = self._centre + offset - self._scales.positions_per_turn * self._turns
        self._frame = np.stack([self._sign, self._zero])
        self._last_on, self._last_mode = on, mode.copy()
        self._enabled_by_goals = bool((bank["Drive Mode"] & TORQUE_ON_BY_GOAL).any())
        tripped = bank["Bus Watchdog"] == WATCHDOG_TRIPPED
        self._held &= tripped
        self._holding = bool(self._held.any())
        drive.torque_on[:] = on
        was_active = self.control_loops.active
        self.control_loops.apply_registers(on, self.plant.position_rad)
        if self.control_loops.active and not was_active:
            self._control_s = self._time_s + CONTROL_S
        full = np.abs(bank["Goal PWM"].astype(float)) / self._scales.full_pwm
        drive.pwm_limit[:] = np.where(self.no_output, 0.0, full)
        self.protection.full = np.where(full > 0.0, full, 1.0)  # 0 of 0 means no effort
        self._push = np.zeros(len(bank))
        for pushing, goal in ((PWM_MODE, "Goal PWM"), (CURRENT_MODE, "Goal Current")):
            if goal in bank:
                self._push += (mode == pushing) * self._sign * np.sign(bank[goal]) * FAR_RAD
        self._push[tripped] = 0.0
        self._pushed = bool(((mode == PWM_MODE) | (mode == CURRENT_MODE)).any())
        limited = (mode == CURRENT_POSITION_MODE) | (mode == CURRENT_MODE)
        if "Goal Current" in bank:
            goal_a = np.abs(bank["Goal Current"].astype(float)) * self._motor.current_unit_a
            drive.current_limit_a[:] = np.where(limited, goal_a, np.inf)
            self._motor_output.limited = bool(limited.any())
        single = mode == POSITION_MODE
        low = np.where(single, bank["Min Position Limit"].astype(int), self._extended[0])
        high = np.where(single, bank["Max Position Limit"].astype(int), self._extended[1])
        self._limits = np.where(tripped, [[_BEYOND_GOALS], [-_BEYOND_GOALS]], [low, high])
        self._set_drive_goals()
        self._watchdog.arm(on)

    def write_goals(self, rows: Indices, raw: Bytes, offset: int) -> None:
        """Goal Position(116) of many servos: entries of ``raw`` from ``offset``, ID and 4 bytes.

        Values out of limits are rejected.
        """
        plain = not (
            self._holding or self._pushed or self.control_loops.active or self.blocked_shaft.any
        )
        goal_rad = self.drive.goal_rad if plain else np.empty(len(self.bank))
        table = self.bank.table
        address = self._goal_address
        taken = self._accepted
        limits = self._limits
        frame = self._frame
        per_rad = self._scales.positions_per_rad
        accept_goals(raw, rows, table, offset, address, limits, frame, per_rad, goal_rad, taken)
        if self._enabled_by_goals:
            self.enable_by_goal(np.flatnonzero(taken))
        if not plain:
            self._set_drive_goals()

    def enable_by_goal(self, rows: Indices) -> None:
        """Torque on by goal update (Drive Mode(10), bit 3), unless an error holds it off."""
        for row in rows:
            asks = self.bank["Drive Mode"][row] & TORQUE_ON_BY_GOAL
            if asks and not self.bank.shut_down(int(row)) and not self.bank["Torque Enable"][row]:
                self.bank["Torque Enable"][row] = 1
                self.apply_registers()

    def reboot(self, row: int, factory_keeping: tuple[str, ...] | None = None) -> None:
        """Restart one servo; with ``factory_keeping``, first reset all other registers."""
        rows = np.array([row])
        if factory_keeping is None:
            self.bank.reset(rows, kept_names=(), ram_only=True)
        else:
            self.bank.reset(rows, kept_names=factory_keeping)
        self.power_up(rows)

    def power_up(self, rows: Indices) -> None:
        """State after power-on or reboot: one turn of position, goal = present, no alarms."""
        self._reset_turns(np.isin(np.arange(len(self.bank)), rows))
        self.protection.restart(rows)
        self._last_on[rows] = False
        self._present_values.restart_clock(rows, self._time_s)
        names = "Startup Configuration"
        start = self.bank[names] if names in self.bank else np.zeros(len(self.bank), np.uint8)
        for row in rows:
            if start[row] & STARTUP_RAM_RESTORE:
                self.bank.restore_ram(int(row))
        self.apply_registers()
        self.refresh()
        self.bank["Goal Position"][rows] = self.bank["Present Position"][rows]
        self._set_drive_goals()
        switched_on = rows[(start[rows] & STARTUP_TORQUE_ON) != 0]
        if len(switched_on):
            self.bank["Torque Enable"][switched_on] = 1
            self.apply_registers()

    def clear_turns(self, row: int) -> bool:
        """Clear instruction: position back into one turn; False while moving."""
        if self._present_values.turning()[row]:
            return False
        self._reset_turns(np.arange(len(self.bank)) == row)
        self.apply_registers()
        return True

    def clear_error(self, row: int) -> bool:
        """Clear instruction: clear hardware errors without a cause; False if one remains."""
        self.bank["Hardware Error Status"][row] = 0
        self.protection.restart(np.array([row]))
        self.protection.check(self.plant)
        self.apply_registers()
        return not self.bank["Hardware Error Status"][row]

    def hold_position(self) -> None:
        """Set every goal to the present position, at rest, after a shaft was moved."""
        torque = self.bank["Torque Enable"]
        goal = self.bank["Goal Position"]
        on = torque.copy()
        torque[:] = 0
        self.apply_registers()
        self.refresh()
        goal[:] = self.bank["Present Position"]
        torque[:] = on
        self.apply_registers()

    def restore_power(self, rows: Indices) -> None:
        """Restore the supply: the servos restart without their turn counts."""
        self.powered[rows] = True
        self.bank.reset(rows, kept_names=(), ram_only=True)
        self.power_up(rows)

    # from shafts to registers

    def refresh_motion(self) -> None:
        """Present Current (else Load), Velocity and Position(126, 128, 132)."""
        self._present_values.motion(self._frame)
        if self._readings.any:
            self._readings.apply()

    def refresh(self, address: int = 0, length: int = TABLE_BYTES) -> None:
        """Write the present values, at least those in this block."""
        indirect = self.bank.indirect
        present = self._present_values
        gather = indirect.covers(address, length)
        stop = address + length
        if gather or (address < present.motion_at.stop and stop > present.motion_at.start):
            self.refresh_motion()
            present.path(self._frame, self._time_s)
        if gather or (address < present.supply_at.stop and stop > present.supply_at.start):
            present.supply()
        if self._readings.any:
            self._readings.apply()
        if gather:
            indirect.gather()

    # internals

    def _set_drive_goals(self) -> None:
        per_rad = self._scales.positions_per_rad
        goal = (self.bank["Goal Position"] - self._zero) * (self._sign / per_rad)
        if self._holding:
            goal = np.where(self._held, self._goal, goal)
        self._goal = goal
        drive_goal = np.where(self._push != 0.0, self._push, goal) if self._pushed else goal
        control_loops = self.control_loops
        updated = None
        if control_loops.active:
            control_loops.set_goals(goal)
            run = control_loops.position | control_loops.velocity
            drive_goal = np.where(run, self.drive.goal_rad, drive_goal)
            updated = ~run
        self.drive.goal_rad[:] = drive_goal
        self.blocked_shaft.hold(updated)

    def _reset_turns(self, which: Bools) -> None:
        scales = self._scales
        turned = np.rint(self.plant.position_rad * self._sign * scales.positions_per_rad)
        from_low = turned + self._centre - scales.lowest_position
        self._turns[which] = np.floor(from_low / scales.positions_per_turn)[which]

    def _hold(self, late: Bools) -> None:
        """Hold the servos whose watchdog has expired at their angle, without a profile.

        Their profile registers become 0 (e-manual, Bus Watchdog(98), example, step 4).
        """
        for name in PROFILE:
            self.bank[name][late] = 0
        self._held |= late
        self._goal[late] = self.plant.position_rad[late]
        self.apply_registers()
