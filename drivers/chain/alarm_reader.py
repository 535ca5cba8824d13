"""Alarms: Hardware Error Status(70) of servos whose status packets carry an alert."""

from collections.abc import Collection

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.chain.joint_codec import Readings
from snakewalk.drivers.errors import BusError

_ALERT_READS = 3
"""Reads in a row with an alert, but without an alarm in register 70, that end a run (ours)."""
_FLAPPING = 10
"""Alerts of a joint that come and go, after which it is reported a second and last time (ours)."""


class AlarmReader:
    """Reads the alarm after an alert; reads again if the register shows no alarm."""

    def __init__(self, bus: ChainBus, robot: RobotConfig, readings: Readings) -> None:
        self._bus = bus
        self._robot = robot
        self._readings = readings
        self._counts: dict[int, int] = {}
        """Reads in a row in which a joint had an alert, but no alarm."""
        self._alerts: dict[int, int] = {}
        """Number of alerts without an alarm, by joint."""

    def clear(self) -> None:
        """Forget the alerts so far."""
        self._counts.clear()
        self._alerts.clear()

    def update(self, alerted: Collection[int]) -> list[str]:
        """Read the alarms of joints with an alert; return lines to report.

        Call it after every group read of the state, even without an alert.

        Raises:
            PortError: the port is gone.

        """
        if self._counts:
            self._counts = {j: count for j, count in self._counts.items() if j in alerted}
        return [line for joint in alerted if (line := self._read(joint)) is not None]

    def _read(self, joint: int) -> str | None:
        try:
            alarm = self._bus.read(self._robot.servo_ids[joint], "Hardware Error Status")
        except BusError:
            return None  # the error byte carries the alert; read again in the next cycle
        self._readings.update_alarm(joint, alarm)
        if alarm:
            return None
        count = self._counts[joint] = self._counts.get(joint, 0) + 1
        if count < _ALERT_READS:
            self._readings.dismiss_alert(joint)
        if count > 1:
            return None
        alerts = self._alerts[joint] = self._alerts.get(joint, 0) + 1
        name = self._robot.joint_label(joint)
        if alerts == 1:
            return (
                f"{name}: its status packet carries an alert, but Hardware Error Status reads 0; "
                "it is read again before the run ends"
            )
        if alerts == _FLAPPING:
            return (
                f"{name}: its alert has come and gone {alerts} times without an alarm; later ones "
                "are not reported; stop the run and check its supply and its firmware"
            )
        return None
