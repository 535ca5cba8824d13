"""Every way out of a running program, seen from the servos behind a pseudo-terminal."""

import select
import signal
from collections.abc import Iterator

import numpy as np
import pytest

from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.safety.stop_button import stoppable_runs
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.pty import PtyServer
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from tests.helpers.program import Program
from tests.helpers.swing_child import ROBOT, WATCHDOG_S, swing

PATIENCE_S = 600.0


class Servos:
    """Simulated servos on a pseudo-terminal, and a program that moves them."""

    def __init__(self, server: PtyServer, line: SimLine, how: str) -> None:
        self.server, self.line = server, line
        self.child = Program(swing, server.path, how)
        self.clock = WallClock()

    def serve_until(self, done: object) -> None:
        assert callable(done)
        while not done():
            assert self.clock.now_s() < PATIENCE_S, "it hangs"
            self.server.step(0.005)

    def moving(self) -> bool:
        assert self.child.poll() is None or self.said()
        return bool(select.select([self.child.stdout], [], [], 0.0)[0])

    def said(self) -> str:
        return self.child.stderr.read()

    def torque(self) -> list[int]:
        return self.line.bank["Torque Enable"].tolist()


@pytest.fixture
def servos(request: pytest.FixtureRequest) -> Iterator[Servos]:
    line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(3))
    with PtyServer(line, WallClock()) as server:
        made = Servos(server, line, getattr(request, "param", "swing"))
        try:
            made.serve_until(made.moving)
            yield made
        finally:
            made.child.kill()
            made.child.communicate()


@pytest.mark.costs("starts a program and kills it")
def test_a_killed_program_leaves_servos_that_stop_within_the_watchdogs_time(
    servos: Servos,
) -> None:
    line = servos.line
    servos.child.kill()
    servos.child.wait()
    servos.serve_until(lambda: line.next_event_s() is None)
    # from here on simulated time alone: no client, no wall clock
    line.clock.advance(WATCHDOG_S + 0.02)
    line.settle()
    assert (line.bank["Bus Watchdog"] == 0xFF).all()
    held = line.firmware.drive.goal_rad.copy()
    line.clock.advance(1.0)
    line.settle()
    at_rest = line.firmware.plant.position_rad.copy()
    line.clock.advance(5.0)
    line.settle()
    assert line.firmware.plant.position_rad == pytest.approx(at_rest, abs=1e-9)
    assert np.abs(at_rest - held).max() < 0.1
    assert servos.torque() == [1] * 3  # they hold, and take no goal


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTSTP]
)
def test_a_signal_switches_torque_off(servos: Servos, number: signal.Signals) -> None:
    servos.child.send_signal(number)
    servos.serve_until(lambda: servos.child.poll() is not None)
    assert servos.torque() == [0] * 3
    assert servos.line.bank["Bus Watchdog"].tolist() == [0] * 3
    assert servos.child.returncode in (128 + number, -number)


@pytest.mark.parametrize("servos", ["crash"], indirect=True)
def test_an_exception_switches_torque_off(servos: Servos) -> None:
    servos.serve_until(lambda: servos.child.poll() is not None)
    assert servos.torque() == [0] * 3
    assert servos.child.returncode == 1
    assert "planner crashed" in servos.said()


def test_a_pressed_button_latches_within_two_cycles_and_nothing_is_sent_after(
    servos: Servos,
) -> None:
    """Counted on the wire: goals between the request and torque off, and after it."""
    sent: list[str] = []
    reader = PacketParser()

    def tap(time_s: float, from_host: bool, data: bytes) -> None:
        for packet in reader.feed(data) if from_host else ():
            assert isinstance(packet, InstructionPacket)
            address = int.from_bytes(packet.params[:2], "little")
            if packet.instruction == Instruction.SYNC_WRITE and address in (116, 64):
                sent.append("goals" if address == 116 else "torque off")

    servos.line.taps.append(tap)
    (button,) = stoppable_runs()  # nobody else's
    assert button.run.process == servos.child.pid
    with button:
        assert button.run.ports == (servos.server.path,)
        servos.serve_until(lambda: len(sent) >= 5)
        assert set(sent) == {"goals"}  # it runs
        sent.clear()
        button.press("a test")
        servos.serve_until(lambda: servos.child.poll() is not None)
        assert button.end is not None
        assert "stop requested by a test" in button.end
    assert sent.index("torque off") <= 2
    assert "goals" not in sent[sent.index("torque off") :]
    assert servos.torque() == [0] * 3
    assert servos.child.returncode == 1
    assert list(stoppable_runs()) == []
