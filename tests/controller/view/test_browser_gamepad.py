"""A gamepad in somebody's browser: what is taken of it, by whom, and how its silence is taken."""

import http.client
import json
from collections.abc import Iterator

import pytest

pytest.importorskip("viser")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from snakewalk.controller.view.browser_gamepad import SCRIPT, BrowserGamepad, read_state
from snakewalk.controller.view.dead_man import STALE_S, WITHOUT, DeadMan, hold_command
from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.page_server import open_page


def state(*pressed: int, axes: tuple[float, ...] = (0.0, 0.0), mapping: str = "standard") -> str:
    buttons = [int(k in pressed) for k in range(17)]
    return json.dumps({"name": "Pad", "mapping": mapping, "axes": axes, "buttons": buttons})


class Pads:
    def __init__(self) -> None:
        self.now_s, self.stops = 50.0, 0
        self.gamepad = BrowserGamepad(lambda: self.now_s)
        self.gamepad.on_stop = self.stop

    def stop(self) -> None:
        self.stops += 1

    def take(self, message: str, source: str = "a") -> bool:
        self.now_s += 0.02
        return self.gamepad.take(source, message)


def test_what_is_pressed_after_it_was_seen_are_keys() -> None:
    pads = Pads()
    pads.take(state(0))  # the press by which a browser comes to know it
    assert pads.gamepad.commands() == [hold_command(False, pads.now_s)]
    pads.take(state(0, 4))
    assert pads.gamepad.commands() == [hold_command(True, pads.now_s)]
    pads.take(state(4, 1, 12))
    pads.take(state(4, 9))
    assert pads.gamepad.commands() == ["m", "up", "q", hold_command(True, pads.now_s)]
    assert pads.gamepad.commands() == []


def test_a_stick_counts_once_each_time_it_leaves_the_middle() -> None:
    pads = Pads()
    for x, y in ((0.0, 0.0), (0.6, 0.0), (0.9, 0.0), (0.1, -0.8), (-0.7, 0.0)):
        pads.take(state(axes=(x, y)))
    assert pads.gamepad.commands()[:-1] == ["right", "up", "left"]


def test_a_stop_button_stops_at_once_whoever_steers() -> None:
    pads = Pads()
    pads.take(state(4))
    pads.take(state(11), "b")
    assert pads.stops == 1
    pads.take(state(11), "b")
    assert pads.stops == 1
    pads.take(state(4, 16))
    assert pads.stops == 2
    pads.take(state(11), "c")  # down as it is seen first
    assert pads.stops == 3


def test_a_press_that_waited_in_the_line_steers_nothing_but_a_stop_still_stops() -> None:
    pads = Pads()
    pads.take(state(4))
    pads.gamepad.commands()
    since_s = pads.now_s
    pads.now_s += 1.5
    assert pads.gamepad.take("a", state(4, 1), since_s)
    assert pads.gamepad.commands() == []
    assert pads.gamepad.take("a", state(4, 11), since_s)
    assert pads.stops == 1
    assert pads.gamepad.take("a", state(4), pads.now_s)
    assert pads.gamepad.take("a", state(4, 1), pads.now_s - 0.5)
    assert pads.gamepad.commands() == ["m", hold_command(True, pads.now_s)]


def test_one_steers_until_it_goes_or_says_nothing_any_more() -> None:
    pads = Pads()
    pads.take(state(4))
    pads.take(state(), "b")
    pads.take(state(0), "b")
    assert pads.gamepad.commands() == [hold_command(True, pads.now_s - 0.04)]
    pads.now_s += STALE_S
    assert pads.gamepad.is_stale
    pads.take(state(), "b")
    assert pads.gamepad.commands() == [hold_command(False, pads.now_s)]
    pads.gamepad.leave("b")
    pads.gamepad.leave("never seen")
    assert pads.gamepad.state is None
    assert pads.gamepad.commands() == [hold_command(False, pads.now_s)]
    pads.take("null")
    assert pads.gamepad.commands() == []
    pads.take(state(5))
    assert pads.gamepad.commands() == [hold_command(True, pads.now_s)]
    pads.take("null")
    assert pads.gamepad.commands() == [hold_command(False, pads.now_s)]


def test_a_gamepad_whose_layout_is_not_known_does_nothing() -> None:
    pads = Pads()
    pads.take(state(mapping=""))
    pads.take(state(0, 4, 11, mapping=""))
    assert pads.stops == 0
    assert pads.gamepad.commands() == [hold_command(False, pads.now_s)]
    assert pads.gamepad.state is not None
    assert not pads.gamepad.state.standard


