"""Raw requests to the page, as no browser sends them: it answers or closes, and serves on."""

import contextlib
import http.client
import json
import logging
import socket
import struct
from collections.abc import Iterator
from typing import Final

import pytest

pytest.importorskip("viser")

from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.page_server import open_page
from snakewalk.controller.view.stop_element import StopElement

PATIENCE_S: Final = 60.0
HOST: Final = b"Host: 127.0.0.1\r\n"
GET: Final = b"GET / HTTP/1.1\r\n"
UPGRADE: Final = (
    b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
)

WITHOUT_TOKEN: Final = {
    "nothing": b"",
    "an empty line": b"\r\n\r\n",
    "zeros": bytes(4096),
    "random bytes": bytes(range(256)) * 8,
    "a TLS hello": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(64),
    "HTTP/2 preface": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "an SSH greeting": b"SSH-2.0-OpenSSH_9.6\r\n",
    "a long line": b"GET /" + b"a" * 70_000 + b" HTTP/1.1\r\n\r\n",
    "a long header": GET + HOST + b"X: " + b"a" * 70_000 + b"\r\n\r\n",
    "1,000 headers": GET + HOST + b"X: 1\r\n" * 1000 + b"\r\n",
    "no host": GET + b"\r\n",
    "two hosts": GET + HOST + b"Host: evil.example\r\n\r\n",
    "a host of raw bytes": GET + b"Host: \xff\xfe\x80\r\n\r\n",
    "a host of raw bytes and a port": GET + b"Host: \xe9:8080\r\n\r\n",
    "a host in Latin-1": GET + "Host: m\xfcller\r\n\r\n".encode("latin-1"),
    "a host in UTF-8": GET + "Host: m\xfcller\r\n\r\n".encode(),
    "a host with a script": GET + b"Host: <script>alert(1)</script>\r\n\r\n",
    "another host": GET + b"Host: evil.example\r\n\r\n",
    "a bare word": b"stop\r\n\r\n",
    "POST": b"POST /stop HTTP/1.1\r\n" + HOST + b"Content-Length: 4\r\n\r\nstop",
    "PUT": b"PUT / HTTP/1.1\r\n" + HOST + b"\r\n",
    "CONNECT": b"CONNECT example.org:443 HTTP/1.1\r\n" + HOST + b"\r\n",
    "HTTP/0.9": b"GET /\r\n",
    "HTTP/1.0": b"GET / HTTP/1.0\r\n" + HOST + b"\r\n",
    "HTTP/9.9": b"GET / HTTP/9.9\r\n" + HOST + b"\r\n",
    "a way out of the folder": b"GET /../../etc/passwd HTTP/1.1\r\n" + HOST + b"\r\n",
    "an encoded way out": b"GET /%2e%2e/%2e%2e/etc/passwd HTTP/1.1\r\n" + HOST + b"\r\n",
    "a path of raw bytes": b"GET /\xff\xfe HTTP/1.1\r\n" + HOST + b"\r\n",
    "a wrong token": b"GET /?token=guess HTTP/1.1\r\n" + HOST + b"\r\n",
    "1,000 tokens": b"GET /?" + b"token=a&" * 1000 + b" HTTP/1.1\r\n" + HOST + b"\r\n",
    "a damaged cookie": GET + HOST + b"Cookie: =;;\xff=\x01\r\n\r\n",
    "the worker without a token": b"GET /stop.js HTTP/1.1\r\n" + HOST + b"\r\n",
    "a socket without origin": b"GET /stop HTTP/1.1\r\n" + HOST + UPGRADE + b"\r\n",
    "a socket of another page": b"GET /stop HTTP/1.1\r\n"
    + HOST
    + UPGRADE
    + b"Origin: http://evil.example\r\n\r\n",
    "half a request": GET + b"Ho",
}
"""Bytes of a client that has no token."""


def frame(code: int, data: bytes, *, mask: bytes = b"\0\0\0\0", length: int | None = None) -> bytes:
    """Frame of a WebSocket, from a client, whose mask changes nothing."""
    size = len(data) if length is None else length
    head = bytes([0x80 | code])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 65_536:
        head += bytes([0x80 | 126]) + struct.pack("!H", size)
    else:
        head += bytes([0x80 | 127]) + struct.pack("!Q", size)
    return head + mask + data


