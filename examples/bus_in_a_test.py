"""Test a driver of your own against a bus of simulated servos, in simulated time.

python examples/bus_in_a_test.py
python examples/bus_in_a_test.py -v -k fault
"""

import argparse
from collections.abc import Callable

import pytest

import snakewalk as sw


class Gripper:
    """The driver under test: it knows nothing of simulated servos."""

    def __init__(self, bus: sw.DynamixelBus, servo_id: int) -> None:
        self._bus, self._id = bus, servo_id

    def close(self) -> int:
        """Switch torque on, close, and return the goal that the servo holds, in ticks."""
        self._bus.write(self._id, "Torque Enable", 1)
        self._bus.write(self._id, "Goal Position", 2500)
        return int(self._bus.read(self._id, "Goal Position"))


# the fixture comes with the package; a device for any program is servo_bus(...).path
def test_the_gripper_closes(servo_bus: Callable[..., sw.ServoBus]) -> None:
    bus = servo_bus("1-2:XL330-M288")
    assert Gripper(sw.DynamixelBus(bus.line, "XL330-M288"), 2).close() == 2500
    assert bus["Torque Enable"].tolist() == [0, 1]


def test_a_missing_servo_is_reported(servo_bus: Callable[..., sw.ServoBus]) -> None:
    bus = servo_bus("1-2:XL330-M288")
    with pytest.raises(sw.DriverError, match="servo 3"):
        Gripper(sw.DynamixelBus(bus.line, "XL330-M288"), 3).close()


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("-v", action="store_true", help="name each test")
    options.add_argument("-k", default="", help="only the tests whose names hold this")
    given = options.parse_args()
    arguments = [__file__, "-p", "no:cacheprovider", "-p", "no:warnings", "-k", given.k]
    raise SystemExit(pytest.main([*arguments, "-v"] if given.v else arguments))
