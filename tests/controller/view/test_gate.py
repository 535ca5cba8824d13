"""Who may open the page."""

import http.client
import socket
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


SOCKET = {"upgrade": "websocket"}


def kept(gate: Gate) -> dict[str, str]:
    return {"cookie": f"snakewalk-8080={gate.token}"}


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "0.0.0.0", "robot"])
def test_a_token_is_asked_for_once_wherever_the_page_is_served(host: str) -> None:
    gate = Gate(host)
    assert len(gate.token) >= 20
    assert Gate(host).token != gate.token
    name = f"[{host}]:8080" if ":" in host else f"{host}:8080"
    cookie = kept(gate)["cookie"]
    assert ask(gate, host=name) == 401
    assert ask(gate, "/?token=guess", host=name) == 401
    assert ask(gate, "/?token=%ff\udcff", host=name) == 401
    assert ask(gate, host=name, cookie="snakewalk-8080=guess") == 401
    assert ask(gate, host=name, cookie=cookie.replace("8080", "8081")) == 401
    assert ask(gate, f"/?token={gate.token}", host=name) == 303
    assert ask(gate, host=name, cookie=cookie) == 200
    assert ask(gate, host=name, cookie=f"a=b; {cookie}") == 200


@pytest.mark.parametrize(
    ("served", "names", "others"),
    [
        ("127.0.0.1", ["127.0.0.1:8080", "localhost:9000", "[::1]:8080", "LOCALHOST."], ["robot"]),
        ("0.0.0.0", ["192.168.0.7:8080", "[fe80::1]:80", "localhost"], ["evil.example:8080"]),
        ("robot.lan", ["robot.lan:8080", "ROBOT.lan"], ["robot.evil.example", "192.168.0.7"]),
    ],
)
def test_only_expected_hosts_pass_even_with_the_token(
    served: str, names: list[str], others: list[str]
) -> None:
    gate = Gate(served)
    for name in names:
        assert ask(gate, host=name, **kept(gate)) == 200, name
    raw = "\xff\xfe"
    wrong = [raw, "", "evil.example", "127.0.0.1.evil.example", "[", "a b", "@127.0.0.1"]
    for name in [*others, *wrong]:
        assert ask(gate, host=name, **kept(gate)) == 403, name
    assert ask(gate, **kept(gate)) == 403
    twice = Headers([("Host", names[0]), ("Host", "evil.example"), *kept(gate).items()])
    refusal = gate.answer(Request("/", twice), 8080)
    assert refusal is not None
    assert refusal.status_code == 403


def test_this_machine_has_its_own_name_in_every_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "Robot.example.org")
    gate = Gate("0.0.0.0")
    for name in ("robot:8080", "robot.local:8080", "robot.lan"):
        assert ask(gate, host=name, **kept(gate)) == 200
    assert ask(gate, host="robots.lan", **kept(gate)) == 403


def test_a_socket_is_opened_by_the_page_itself_only() -> None:
    gate = Gate("127.0.0.1")
    known = {"host": "127.0.0.1:8080", **kept(gate)}
    assert ask(gate, origin="http://127.0.0.1:8080", **known, **SOCKET) == 200
    for origin in (
        "http://evil.example",
        "http://127.0.0.1:9000",
        "http://localhost:8080",
        "null",
        "",
        "http://[",
        "file://127.0.0.1:8080",
    ):
        assert ask(gate, origin=origin, **known, **SOCKET) == 403, origin
        assert ask(gate, origin=origin, **known) == 403, origin
    assert ask(gate, **known, **SOCKET) == 403, "a browser always names its page"
    assert ask(gate, host="127.0.0.1:8080", origin="http://127.0.0.1:8080", **SOCKET) == 401


@pytest.fixture(scope="module", params=["0.0.0.0", "127.0.0.1"])
def served(request: pytest.FixtureRequest) -> Iterator[tuple[int, str]]:
    server, url = open_page(request.param, 0)
    yield server.get_port(), url.rpartition("=")[2]
    server.stop()


@pytest.mark.parametrize("host", ["192.0.2.1", "[::1", 70 * "x", "a..b"])
def test_a_host_that_is_not_here_is_refused(host: str) -> None:
    with pytest.raises(OSError, match="is not an address of this machine; use"):
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
    origin = {"Origin": f"http://127.0.0.1:{port}"}
    statuses = []
    for headers in (
        {},
        upgrade,
        upgrade | origin,
        cookie,
        upgrade | cookie,
        upgrade | cookie | origin,
    ):
        line = http.client.HTTPConnection("127.0.0.1", port, timeout=60.0)
        line.request("GET", path, headers=headers)
        statuses.append(line.getresponse().status)
        line.close()
    assert statuses == [401, 403, 401, 200, 403, 101]


def test_the_address_is_read() -> None:
    assert host_and_port("0.0.0.0:9000") == ("0.0.0.0", 9000)
    assert host_and_port("robot") == ("robot", 8080)
    assert host_and_port("robot:65535") == ("robot", 65535)
    for wrong in ("", ":80", "robot:", "robot:x", "robot:65536"):
        with pytest.raises(InputError, match="expected HOST"):
            host_and_port(wrong)
