"""The live table of a served bus: drawn by another process, for which no servo waits."""

import io
import os
import signal
from collections import deque
from functools import partial

import pytest
from rich.console import Console

from snakewalk.controller.bench.live_table import LiveScreen, Snapshot, view
from snakewalk.drivers.protocol.packet import Instruction, InstructionPacket, encode_instruction
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.live_table import KEPT, LiveTable, servo_rows
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.sniff.decode import Decoder
from tests.helpers.bus import a_line

PING = encode_instruction(InstructionPacket(1, Instruction.PING))


@pytest.mark.slow
def test_a_screen_that_hangs_is_sent_nothing_more() -> None:
    with LiveScreen(partial(Decoder, "XM430-W350")) as screen:
        assert screen._line.poll(120.0)  # it has started
        assert screen.ready
        pid = screen._process.pid
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        try:
            screen.show(Snapshot("counts", [], ((0.0, PING),)))
            assert not any(screen.ready for _ in range(1000))
        finally:
            os.kill(pid, signal.SIGCONT)
        assert screen._line.poll(120.0)
        assert screen.ready


def test_a_screen_that_was_killed_does_not_end_the_servos() -> None:
    with LiveScreen(partial(Decoder, "XM430-W350")) as screen:
        screen._process.kill()
        screen._process.join()
        screen.show(Snapshot("counts", [], ()))
        assert not screen.ready


def test_packets_are_put_into_words_where_they_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Decoder, time_s: float, data: bytes) -> None:
        raise AssertionError("decoded while a servo is to reply")

    with monkeypatch.context() as patched:
        patched.setattr(Decoder, "feed", refuse)
        table = LiveTable(list)
        for k in range(2 * KEPT):
            table(0.1 * k, True, PING)
    assert (table.questions, table.answers, table.bytes) == (2 * KEPT, 0, 2 * KEPT * len(PING))
    packets = table.take_recent()
    assert [time_s for time_s, _ in packets] == [0.1 * k for k in range(KEPT, 2 * KEPT)]
    assert not table.take_recent()


def test_the_view_has_a_row_a_servo_and_a_line_a_packet() -> None:
    line, decoder = a_line(2), Decoder()
    packets = deque(decoder.feed(0.5, PING))
    text = io.StringIO()
    Console(file=text, width=100).print(
        view(Snapshot("7 asked", servo_rows(line), ()), packets, 40)
    )
    shown = text.getvalue().splitlines()
    assert shown[0].strip() == "7 asked"
    assert len(shown) == 1 + 1 + 2 + 1
    assert "ping" in shown[-1]
    assert len(shown[-1].rstrip()) <= 40


def test_80_columns_hold_the_headings_and_the_largest_values() -> None:
    """Rows of a chain of which some measure their current and some their load."""
    line = SimLine(ServoBank([1, 25], ["XM430-W350", "XL430-W250"]), BenchPlant(2))
    line.bank["Goal Position"][:] = -1_048_575
    line.bank["Present Velocity"][:] = -1023
    rows = servo_rows(line)
    text = io.StringIO()
    Console(file=text, width=80).print(view(Snapshot("", rows, ()), deque(), 80))
    _, headings, *shown = text.getvalue().splitlines()
    assert headings.split() == list(rows[0])
    assert [each.split() for each in shown[:2]] == [list(map(str, r.values())) for r in rows]
