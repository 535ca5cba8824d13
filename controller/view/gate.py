"""Access to the page, checked at every request before viser.

viser serves every program that reaches its port, browsers let any web page send requests here, and
every user of this machine reaches 127.0.0.1. So a request must name an expected host, a socket must
come from our page, and both need the token, which a cookie keeps.
"""

import asyncio
import hmac
import http
import ipaddress
import re
import secrets
import socket
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from snakewalk.controller.view.fresh_line import FreshConnection, Freshness

_LOCAL = frozenset({"127.0.0.1", "localhost", "::1"})
_ANY_ADDRESS = frozenset({"0.0.0.0", "::"})
_HOST = re.compile(r"(?P<name>\[[0-9A-Fa-f:.]+\]|[\w.-]+)(:\d+)?")
_ASK = (
    "<!doctype html><title>snakewalk</title><meta name=viewport content='width=device-width'>"
    "<body style='font:16px system-ui;margin:3em'><form><p>{}</p><input name=token autofocus "
    "type=password aria-label=token> <button>open</button></form>"
)
_CHECK_S = 5.0
_PAGES = ("/", "/index.html")
_WORKER = "/stop.js"
_WORKER_SCRIPT = Path(__file__).with_name("end_worker.js").read_text(encoding="utf-8")
"""Program of the browser that shows the end of a run without its server."""
_LOOK = Path(__file__).with_name("page_look.js").read_text(encoding="utf-8")
"""Script with the look of every page."""
Serve = Callable[..., Any]


class Insert(Protocol):
    """A script of this program in the page, and the socket that it opens."""

    path: str
    """Path of the socket."""
    script: str

    async def serve(self, connection: Any) -> None:
        """Talk to the script of one browser."""
        ...


class Gate:
    """Lets requests pass, or answers them itself."""

    def __init__(self, host: str, *inserts: Insert, freshness: Freshness | None = None) -> None:
        self._inserts = {insert.path: insert for insert in inserts}
        self._freshness = Freshness() if freshness is None else freshness
        self._host = host
        self.token = secrets.token_urlsafe(16)
        """Token that each browser needs once."""

    def answer(self, request: Request, port: int) -> Response | None:
        """Return the refusal, or None if the request may pass."""
        host = _single_header(request, "Host")
        if not self._is_expected_host(host):
            text = f"{escape(host) or 'no host'}: the page is not served by this name"
            return _response(http.HTTPStatus.FORBIDDEN, text)
        needs_origin = bool(request.headers.get_all("Origin") or request.headers.get_all("Upgrade"))
        if needs_origin and not _is_origin_of_host(_single_header(request, "Origin"), host):
            return _response(http.HTTPStatus.FORBIDDEN, "another page may not open this one")
        cookie = f"snakewalk-{port}"
        if self._is_right_password(_cookie(request, cookie)):
            return None
        given = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        if self._is_right_password(given):
            response = _response(http.HTTPStatus.SEE_OTHER, "")
            response.headers["Location"] = "/"
            kept = f"{cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
            response.headers["Set-Cookie"] = kept
            return response
        text = "That is another token." if given else "The token that the command has printed:"
        return _response(http.HTTPStatus.UNAUTHORIZED, _ASK.format(escape(text)))

    def _is_right_password(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(errors="replace"), self.token.encode())

    def _is_expected_host(self, host: str) -> bool:
        """Whether a request may name this host: a name of another page may lead here."""
        match = _HOST.fullmatch(host)
        if match is None:
            return False
        name = match["name"].lower().strip("[]").removesuffix(".")
        if self._host in _LOCAL or name in _LOCAL:
            return name in _LOCAL
        if name == self._host.lower().removesuffix("."):
            return True
        if self._host not in _ANY_ADDRESS:
            return False
        host_name, _, _ = socket.gethostname().lower().partition(".")
        return _is_address(name) or name.partition(".")[0] == host_name

    def guard(self, serve: Serve) -> Serve:
        """Return a ``websockets`` server that asks this gate before its own ``process_request``.

        It has the scripts of the inserts in its page, leads their sockets to them, and drops late
        messages to viser.
        """
        inserts = self._inserts

        def guarded(handler: Serve, *args: Any, process_request: Any = None, **options: Any) -> Any:
            def ask(connection: Any, request: Request) -> Response | None:
                port = connection.local_address[1]
                refusal = self.answer(request, port)
                if refusal is not None or process_request is None:
                    return refusal
                path = urlsplit(request.path).path
                if path == _WORKER:
                    return _response(http.HTTPStatus.OK, _WORKER_SCRIPT, "text/javascript")
                is_page = path in _PAGES
                if is_page and "Accept-Encoding" in request.headers:
                    del request.headers["Accept-Encoding"]  # the page is changed: uncompressed
                passed: Response | None = process_request(connection, request)
                if is_page and passed is not None:
                    scripts = (insert.script for insert in inserts.values())
                    _add_scripts(passed, [_LOOK, *scripts])
                return passed

            async def handle(connection: Any) -> None:
                insert = inserts.get(urlsplit(connection.request.path).path)
                proof = asyncio.create_task(connection.prove())
                try:
                    await (handler if insert is None else insert.serve)(connection)
                finally:
                    proof.cancel()

            options["create_connection"] = partial(
                FreshConnection, freshness=self._freshness, late_paths=inserts
            )
            return serve(handle, *args, process_request=ask, **options)

        return guarded

    def install(self, make: Callable[[], Any]) -> Any:
        """Make a viser server behind this gate; its port must be open when ``make`` returns.

        viser has no place for it, so its call of ``websockets`` is wrapped while it starts.
        """
        server = websockets.asyncio.server
        serve = server.serve
        server.serve = self.guard(serve)  # type: ignore[assignment,misc]
        try:
            return make()
        finally:
            server.serve = serve  # type: ignore[misc]

    def is_shut(self, host: str, port: int) -> bool:
        """Whether a request that names another host is refused: the gate is where it should be."""
        check_host = "127.0.0.1" if host == "0.0.0.0" else host
        with socket.create_connection((check_host, port), _CHECK_S) as line:
            line.sendall(b"GET / HTTP/1.1\r\nHost: elsewhere.example\r\nOrigin: http://x\r\n\r\n")
            return line.recv(64).startswith(b"HTTP/1.1 403")


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_origin_of_host(origin: str, host: str) -> bool:
    try:
        place = urlsplit(origin)
    except ValueError:
        return False
    return place.scheme in {"http", "https"} and place.netloc.lower() == host.lower()


def _single_header(request: Request, header: str) -> str:
    """Value of a header that is there once; else empty."""
    values = request.headers.get_all(header)
    return values[0] if len(values) == 1 else ""


def _add_scripts(response: Response, scripts: Sequence[str]) -> None:
    """Put scripts into a page, before everything else."""
    head = "<head>" + "".join(f"<script>{script}</script>" for script in scripts)
    response.body = response.body.replace(b"<head>", head.encode(), 1)
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))


def _cookie(request: Request, name: str) -> str:
    try:
        cookies = SimpleCookie("; ".join(request.headers.get_all("Cookie")))
    except CookieError:
        return ""
    return cookies[name].value if name in cookies else ""


def _response(status: http.HTTPStatus, text: str, kind: str = "text/html") -> Response:
    body = text.encode(errors="replace")
    headers = Headers(
        [
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Connection", "close"),
        ]
    )
    return Response(status.value, status.phrase, headers, body)
