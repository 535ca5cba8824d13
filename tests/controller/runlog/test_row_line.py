"""The line between a run and its page: the run never waits, and old measurements are dropped."""

import json
import socket

import pytest

from snakewalk.controller.runlog.row_line import ObserverEnd, RunEnd

CYCLE = b'{"k":%d,"values":"' + b"1.234567," * 800 + b'"}'


def ends() -> tuple[RunEnd, ObserverEnd, socket.socket]:
    ours, far = socket.socketpair()
    return RunEnd(ours), ObserverEnd(far), far


def cycle(run: RunEnd, k: int) -> None:
    for topic in ("/cycle", "/pose"):
        run.add(topic, CYCLE % k)


def test_a_page_that_never_reads_costs_the_run_nothing_and_keeps_little() -> None:
    run, page, _ = ends()
    run.add("/config", b'{"format":1}')
    page.ask()  # and then it stands still
    for k in range(2000):
        cycle(run, k)
        run.add("/event", b'{"kind":"limit","k":%d}' % k)
    held = sum(map(len, run._kept)) + sum(map(len, run._newest.values())) + len(run._out)
    assert held < 120_000  # a thousand events, one cycle


def test_a_page_gets_every_event_in_order_and_of_cycles_the_newest_when_it_asks() -> None:
    run, page, _ = ends()
    run.add("/config", b'{"format":1}')
    for k in range(300):
        cycle(run, k)
    run.add("/event", b'{"kind":"start"}')
    assert [topic for topic, _ in page.rows(1.0)] == ["/config", "/event"]
    page.ask()
    cycle(run, 300)
    assert [(topic, row["k"]) for topic, row in page.rows(1.0)] == [("/cycle", 300), ("/pose", 300)]
    cycle(run, 301)  # it has not asked again
    assert list(page.rows(0.0)) == []


def test_orders_reach_the_run_whole_whatever_pieces_they_come_in() -> None:
    run, page, far = ends()
    page.command("frequency_hz=0.4")
    page.command("two\nlines")
    far.sendall(b"gait=side")
    assert run.commands() == ["frequency_hz=0.4", "two lines"]
    far.sendall(b"winding\n\xff\n")
    assert run.commands() == ["gait=sidewinding", "\ufffd"]
    assert run.commands() == []
    for k in range(300):
        page.command(str(k))
        run.pump()
    assert run.commands() == [str(k) for k in range(200, 300)]  # the newest hundred
    far.sendall(b"7" * 100_000)  # a trajectory is as long
    assert run.commands() == []
    far.sendall(b"\n")
    assert run.commands() == ["7" * 100_000]
    for _ in range(20):  # a line without an end
        far.sendall(b"x" * 100_000)
        run.pump()
    assert len(run._in) <= 1 << 20
    far.close()
    run.commands()


def test_what_does_not_fit_the_socket_goes_on_where_it_stopped() -> None:
    run, page, _ = ends()
    long = json.dumps({"z_m": "7" * 2_000_000}).encode()
    run.add("/config", long)
    rows = list(page.rows(1.0))
    while not rows:
        run.pump()
        rows = list(page.rows(0.0))
    assert rows == [("/config", json.loads(long))]


def test_a_dead_page_does_not_end_the_run() -> None:
    run, _, far = ends()
    far.close()
    for k in range(100):
        cycle(run, k)
        run.add("/event", b"{}")
    run.close(0.1)


def test_the_last_rows_are_sent_at_the_end_and_the_page_is_told() -> None:
    run, page, _ = ends()
    cycle(run, 7)
    run.close(1.0)
    assert [row["k"] for _, row in page.rows(1.0)] == [7, 7]
    with pytest.raises(EOFError):
        list(page.rows(1.0))


def test_a_stopped_page_holds_the_end_of_a_run_up_no_longer_than_it_may() -> None:
    run, _, _ = ends()
    run.add("/config", b"x" * 5_000_000)
    run.close(0.01)


def test_a_line_that_is_too_long_is_rejected_and_the_next_arrives() -> None:
    run, _, far = ends()
    for part in (b"x" * 100_000,) * 12:
        far.sendall(part)
        assert run.commands() == []
    far.sendall(b'"]}\nfrequency_hz=0.4\n')
    assert run.commands() == ["frequency_hz=0.4"]
    assert run.rejected() == ["a command of 1.2 MB; at most 1.0 MB is accepted"]
    assert run.rejected() == []
    far.sendall(b"x" * 100_000 + b"\n")
    assert [len(line) for line in run.commands()] == [100_000]


def test_of_a_flood_the_newest_hundred_are_kept_and_the_rest_is_reported() -> None:
    run, _, far = ends()
    far.sendall(b"".join(b"%d\n" % k for k in range(1000)))
    assert run.commands() == [str(k) for k in range(900, 1000)]
    assert set(run.rejected()) == {"more than 100 commands at once; the oldest are dropped"}


def test_an_observer_never_waits_for_a_run_that_does_not_receive() -> None:
    run, page, _ = ends()
    for k in range(100):
        page.command(f"{k}:" + "x" * 200_000)
        page.ask()
        assert list(page.rows(0.0)) == []
    assert sum(map(len, page._waiting)) <= 4 << 20
    arrived: list[str] = []
    while page._has_more:
        arrived += run.commands()
        list(page.rows(0.0))
    arrived += run.commands() + run.commands()
    assert {len(line.partition(":")[2]) for line in arrived} == {200_000}, "only whole lines"
    assert arrived[-1].startswith("99:")
    run.add("/cycle", b"{}")
    run.add("/pose", b"{}")
    assert [topic for topic, _ in page.rows(1.0)] == ["/cycle", "/pose"], "no request was dropped"


def test_an_observer_that_closed_or_stopped_is_known() -> None:
    run, page, far = ends()
    now_s = 0.0

    def cycles(seconds: float, step_s: float = 0.02) -> bool:
        nonlocal now_s
        for _ in range(round(seconds / step_s)):
            now_s += step_s
            cycle(run, 1)
            silent = run.is_silent(now_s)
        return silent

    assert not cycles(10.0), "it may still build its scene"
    for _ in range(3):
        page.ask()
        assert not cycles(2.0)
    assert cycles(1.5), "it was sent rows and has not asked again"
    page.ask()
    assert not cycles(1.0)
    now_s += 100.0  # the run stood still, not the page
    assert not run.is_silent(now_s)
    assert not run.is_closed
    far.close()
    cycle(run, 2)
    assert run.is_closed
