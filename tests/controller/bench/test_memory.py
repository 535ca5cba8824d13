"""Commands that run for hours need no more memory after a while, in simulated time."""

import gc
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench.served_body import ServedBody
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.protocol.packet import InstructionPacket, encode_instruction
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.serve.live_table import LiveTable
from snakewalk.sim.sniff.decode import Decoder
from tests.helpers.bus import a_line

MOST_BYTES = 20_000
"""Growth in the last third; a served robot that kept its poses grew by 54 kB in 3 s."""


@contextmanager
def served_robot() -> Iterator[Callable[[], object]]:
    """``bus serve --robot yaw16`` that nobody talks to."""
    keys = ("world", "run", "at", "pose_out", "tracker", "truth")
    body = ServedBody(robot="yaw16", seed=0, **dict.fromkeys(keys))
    with body.make(None) as served:

        def wait() -> None:
            served.line.clock.advance(0.1)
            served.line.settle()

        yield wait


@contextmanager
def served_bus() -> Iterator[Callable[[], object]]:
    """``bus serve`` with a client that reads a servo."""
    line = a_line()
    line.taps.append(LiveTable(list))
    packet = encode_instruction(InstructionPacket(1, 2, bytes([132, 0, 4, 0])))

    def ask() -> None:
        line.writePort(packet)
        assert line.read_until(15, line.clock.now_s() + 0.01)

    yield ask


@contextmanager
def run_on_servos() -> Iterator[Callable[[], object]]:
    """A run: two joints in the safety layer, at 50 cycles per second."""
    line = a_line()
    robot = RobotConfig(name="two", joint_axes="yy")
    chain = ServoChain(DynamixelBus(line), robot)
    with SafeLink(chain, SafetyLimits.from_config(robot, SafetyConfig()), line.clock) as link:
        link.enable()

        def cycle() -> None:
            line.clock.advance(0.016)
            link.read()
            link.write(JointCommand(line.clock.now_s(), np.zeros(2)))

        yield cycle


@contextmanager
def sniffer() -> Iterator[Callable[[], object]]:
    """``bus sniff`` of a busy line."""
    decoder = Decoder()
    packet = encode_instruction(InstructionPacket(1, 2, bytes([132, 0, 4, 0])))
    yield lambda: list(decoder.feed(0.0, packet))


@pytest.mark.parametrize(
    ("command", "steps"),
    [(served_robot, 30), (served_bus, 150), (run_on_servos, 150), (sniffer, 300)],
)
def test_memory_stays_flat(
    command: Callable[[], AbstractContextManager[Callable[[], object]]], steps: int
) -> None:
    held_bytes = []
    with command() as step:
        tracemalloc.start()
        try:
            for _ in range(3):
                for _ in range(steps):
                    step()
                gc.collect()
                held_bytes.append(tracemalloc.get_traced_memory()[0])
        finally:
            tracemalloc.stop()
    assert held_bytes[2] - held_bytes[1] < MOST_BYTES
