"""Servos of Protocol 1.0: the control table drives the motors and shows their shafts (AX-12A)."""

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.protocol.protocol1 import MAX_ID, Error1
from snakewalk.sim.ax12.alarms import Ax12Alarms
from snakewalk.sim.ax12.table import MODEL, end_of, initial_value
from snakewalk.sim.plant import Plant
from snakewalk.sim.servo.motor import MotorModel, make_drive
from snakewalk.sim.servo.profile import Trajectory
from snakewalk.sim.servo.simulated_servos import SimulatedServos, check_ids

WHEEL_GAIN = 1e-9
CLOCKWISE = 0x400
"""Bit 10: the direction of speeds and loads."""
TURN_RAD = 2.0 * np.pi


class Ax12Servos(SimulatedServos):
    """S servos of one model on the shafts of ``plant``.

    Raises:
        InputError: an ID is outside 0 to 253 or used twice, or the model cannot be simulated.

    """

    protection: Ax12Alarms

    def __init__(
        self,
        ids: tuple[int, ...],
        plant: Plant,
        supply_v: float | None = None,
        facts: ServoModel | None = None,
    ) -> None:
        """Set up new servos; the defaults are AX-12A at the recommended supply."""
        self.facts = facts = servo_model(MODEL) if facts is None else facts
        motor = MotorModel.of(facts)
        supply_v = motor.nominal_v if supply_v is None else supply_v
        check_ids(ids, facts.model, MAX_ID)
        servos = len(ids)
        super().__init__(plant, make_drive([motor] * servos, supply_v))
        self._per_rad = facts.positions_per_rad
        self._centre = facts.units.zero_position
        self._starts = {row.address: name for name, row in facts.registers.items()}
        self.table = np.zeros((servos, end_of(facts.registers)), np.uint8)
        self._views = {name: self._view(cell) for name, cell in facts.registers.items()}
        self.protection = Ax12Alarms(
            self._views.__getitem__, self.drive, motor, self.blocked_shaft, supply_v
        )
        self._trajectory = Trajectory(servos, facts.rad_s_per_velocity, np.nan)
        self._turn_rad = np.zeros(servos)
        for row, servo_id in enumerate(ids):
            self.reset(row)
            self["ID"][row] = servo_id

    def __getitem__(self, name: str) -> NDArray[np.unsignedinteger]:
        """(S,) live view of a register."""
        return self._views[name]

    # instructions

    def check(self, row: int, address: int, data: bytes) -> int:
        """Error bits of the reply to a write of ``data``; writes nothing."""
        position = address
        while position < address + len(data):
            name = self._starts.get(position)
            if name is None:
                return Error1.INSTRUCTION
            cell = self.facts.registers[name]
            raw = data[position - address : position - address + cell.size]
            locked = position < self.facts.ram_from and self["Lock"][row]
            if len(raw) < cell.size or locked or cell.range is None:
                return Error1.INSTRUCTION
            value = int.from_bytes(raw, "little")
            unlocks = name == "Lock" and value < self[name][row]
            if not cell.range[0] <= value <= cell.range[1] or unlocks:
                return Error1.RANGE
            if name == "Goal Position" and not self._wheel()[row]:
                low, high = int(self["CW Angle Limit"][row]), int(self["CCW Angle Limit"][row])
                if not low <= value <= high:
                    return Error1.ANGLE_LIMIT
            position += cell.size
        return 0

    def write(self, row: int, address: int, data: bytes) -> int:
        """Write whole registers; with an error bit, nothing."""
        error = self.check(row, address, data)
        if error:
            return error
        self.table[row, address : address + len(data)] = np.frombuffer(data, np.uint8)
        rows = self.facts.registers
        touched = range(address, address + len(data))
        if rows["Torque Limit"].address in touched and self["Torque Limit"][row]:
            self.protection.reset(row)
        if rows["Goal Position"].address in touched:  # a goal switches the torque on
            self["Torque Enable"][row] = 1
        return 0

    def register_write(self, row: int, address: int, data: bytes) -> int:
        """Reg Write: check and store for Action."""
        error = self.check(row, address, data)
        if not error:
            self._registered[row] = (address, data)
            self["Registered"][row] = 1
        return error

    def action(self, row: int) -> int:
        """Execute the registered write; without one it is an instruction error."""
        kept = self._registered.pop(row, None)
        self["Registered"][row] = 0
        return self.write(row, *kept) if kept is not None else Error1.INSTRUCTION

    def reset(self, row: int) -> None:
        """Set factory values, including the ID, and reboot."""
        for name in self.facts.registers:
            self[name][row] = initial_value(self.facts, name)
        self.reboot(row)

    def reboot(self, row: int) -> None:
        """Restart: initial RAM, Torque Limit(34) = Max Torque(14), goal = present position."""
        for name, cell in self.facts.registers.items():
            if cell.address >= self.facts.ram_from:
                self[name][row] = cell.initial
        self["Torque Limit"][row] = self["Max Torque"][row]
        self._registered.pop(row, None)
        self.protection.reset(row)
        self.refresh()
        self["Goal Position"][row] = self["Present Position"][row]

    # registers and shafts

    def refresh(self) -> None:
        """Write all present values into the table."""
        self._update_turns()
        ticks = (self.plant.position_rad - self._turn_rad) * self._per_rad + self._centre
        _, last = self.facts.registers["Goal Position"].range or (0, 1023)
        self["Present Position"][:] = np.clip(np.rint(ticks), 0, last)
        self["Present Speed"][:] = _with_direction_bit(
            self.plant.velocity_rad_s / self.facts.rad_s_per_velocity
        )
        self["Present Load"][:] = _with_direction_bit(self.blocked_shaft.pwm() * 1023.0)
        self["Present Voltage"][:] = np.clip(np.rint(self.drive.supply_v * 10.0), 0, 255)
        celsius = np.rint(self.protection.temperature_c)
        self["Present Temperature"][:] = np.clip(celsius, 0, 255)
        self["Moving"][:] = self._trajectory.ongoing & self._torque_is_on() & ~self._wheel()
        if self._readings.any:
            self._readings.apply()

    def _wheel(self) -> Bools:
        return np.asarray((self["CW Angle Limit"] == 0) & (self["CCW Angle Limit"] == 0))

    def _update_turns(self) -> None:
        free = ~self._torque_is_on() | self._wheel()
        turn_rad = TURN_RAD * np.rint(self.plant.position_rad / TURN_RAD)
        self._turn_rad = np.where(free, turn_rad, self._turn_rad)

    def _update_drive(self, seconds: float) -> None:
        drive = self.drive
        wheel = self._wheel()
        on = self._torque_is_on()
        speed = self["Moving Speed"].astype(int)
        shaft = self.plant.position_rad
        self._trajectory.restart(~on | wheel, shaft)
        self._update_turns()
        per_rad = self._per_rad
        goal = (self["Goal Position"].astype(float) - self._centre) / per_rad
        goal += self._turn_rad
        units = (speed & 1023).astype(np.float64)
        still = np.where(on & ~wheel, goal, self._trajectory.goal).astype(np.float64)
        self._trajectory.set_goals(still, units, np.zeros(len(self)), np.zeros(len(self), bool))
        self._trajectory.advance(seconds, np.ones(len(self), bool))
        error = self._trajectory.position - shaft
        right = error < 0.0
        margin = np.where(right, self["CW Compliance Margin"], self["CCW Compliance Margin"])
        slope = np.where(right, self["CW Compliance Slope"], self["CCW Compliance Slope"])
        inside = np.abs(error) * per_rad <= margin
        push = np.where(speed & CLOCKWISE, -1.0, 1.0) * (speed & 1023) / 1023.0
        gain = np.where(wheel | inside, WHEEL_GAIN, per_rad / slope)
        drive.torque_on[:] = on
        drive.p_gain_per_rad[:] = gain
        aim = np.where(inside, shaft, self._trajectory.position - np.sign(error) * margin / per_rad)
        drive.goal_rad[:] = np.where(wheel, push / WHEEL_GAIN, aim)
        full = np.minimum(self["Torque Limit"], self["Max Torque"]) / 1023.0
        drive.pwm_limit[:] = np.where(self.no_output, 0.0, full)
        drive.current_limit_a[:] = np.inf
        self.blocked_shaft.hold()

    def _view(self, cell: RegisterRow) -> NDArray[np.unsignedinteger]:
        block = self.table[:, cell.address : cell.address + cell.size]
        return block.view(f"<u{cell.size}")[:, 0]


def _with_direction_bit(values: Floats) -> NDArray[np.int_]:
    """Magnitude up to 1023, direction in bit 10."""
    size = np.clip(np.rint(np.abs(values)), 0, 1023).astype(int)
    return np.where((values < 0.0) & (size > 0), size | CLOCKWISE, size)
