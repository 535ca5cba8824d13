"""Feetech servos: the registers drive the motors and show their shafts."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.protocol.feetech import (
    CALIBRATE_MIDDLE,
    MAX_ID,
    TORQUE_DAMPING,
    FeetechAlarm,
    Phase,
)
from snakewalk.sim.ax12.alarms import Ax12Alarms
from snakewalk.sim.feetech.registers import FeetechRegisters
from snakewalk.sim.plant import Mounting, Plant, ServoDrive
from snakewalk.sim.servo.blocked_shaft import BlockedShaft
from snakewalk.sim.servo.motor import MotorColumns, MotorModel, make_drive
from snakewalk.sim.servo.profile import Trajectory
from snakewalk.sim.servo.simulated_servos import SimulatedServos, check_ids

ALARMS: Mapping[str, int] = {
    "overload": FeetechAlarm.OVERLOAD,
    "overheating": FeetechAlarm.OVERHEATING,
    "voltage": FeetechAlarm.VOLTAGE,
    "encoder": FeetechAlarm.ENCODER,
}
"""Alarms by their names in a fault file."""
_TIME_UNIT_S = 0.01


class FeetechAlarms(Ax12Alarms):
    """Alarms of S servos of one model, whose registers are ``register(name)`` (S,)."""

    def __init__(
        self,
        register: Callable[[str], Ints],
        kinds: Sequence[str],
        drive: ServoDrive,
        motor: MotorModel,
        blocked_shaft: BlockedShaft,
        supply_v: float,
    ) -> None:
        """Set up servos without an alarm; they detect those of ``kinds``."""
        super().__init__(register, drive, motor, blocked_shaft, supply_v)  # type: ignore[arg-type]
        self.known = {kind: bit for kind, bit in ALARMS.items() if kind in kinds}

    @property
    def is_weak(self) -> Bools:
        """(S,) whether an overload has lowered the output."""
        return np.asarray((self._latched & FeetechAlarm.OVERLOAD) != 0)

    def _full_output(self) -> Floats:
        if "overload" not in self.known:
            return np.full(len(self.shown), np.inf)
        return self._register("Overload Torque") / 100.0

    def _overload_s(self) -> Floats | float:
        if "overload" not in self.known:
            return np.inf
        return np.asarray(self._register("Protection Time") * _TIME_UNIT_S)

    def _shut_down(self) -> None:
        self.shown |= self._latched
        off = self._latched & self._register("Shutdown") & ~FeetechAlarm.OVERLOAD
        self._register("Torque Enable")[off != 0] = 0


POSITION, VELOCITY, PUSH, STEP = range(4)
"""Operating Mode(33); PUSH is open-loop PWM on STS servos, and current on HLS servos. STEP is
open-loop PWM on HLS servos."""
ACCELERATION_RAD_S2 = np.radians(100.0 * 360.0 / 4096.0)
"""Acceleration(41): 100 positions/s^2, 8.7 degrees/s^2 in the memory table."""
_PUSH_GAIN = 1e-9
"""Gain of a motor that only pushes: its goal is far away."""
_FULL = 1000.0
"""Goal PWM, PWM Limit, Present Load and open-loop PWM of full output."""
_COARSE = 50.0
"""Velocity units of STS servos without ``Phase.FINE_VELOCITY``: 0.732 over 0.0146 rev/min."""
_INTEGRAL_LIMIT_UNIT = 4.0
"""Integral Limit(25): output in units of 0.1 % (memory table)."""


class FeetechServos(SimulatedServos):
    """S servos of one model on the shafts of ``plant``."""

    protection: FeetechAlarms

    def __init__(
        self,
        ids: Sequence[int],
        plant: Plant,
        facts: ServoModel,
        supply_v: float | None = None,
        mounting: Mounting | None = None,
        motors: Sequence[MotorModel] | None = None,
    ) -> None:
        """Set up new servos; by default at the recommended supply, each on its shaft's zero.

        Raises:
            InputError: an ID is outside 0 to 253 or used twice.

        """
        check_ids(ids, facts.model, MAX_ID)
        servos = len(ids)
        model = MotorModel.of(facts)
        volts = model.nominal_v if supply_v is None else supply_v
        super().__init__(plant, make_drive(motors or [model] * servos, volts))
        self.facts = facts
        self._motor = MotorColumns(motors or [model] * servos)
        self._mounting = mounting or Mounting(np.ones(servos), np.zeros(servos))
        self.registers = registers = FeetechRegisters(facts, servos)
        self.protection = FeetechAlarms(
            registers.__getitem__, facts.alarms, self.drive, model, self.blocked_shaft, volts
        )
        self._trajectory = Trajectory(servos, facts.rad_s_per_velocity, ACCELERATION_RAD_S2)
        self._turns = np.zeros(servos)
        self._step_goal = np.full(servos, np.nan)
        """(S,) goals of servos in step mode, positions of all turns; NaN before the first step."""
        self._was_on = np.zeros(servos, bool)
        self._integral = np.zeros(servos)
        """(S,) output of the integral part, units of 0.1 %."""
        for row, servo_id in enumerate(ids):
            registers.put(row, "Lock", 0)
            registers.put(row, "ID", servo_id)
            self.reboot(row)

    def __getitem__(self, name: str) -> Ints:
        """(S,) live view of a register."""
        return self.registers[name]

    # instructions

    def read(self, row: int, address: int, length: int) -> bytes:
        """Bytes of a block; call ``refresh`` first."""
        return self.registers.read(row, address, length)

    def write(self, row: int, address: int, data: bytes) -> int:
        """Write whole registers; returns 0: a reply reports no rejected write."""
        torque = self.facts.registers["Torque Enable"].address
        if address <= torque < address + len(data) and data[torque - address] == CALIBRATE_MIDDLE:
            self.calibrate(row, self.facts.units.zero_position)
            return 0
        for name in self.registers.write(row, address, data):
            if name == "Torque Enable" and self["Torque Enable"][row] and not self._was_on[row]:
                self.protection.reset(row)
            if name == "Goal Position" and self._mode()[row] == STEP and self._has_steps():
                from_ticks = self._step_goal[row]
                from_ticks = self._ticks()[row] if np.isnan(from_ticks) else from_ticks
                steps = self["Goal Position"][row] * self._resolution()[row]
                self._step_goal[row] = from_ticks + int(steps)
        return 0

    def register_write(self, row: int, address: int, data: bytes) -> int:
        """Reg Write: store for Action."""
        self._registered[row] = (address, data)
        self["Registered Instruction"][row] = 1
        return 0

    def action(self, row: int) -> int:
        """Execute the registered write, if any."""
        kept = self._registered.pop(row, None)
        self["Registered Instruction"][row] = 0
        return self.write(row, *kept) if kept is not None else 0

    def calibrate(self, row: int, position: int) -> None:
        """Make the present position ``position`` by Homing Offset(31), persistently."""
        if "Homing Offset" not in self.facts.registers:
            return
        turn = round(self.facts.units.positions_per_turn)
        offset = round(float(self._ticks()[row])) - position
        self["Homing Offset"][row] = (offset + turn // 2) % turn - turn // 2
        self.registers.store(row, "Homing Offset")
        self.reset_turns(row)

    def reset_turns(self, row: int) -> None:
        """Count turns from the present one."""
        free = np.arange(len(self)) == row
        self._turns = np.where(free, self._turn(), self._turns)

    def reset(self, row: int) -> None:
        """Restore all parameters but the ID, and restart."""
        self.registers.reset(row)
        self.reboot(row)

    def reboot(self, row: int) -> None:
        """Restart: initial RAM, torque off, goal = present position."""
        self.registers.restart(row)
        self._registered.pop(row, None)
        self._was_on[row] = False
        self.protection.reset(row)
        self.reset_turns(row)
        self.refresh()
        self["Goal Position"][row] = self["Present Position"][row]

    def hold_position(self) -> None:
        """Set every goal to the present position, at rest, after a shaft was moved."""
        self._turns = self._turn()
        self.refresh()
        self["Goal Position"][:] = self["Present Position"]
        self._trajectory.restart(np.ones(len(self), bool), self._servo_rad())

    # registers and shafts

    def refresh(self) -> None:
        """Write all present values into the registers."""
        facts = self.facts
        free = ~self._torque_is_on() | (self._mode() == VELOCITY) | (self._mode() == PUSH)
        free &= ~self._phase(Phase.ALL_TURNS)
        self._turns = np.where(free, self._turn(), self._turns)
        position = self._ticks() - self._offset() - self._turns * facts.units.positions_per_turn
        if self._has_steps():
            left = np.nan_to_num(self._step_goal - self._ticks())
            position = np.where(self._mode() == STEP, left, position)
        _, last = facts.registers["Goal Position"].range or (0, 0)
        position = np.rint(position / self._resolution())
        self["Present Position"][:] = np.clip(position, -last, last)
        sign = self._mounting.sign
        speed = self._sensor_sign() * sign * self.plant.velocity_rad_s / self._velocity_unit()
        self["Present Velocity"][:] = np.clip(np.rint(speed), -32767, 32767)
        sign = self._drive_sign() * sign
        pwm = sign * self.blocked_shaft.pwm()
        self["Present Load"][:] = np.clip(np.rint(pwm * _FULL), -1000, 1000)
        if "Present Current" in facts.registers:
            amps = sign * self.blocked_shaft.current_a()
            self["Present Current"][:] = np.clip(
                np.rint(amps / (facts.units.current_a or np.inf)), -32767, 32767
            )
        self["Present Input Voltage"][:] = np.clip(np.rint(self.drive.supply_v * 10.0), 0, 255)
        celsius = np.rint(self.protection.temperature_c)
        self["Present Temperature"][:] = np.clip(celsius, 0, 255)
        self["Hardware Error Status"][:] = self.protection.shown
        self["Moving"][:] = self._trajectory.ongoing & self._torque_is_on()
        if "Present Goal Position" in facts.registers:
            self["Present Goal Position"][:] = self["Goal Position"]
        if self._readings.any:
            self._readings.apply()

    def _mode(self) -> Ints:
        if "Operating Mode" in self.facts.registers:
            return self["Operating Mode"]
        # an SCS servo without limits turns endlessly, with Goal Time as its PWM
        endless = (self["Min Position Limit"] == 0) & (self["Max Position Limit"] == 0)
        return np.where(endless, PUSH, POSITION)

    def _has_steps(self) -> bool:
        """Whether mode 3 is the step mode."""
        return "Open-loop PWM" in self.facts.registers

    def _offset(self) -> Ints:
        if "Homing Offset" in self.facts.registers:
            return self["Homing Offset"]
        return np.zeros(len(self), np.int64)

    def _phase(self, bit: int) -> Bools:
        """(S,) whether a bit of Phase(18) differs from a new servo's."""
        return np.asarray((self["Phase"] ^ self.registers.initial("Phase")) & bit != 0)

    def _sensor_sign(self) -> Floats:
        return np.where(self._phase(Phase.SENSOR), -1.0, 1.0)

    def _drive_sign(self) -> Floats:
        bit = Phase.HLS_DRIVE if "Goal Current" in self.facts.registers else Phase.DRIVE
        return np.where(self._phase(bit), -1.0, 1.0)

    def _velocity_unit(self) -> Floats:
        """(S,) rad/s of one unit of a velocity."""
        coarse = self._has_steps() & self._phase(Phase.FINE_VELOCITY)
        return np.where(coarse, _COARSE, 1.0) * self.facts.rad_s_per_velocity

    def _resolution(self) -> Ints:
        """(S,) sensor steps of one position."""
        if "Angular Resolution" in self.facts.registers:
            return self["Angular Resolution"]
        return np.ones(len(self), np.int64)

    def _servo_rad(self) -> Floats:
        """(S,) sensor angles from their middle."""
        mounting = self._mounting
        shaft = mounting.sign * self.plant.position_rad + mounting.zero_rad
        return self._sensor_sign() * shaft

    def _ticks(self) -> Floats:
        """(S,) positions of all turns, without offset."""
        units = self.facts.units
        return self._servo_rad() * self.facts.positions_per_rad + units.zero_position

    def _turn(self) -> Floats:
        turn = self.facts.units.positions_per_turn
        return np.floor((np.rint(self._ticks()) - self._offset()) / turn)

    def _update_drive(self, seconds: float) -> None:
        drive = self.drive
        facts = self.facts
        mode = self._mode()
        on = self._torque_is_on()
        registers = self.registers
        shaft = self._servo_rad()
        self._step_goal[(mode != STEP) | ~on] = np.nan
        positions = on & ((mode == POSITION) | (mode == STEP) & self._has_steps())
        self._move(seconds, positions, on & (mode == VELOCITY), shaft)
        gain = self._motor.positions_per_rad / self._motor.full_pwm / self._motor.p_gain_divisor
        gain = gain * registers["Position P Gain" if "Kp" not in facts.registers else "Kp"]
        closed = positions | (on & (mode == VELOCITY))
        push, limit_a = self._push(mode)
        weak = self.protection.is_weak
        limit = np.minimum(registers["PWM Limit"], self._goal_pwm()) / _FULL
        if "Protective Torque" in facts.registers:
            limit = np.where(weak, registers["Protective Torque"] / 100.0, limit)
        damping = (registers["Torque Enable"] == TORQUE_DAMPING) & self.powered
        drive.torque_on[:] = on | damping
        drive.p_gain_per_rad[:] = np.where(damping, 0.0, np.where(closed, gain, _PUSH_GAIN))
        error = self._trajectory.position - shaft
        wanted_output = np.where(positions, self._output(seconds, gain, error), gain * error)
        aim = np.where(
            closed, shaft + wanted_output / np.maximum(gain, _PUSH_GAIN), push / _PUSH_GAIN
        )
        mounting = self._mounting
        shift = np.where(closed, mounting.zero_rad, 0.0)
        sensor = self._sensor_sign()
        motor = self._drive_sign()
        drive.p_gain_per_rad[:] *= np.where(closed, sensor * motor, 1.0)
        drive.goal_rad[:] = mounting.sign * (np.where(closed, sensor, motor) * aim - shift)
        drive.pwm_limit[:] = np.where(self.no_output, 0.0, limit)
        drive.current_limit_a[:] = limit_a
        self.blocked_shaft.hold()
        self._was_on = on

    def _output(self, seconds: float, gain: Floats, error: Floats) -> Floats:
        """(S,) output of position control for errors, rad: dead zones, least output, integral."""
        registers = self.registers
        positions = error * self.facts.positions_per_rad
        zone = np.where(error > 0.0, registers["CW Dead Zone"], registers["CCW Dead Zone"])
        active = np.abs(positions) > zone * self._resolution()
        least = np.where(active, registers["Minimum Startup Force"] / _FULL, 0.0)
        output = np.where(active, gain * error, 0.0)
        output = np.copysign(np.maximum(np.abs(output), least), error)
        i_gain = registers["Position I Gain" if "Ki" not in self.facts.registers else "Ki"]
        most = np.full(len(self), _FULL)
        if "Integral Limit" in self.facts.registers:
            limit = registers["Integral Limit"] * _INTEGRAL_LIMIT_UNIT
            most = np.where(limit > 0.0, limit, most)
        grown = self._integral + np.where(active, i_gain * positions * seconds, 0.0)
        self._integral = np.where(
            (i_gain > 0) & self._torque_is_on(), np.clip(grown, -most, most), 0.0
        )
        return output + self._integral / _FULL

    def _move(self, seconds: float, positions: Bools, wheels: Bools, shaft: Floats) -> None:
        """Advance the trajectories to the goals, or at the goal velocities."""
        facts = self.facts
        registers = self.registers
        path = self._trajectory
        path.restart(~(positions | wheels) | ((positions | wheels) & ~self._was_on), shaft)
        goal = registers["Goal Position"].astype(np.float64)
        low, high = registers["Min Position Limit"], registers["Max Position Limit"]
        many_turns = (low == 0) & (high == 0)
        goal = np.where(many_turns, goal, np.clip(goal, low, high))
        ticks = goal * self._resolution() + self._offset()
        ticks = ticks + self._turns * facts.units.positions_per_turn
        goal_rad = (ticks - facts.units.zero_position) / facts.positions_per_rad
        if self._has_steps():
            steps = self._mode() == STEP
            goal = (self._step_goal - facts.units.zero_position) / facts.positions_per_rad
            goal_rad = np.where(steps, np.where(np.isnan(goal), path.goal, goal), goal_rad)
        velocity = np.abs(registers["Goal Velocity"]) * self._velocity_unit()
        velocity = velocity / facts.rad_s_per_velocity
        timed = np.zeros(len(self), bool)
        if "Goal Time" in facts.registers:
            timed = (velocity == 0.0) & (registers["Goal Time"] > 0)
            velocity = np.where(timed, registers["Goal Time"], velocity)
        ramp = np.zeros(len(self))
        if "Acceleration" in facts.registers:
            ramp = registers["Acceleration"].astype(np.float64)
        path.set_goals(np.where(positions, goal_rad, path.goal), velocity, ramp, timed)
        path.advance(seconds, positions)
        speed = registers["Goal Velocity"] * self._velocity_unit()
        ahead = path.position + speed * seconds
        path.position[wheels] = np.clip(ahead, shaft - 0.5, shaft + 0.5)[wheels]
        path.goal[wheels] = path.position[wheels]

    def _push(self, mode: Ints) -> tuple[Floats, Floats]:
        """(S,) open-loop output, and (S,) current limits, A."""
        registers = self.registers
        facts = self.facts
        none = np.full(len(self), np.inf)
        if "Goal Current" in facts.registers:
            raw = registers["Goal Current"].astype(np.float64)
            limit_a = np.abs(raw) * (facts.units.current_a or 0.0)
            push = np.where(mode == STEP, raw / _FULL, np.sign(raw))
            return np.where(mode >= PUSH, push, 0.0), np.where(mode == STEP, np.inf, limit_a)
        name = "Open-loop PWM" if self._has_steps() else "Goal Time"
        return np.where(mode == PUSH, registers[name] / _FULL, 0.0), none

    def _goal_pwm(self) -> Ints:
        name = "Goal PWM" if "Goal PWM" in self.facts.registers else "PWM Limit"
        return self.registers[name]