@pytest.mark.parametrize(
    "message",
    [
        "", "{}", "[]", "7", "x" * 3000, b"\xff\xfe", state(axes=(float("nan"), 0.0)),
        state().replace("[0.0, 0.0]", "3"), state().replace("[0.0, 0.0]", '["a"]'),
    ],
)  # fmt: skip
def test_what_no_script_of_ours_sends_closes_the_line(message: str | bytes) -> None:
    pads = Pads()
    assert not pads.gamepad.take("a", message)
    assert pads.gamepad.commands() == []


def test_a_flood_closes_the_line() -> None:
    gamepad = BrowserGamepad(lambda: 5.0)
    assert [gamepad.take("a", state()) for _ in range(101)] == [True] * 100 + [False]


def test_who_lets_go_or_says_nothing_stops_the_body_until_it_is_done_without() -> None:
    now_s = [10.0]
    dead_man = DeadMan(lambda: now_s[0])
    assert dead_man.is_enabled
    assert dead_man.process(["m", hold_command(True, 10.0), "frequency_hz=0.4"]) == [
        "m",
        "frequency_hz=0.4",
    ]
    now_s[0] = 10.29
    assert dead_man.is_enabled
    now_s[0] = 10.31
    assert not dead_man.is_enabled
    dead_man.process([hold_command(True, 10.0)])  # it came late
    assert not dead_man.is_enabled
    dead_man.process([hold_command(True, 10.3)])
    assert dead_man.is_enabled
    dead_man.process([hold_command(False, 10.31)])
    assert not dead_man.is_enabled
    dead_man.process([WITHOUT])
    assert dead_man.is_enabled


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[int, str, BrowserGamepad]]:
    gamepad = BrowserGamepad(lambda: 100.0)  # a busy machine makes nothing late
    server, url = open_page("0.0.0.0", 0, gamepad, freshness=Freshness(lambda: 100.0))
    yield server.get_port(), url.rpartition("=")[2], gamepad
    server.stop()


def test_the_page_has_the_script_and_its_socket_is_behind_the_gate(
    served: tuple[int, str, BrowserGamepad],
) -> None:
    port, token, gamepad = served
    cookie = {"Cookie": f"snakewalk-{port}={token}"}
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=60.0)
    line.request("GET", "/", headers=cookie | {"Accept-Encoding": "gzip"})
    answer = line.getresponse()
    assert SCRIPT in answer.read().decode()
    assert answer.getheader("Content-Encoding") == "identity"
    line.close()
    address = f"ws://127.0.0.1:{port}/gamepad"
    own = {"Origin": f"http://127.0.0.1:{port}"}
    for headers, status in (
        ({}, 403),
        (own, 401),
        (cookie, 403),
        (cookie | {"Origin": "http://evil.example"}, 403),
    ):
        with pytest.raises(InvalidStatus) as refused, connect(address, additional_headers=headers):
            pass
        assert refused.value.response.status_code == status
    with connect(address, additional_headers=cookie | own) as socket:
        for message in (state(), state(4, 1)):
            socket.send(message)
            assert socket.recv(60.0) == "taken"
        assert gamepad.state is not None
        assert gamepad.state.is_enabled
        assert gamepad.commands()[0] == "m"
        socket.send("nothing of ours")
        with pytest.raises(ConnectionClosed):
            socket.recv(60.0)
    assert gamepad.commands() == [hold_command(False, 100.0)]


NO_STATE = [
    "[" * 1900,
    '{"a":' * 390,
    "[1]",
    "7",
    '"x"',
    '{"axes":[1e999],"buttons":[],"name":"","mapping":""}',
    json.dumps({"axes": [10**400], "buttons": [], "name": "", "mapping": "standard"}),
]


@pytest.mark.parametrize("text", NO_STATE, ids=range(len(NO_STATE)))
def test_what_is_no_state_of_a_gamepad_is_a_value_error(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011
        read_state(text)


DAMAGED = [
    "pad=1@",
    "pad=1",
    "pad=1@soon",
    "pad=1@nan",
    "pad=1@inf",
    "pad=1@5.2",
    "pad=",
    "pad=2",
]


@pytest.mark.parametrize("command", DAMAGED)
def test_a_damaged_or_future_word_of_a_gamepad_moves_nothing_and_is_handed_on(command: str) -> None:
    dead_man = DeadMan(lambda: 5.0)
    assert dead_man.process([hold_command(False, 4.9)]) == []
    assert dead_man.process([command, "d"]) == [command, "d"]
    assert not dead_man.is_enabled
    assert dead_man.process([hold_command(True, 5.0)]) == []
    assert dead_man.is_enabled