WITH_TOKEN: Final = {
    "an unknown word": frame(1, b"nosuch"),
    "a long word": frame(1, b"late " + b"9" * 500),
    "a tab of 100,000 letters": frame(1, b"tab " + b"x" * 100_000),
    "bytes instead of text": frame(2, b"\xff\xfe"),
    "text that is no UTF-8": frame(1, b"\xff\xfe"),
    "JSON nested 100,000 deep": frame(1, b"[" * 100_000),
    "a length of 2^62": frame(1, b"", length=1 << 62),
    "an unmasked frame": b"\x81\x04stop",
    "a reserved code": frame(7, b"stop"),
    "a pong of nobody": frame(10, b"12345678"),
    "a close with one byte": frame(8, b"\x03"),
    "half a frame": b"\x81",
}
"""Bytes on the socket of E-STOP after it was opened with the token."""


@pytest.fixture(scope="module")
def page() -> Iterator[tuple[int, str, list[str]]]:
    presses: list[str] = []
    freshness = Freshness()
    stop = StopElement(freshness)
    stop.press = lambda sender: presses.append(sender) or "stop requested"  # type: ignore[func-returns-value]
    server, url = open_page("127.0.0.1", 0, stop, freshness=freshness)
    stop.arm()
    yield server.get_port(), url.rpartition("=")[2], presses
    server.stop()


def answer(port: int, data: bytes, frames: bytes = b"") -> bytes:
    """All that the server answers before it closes; frames follow the first answer."""
    with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as line:
        received = b""
        with contextlib.suppress(OSError):  # closed before everything was sent
            line.sendall(data)
            if frames:
                received = line.recv(1 << 16)
                line.sendall(frames)
            if frames or not data.endswith(b"\r\n\r\n"):
                line.shutdown(socket.SHUT_WR)
        with contextlib.suppress(ConnectionResetError):
            while piece := line.recv(1 << 16):
                received += piece
        return received


def serves_on(port: int, token: str) -> bool:
    """Whether a browser with the token still gets the page's worker."""
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    line.request("GET", "/stop.js", headers={"Cookie": f"snakewalk-{port}={token}"})
    is_there = line.getresponse().status == http.HTTPStatus.OK
    line.close()
    return is_there


@pytest.mark.parametrize("what", WITHOUT_TOKEN)
def test_a_client_without_a_token_gets_nothing_and_stops_nothing(
    page: tuple[int, str, list[str]], what: str, caplog: pytest.LogCaptureFixture
) -> None:
    port, token, presses = page
    with caplog.at_level(logging.ERROR, "websockets.server"):
        received = answer(port, WITHOUT_TOKEN[what])
    status = received.split(b"\r\n")[0]
    assert status == b"" or status.split()[1] in (b"400", b"401", b"403", b"405", b"414", b"431")
    assert b"Traceback" not in received
    assert b"<script>" not in received
    assert presses == []
    assert serves_on(port, token)


@pytest.mark.parametrize("what", WITH_TOKEN)
def test_damaged_frames_stop_nothing_and_close_only_their_own_connection(
    page: tuple[int, str, list[str]], what: str
) -> None:
    port, token, presses = page
    opening = (
        b"GET /stop HTTP/1.1\r\n"
        + f"Host: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n".encode()
        + f"Cookie: snakewalk-{port}={token}\r\n".encode()
        + UPGRADE
        + b"\r\n"
    )
    received = answer(port, opening, WITH_TOKEN[what])
    assert received.startswith(b"HTTP/1.1 101")
    assert presses == []
    assert serves_on(port, token)


def test_the_worker_is_served_with_the_token_as_a_script(page: tuple[int, str, list[str]]) -> None:
    port, token, _ = page
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    line.request("GET", "/stop.js", headers={"Cookie": f"snakewalk-{port}={token}"})
    response = line.getresponse()
    assert response.getheader("Content-Type") == "text/javascript; charset=utf-8"
    assert b"caches" in response.read()
    line.close()


def test_a_press_is_still_possible_afterwards(page: tuple[int, str, list[str]]) -> None:
    from websockets.sync.client import connect

    port, token, presses = page
    headers = {"Cookie": f"snakewalk-{port}={token}", "Origin": f"http://127.0.0.1:{port}"}
    with connect(f"ws://127.0.0.1:{port}/stop", additional_headers=headers) as line:
        assert json.loads(line.recv(PATIENCE_S))["armed"]
        line.send("stop")
        assert json.loads(line.recv(PATIENCE_S))["text"] == "stop requested"
    assert presses == ["E-STOP of the page"]
