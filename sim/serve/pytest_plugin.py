"""A bus of simulated servos for other people's test suites, loaded by pytest by itself.

    def test_my_robot(servo_bus):
        bus = servo_bus("1-6:XL330-M288")      # or servo_bus() for four XM430-W350
        my_driver.open(bus.path)               # a real serial device, in real time

``bus.line`` is the same bus as a port object for the DYNAMIXEL SDK in simulated time. Registers by
name: ``bus["Goal Position"]``; ``bus.set`` and ``bus.load`` change registers and torques. The
report of a failed test states the delay of the bus, and has its last packets.
"""

import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from snakewalk.sim.line.clock import SimClock
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


def make_buses(node: pytest.Item) -> "Iterator[Callable[..., ServoBus]]":
    """Yield the function that makes the buses of a test or a module; then close them."""
    # pytest loads this in every suite of the environment: slow imports wait for the first use
    from snakewalk.sim.serve.servo_bus import ServoBus  # noqa: PLC0415  every suite loads this

    buses: list[ServoBus] = []
    node.stash[_BUSES] = buses

    with pytest.MonkeyPatch.context() as patch:

        def make(
            servos: "str | Sequence[int]" = "1-4", *, virtual_time: bool = False, **options: object
        ) -> ServoBus:
            bus = ServoBus(servos, **options)  # type: ignore[arg-type]
            buses.append(bus)
            if virtual_time:
                _follow(patch, bus.line.clock)
            return bus

        yield make
    for bus in buses:
        bus.close()


def _follow(patch: pytest.MonkeyPatch, clock: "SimClock") -> None:
    """Move ``time`` of this thread with a clock; other threads keep real time."""
    this_thread = threading.get_ident()
    start_s = clock.now_s()

    def replace(name: str, simulated: Callable[..., float | None]) -> None:
        real = getattr(time, name)

        def function(*seconds: float) -> float | None:
            is_here = threading.get_ident() == this_thread
            return (simulated if is_here else real)(*seconds)

        patch.setattr(time, name, function)

    replace("sleep", clock.advance)
    for name in ("time", "monotonic", "perf_counter"):
        begin_s = getattr(time, name)() - start_s
        replace(name, lambda begin_s=begin_s: begin_s + clock.now_s())


@pytest.fixture
def servo_bus(request: pytest.FixtureRequest) -> "Iterator[Callable[..., ServoBus]]":
    """Make simulated buses: ``servo_bus("1-6:XL330-M288", baud=..., faults=..., imu="200")``."""
    yield from make_buses(request.node)


@pytest.fixture(scope="module")
def module_servo_bus(request: pytest.FixtureRequest) -> "Iterator[Callable[..., ServoBus]]":
    """Make simulated buses that the tests of a module share."""
    yield from make_buses(request.node)
