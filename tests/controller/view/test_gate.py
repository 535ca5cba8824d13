"""Who may open the page."""

import http.client
from collections.abc import Iterator

import pytest

pytest.importorskip("viser")

from websockets.datastructures import Headers
from websockets.http11 import Request

from snakewalk.config.errors import InputError
from snakewalk.controller.view.gate import Gate
from snakewalk.controller.view.live_view import host_and_port
from snakewalk.controller.view.page_server import open_page


def ask(gate: Gate, path: str = "/", **headers: str) -> int:
    answer = gate.answer(Request(path, Headers(headers)), 8080)
    return 200 if answer is None else answer.status_code


def test_a_local_page_answers_this_machine_and_itself_only() -> None:
    gate = Gate("127.0.0.1")
    assert ask(gate, host="127.0.0.1:8080") == 200
    assert ask(gate, host="localhost:8080", origin="http://localhost:8080") == 200
    assert ask(gate, host="evil.example:8080") == 403  # a name that leads here
    assert ask(gate, host="127.0.0.1:8080", origin="http://evil.example") == 403
    assert ask(gate) == 403


def test_beyond_this_machine_a_token_is_asked_for_once() -> None:
    gate = Gate("0.0.0.0")
    assert gate.token is not None
    assert len(gate.token) >= 20
    assert ask(gate, host="robot:8080") == 401
    assert ask(gate, "/?token=guess", host="robot:8080") == 401
    assert ask(gate, host="robot:8080", cookie="snakewalk-8080=guess") == 401
    assert ask(gate, f"/?token={gate.token}", host="robot:8080") == 303
    assert ask(gate, host="robot:8080", cookie=f"snakewalk-8080={gate.token}") == 200
    assert ask(gate, host="robot:8080", cookie=f"a=b; snakewalk-8080={gate.token}") == 200
    other = ask(
        gate,
        host="robot:8080",
        origin="http://evil.example",
        cookie=f"snakewalk-8080={gate.token}",
    )
    assert other == 403
    assert Gate("0.0.0.0").token != gate.token


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[int, str]]:
    server, url = open_page("0.0.0.0", 0)
    yield server.get_port(), url.rpartition("=")[2]
    server.stop()


@pytest.mark.parametrize("host", ["192.0.2.1", "[::1", 70 * "x", "a..b"])
def test_a_host_that_is_not_here_is_refused(host: str) -> None:
    with pytest.raises(OSError, match="is no address of this machine, which has"):
        open_page(host, 0)


@pytest.mark.parametrize("path", ["/", "/index.html"])
def test_the_server_has_the_gate_in_front_of_files_and_sockets(
    served: tuple[int, str], path: str
) -> None:
    port, token = served
    upgrade = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    cookie = {"Cookie": f"snakewalk-{port}={token}"}
    statuses = []
    for headers in ({}, upgrade, cookie, upgrade | cookie):
        line = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
        line.request("GET", path, headers=headers)
        statuses.append(line.getresponse().status)
        line.close()
    assert statuses == [401, 401, 200, 101]


def test_the_address_is_read() -> None:
    assert host_and_port("0.0.0.0:9000") == ("0.0.0.0", 9000)
    assert host_and_port("robot") == ("robot", 8080)
    for wrong in ("", ":80", "robot:", "robot:x", "robot:70000"):
        with pytest.raises(InputError, match="expected HOST"):
            host_and_port(wrong)
