"""A bus of simulated servos for other people's test suites, loaded by pytest by itself.

    def test_my_robot(servo_bus):
        bus = servo_bus("1-6:XL330-M288")      # or servo_bus() for four XM430-W350
        my_driver.open(bus.path)               # a real serial device, in real time

``bus.line`` is the same bus as a port object for the DYNAMIXEL SDK in simulated time. Registers by
name: ``bus["Goal Position"]``; ``bus.set`` and ``bus.load`` change registers and torques. The
report of a failed test states the delay of the bus, and has its last packets.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from snakewalk.sim.serve.servo_bus import ServoBus


_REPORTED_PACKETS = 20
"""Packets in the report of a failed test (ours)."""
_BUSES: "pytest.StashKey[list[ServoBus]]" = pytest.StashKey()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, None]:
    """Add the delays of its buses to the report of a failed test."""
    outcome = yield
    report = outcome.get_result()
    if report.when == "call" and report.failed:
        buses = [bus for node in item.listchain() for bus in node.stash.get(_BUSES, [])]
        for bus in buses:
            lines = [bus.lateness] if bus.lateness else []
            lines += [packet.text() for packet in bus.packets[-_REPORTED_PACKETS:]]
            if lines:
                report.sections.append(("servo_bus", "\n".join(lines)))


def _buses(node: pytest.Item) -> "Iterator[Callable[..., ServoBus]]":
    # pytest loads this in every suite of the environment: slow imports wait for the first use
    from snakewalk.sim.serve.servo_bus import ServoBus  # noqa: PLC0415  every suite loads this

    buses: list[ServoBus] = []
    node.stash[_BUSES] = buses

    def make(servos: "str | Sequence[int]" = "1-4", **options: object) -> ServoBus:
        buses.append(ServoBus(servos, **options))  # type: ignore[arg-type]
        return buses[-1]

    yield make
    for bus in buses:
        bus.close()


@pytest.fixture
def servo_bus(request: pytest.FixtureRequest) -> "Iterator[Callable[..., ServoBus]]":
    """Make simulated buses: ``servo_bus("1-6:XL330-M288", baud=..., faults=..., imu="200")``."""
    yield from _buses(request.node)


@pytest.fixture(scope="module")
def module_servo_bus(request: pytest.FixtureRequest) -> "Iterator[Callable[..., ServoBus]]":
    """Make simulated buses that the tests of a module share."""
    yield from _buses(request.node)
