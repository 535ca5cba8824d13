"""Torque off on every servo of a chain, repeated until each servo confirms it."""

from collections.abc import Iterable, Mapping, Sequence

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import BusError, PortError
from snakewalk.drivers.protocol.registers import WATCHDOG

_GROUP_ROUNDS = 8
"""Group reads in which the servos may confirm that their torque is off (ours)."""
_ASK_S = 1.0
"""Longest time for which servos that do not confirm are asked one by one, s (ours)."""
_PORT_PATIENCE_S = 2.0
_REOPEN_S = 0.1
"""Longest wait for a port that is gone, and the time between tries, s (ours)."""


class TorqueOff:
    """Switches torque off, then the watchdogs."""

    def __init__(self, bus: ChainBus, robot: RobotConfig, clock: Clock, watchdog_s: float) -> None:
        self._bus = bus
        self._robot = robot
        self._clock = clock
        self._watchdog_s = watchdog_s
        self.is_watched = True
        """Whether the watchdogs are armed where the servos have one."""

    def send(self) -> None:
        """Switch torque off on every servo, even if others fail, then the watchdogs.

        Servos that do not confirm in a group read are asked one by one for a limited time. If one
        port is gone, the servos on the others are switched off before the wait for it.

        Raises:
            BusError: servos did not confirm; their watchdog stays armed and stops them.
            PortError: a port does not come back; the watchdog stops its servos.

        """
        give_up_s = self._clock.now_s() + _PORT_PATIENCE_S
        joints_on = {part: self._joints_on(part) for part in self._bus.parts}
        gone: list[DynamixelBus] = []
        for part, joints in joints_on.items():
            try:
                part.sync_write(self._ids_of(joints), "Torque Enable", 0)
            except PortError:
                gone.append(part)
        silent: list[int] = []
        faults: dict[DynamixelBus, PortError] = {}
        for part in sorted(joints_on, key=gone.__contains__):
            try:
                if part in gone:
                    self._wait_to_send(part, joints_on[part], give_up_s)
                silent += self._unconfirmed_ids(part, joints_on[part])
            except PortError as error:
                faults[part] = error
        self._report(sorted(silent), faults)

    def _report(self, silent: Sequence[int], faults: Mapping[DynamixelBus, PortError]) -> None:
        """Raise the error of servos that are not off, if any; ``faults`` are of the lost ports."""
        names = ", ".join(map(self._robot.joint_label, silent))
        if faults:
            ids = [servo_id for part in faults for servo_id in self._ids_of(self._joints_on(part))]
            hold = "its servos hold their last goals"
            if self.is_watched and all(WATCHDOG in self._bus.table_of(i) for i in ids):
                hold = f"its servos hold after the bus watchdog ({self._watchdog_s:.3g} s)"
            gone = [*faults.values()]
            text = (
                f"{'; '.join(map(str, gone))}; torque is not off: {hold}; switch the servo power "
                "off"
            )
            if len(self._bus.parts) > len(faults) and not silent:
                text += "; on the other ports torque is off"
            raise PortError(f"{text}; {names}: not confirmed" if names else text) from gone[0]
        if names:
            raise BusError(
                f"{names}: torque off is not confirmed; if a joint still holds, switch the servo "
                "power off"
            )

    def _joints_on(self, part: DynamixelBus) -> list[int]:
        ids = self._robot.servo_ids
        return [joint for joint, i in enumerate(ids) if self._bus.port_of(i) is part.port]

    def _ids_of(self, joints: Iterable[int]) -> list[int]:
        return [self._robot.servo_ids[joint] for joint in joints]

    def _wait_to_send(self, part: DynamixelBus, joints: Sequence[int], give_up_s: float) -> None:
        while True:
            is_late = self._clock.now_s() >= give_up_s
            try:
                part.reopen()
                part.sync_write(self._ids_of(joints), "Torque Enable", 0)
            except PortError:
                if is_late:
                    raise
                self._clock.sleep_until_s(self._clock.now_s() + _REOPEN_S)
            else:
                return

    def _unconfirmed_ids(self, bus: DynamixelBus, on_it: Sequence[int]) -> list[int]:
        ids = self._robot.servo_ids
        joints = list(on_it)
        for _ in range(_GROUP_ROUNDS):
            asked = self._ids_of(joints)
            reply = bus.block(asked, "Torque Enable", "Torque Enable", fast=False).read()
            off = reply.valid & (reply.data[:, 0] == 0)
            joints = [joint for joint, done in zip(joints, off, strict=True) if not done]
            if not joints:
                break
            bus.sync_write(self._ids_of(joints), "Torque Enable", 0)
        give_up_s = self._clock.now_s() + _ASK_S
        silent = joints  # servos after a silent one stay silent in a group read
        while silent and self._clock.now_s() < give_up_s:
            silent = [
                joint for joint in silent if not self._has_no_torque(bus, ids[joint], give_up_s)
            ]
        confirmed = self._ids_of(joint for joint in on_it if joint not in silent)
        if confirmed and all(WATCHDOG in bus.table_of(servo_id) for servo_id in confirmed):
            bus.sync_write(confirmed, WATCHDOG, 0)
            # the port may be closed next: a reply shows that the packet has arrived
            bus.block(confirmed, WATCHDOG, WATCHDOG, fast=False).read()
        return silent

    def _has_no_torque(self, bus: DynamixelBus, servo_id: int, give_up_s: float) -> bool:
        if self._clock.now_s() >= give_up_s:
            return False
        try:
            bus.write(servo_id, "Torque Enable", 0, tries=1)
        except BusError:
            return False
        return True
