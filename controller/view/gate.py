"""Who may open the page: checked at every request, before viser sees it.

viser serves whoever reaches its port, and browsers let any web page talk to one on this machine. So
a request has to name the host that is served, a socket has to come from our own page, and beyond
this machine a token is asked for once, and kept in a cookie.
"""

import hmac
import http
import secrets
import socket
from collections.abc import Callable
from html import escape
from http.cookies import CookieError, SimpleCookie
from typing import Any, Final, Protocol
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

_LOCAL: Final = frozenset({"127.0.0.1", "localhost", "::1"})
_ASK: Final = (
    "<!doctype html><title>snakewalk</title><meta name=viewport content='width=device-width'>"
    "<body style='font:16px system-ui;margin:3em'><form><p>{}</p><input name=token autofocus "
    "type=password aria-label=token> <button>open</button></form>"
)
_CHECK_S: Final = 5.0
_PAGES: Final = ("/", "/index.html")
Serve = Callable[..., Any]


class Insert(Protocol):
    """Something of our own in the page: a script, and the socket that it opens."""

    path: str
    """Of the socket."""
    script: str

    async def serve(self, connection: Any) -> None:
        """Talk to the script of one browser."""
        ...


class Gate:
    """Lets requests pass, or answers them itself."""

    def __init__(self, host: str, insert: Insert | None = None) -> None:
        self._insert = insert
        self._local = host in _LOCAL
        self.token = None if self._local else secrets.token_urlsafe(16)
        """Asked for; None where only this machine is served."""

    def answer(self, request: Request, port: int) -> Response | None:
        """Return the refusal, or None where the request may pass."""
        host = request.headers.get("Host", "")
        if self._local and urlsplit(f"//{host}").hostname not in _LOCAL:
            return _response(http.HTTPStatus.FORBIDDEN, "this page is served on this machine only")
        origin = request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return _response(http.HTTPStatus.FORBIDDEN, "another page may not open this one")
        if self.token is None:
            return None
        cookie = f"snakewalk-{port}"
        if self._is_right(_cookie(request, cookie)):
            return None
        given = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        if self._is_right(given):
            response = _response(http.HTTPStatus.SEE_OTHER, "")
            response.headers["Location"] = "/"
            kept = f"{cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/"
            response.headers["Set-Cookie"] = kept
            return response
        text = "That is another token." if given else "The token that the command has printed:"
        return _response(http.HTTPStatus.UNAUTHORIZED, _ASK.format(escape(text)))

    def _is_right(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), (self.token or "").encode())

    def guard(self, serve: Serve) -> Serve:
        """Return a ``websockets`` server that asks this gate before its own ``process_request``.

        It has the insert's script in its page, and leads its socket to the insert.
        """
        insert = self._insert

        def guarded(handler: Serve, *args: Any, process_request: Any = None, **options: Any) -> Any:
            def ask(connection: Any, request: Request) -> Response | None:
                port = connection.local_address[1]
                refusal = self.answer(request, port)
                if refusal is not None or process_request is None:
                    return refusal
                has_script = insert is not None and urlsplit(request.path).path in _PAGES
                if has_script:  # the page is changed, so it must come as it is
                    _ask_for_plain(request)
                passed: Response | None = process_request(connection, request)
                if insert is not None and has_script and passed is not None:
                    _add_script(passed, insert.script)
                return passed

            async def handle(connection: Any) -> None:
                if insert is not None and urlsplit(connection.request.path).path == insert.path:
                    await insert.serve(connection)
                else:
                    await handler(connection)

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
        here = "127.0.0.1" if host == "0.0.0.0" else host
        with socket.create_connection((here, port), _CHECK_S) as line:
            line.sendall(b"GET / HTTP/1.1\r\nHost: elsewhere.example\r\nOrigin: http://x\r\n\r\n")
            return line.recv(64).startswith(b"HTTP/1.1 403")


def _ask_for_plain(request: Request) -> None:
    """Take out of a request that what is sent may be compressed."""
    if "Accept-Encoding" in request.headers:
        del request.headers["Accept-Encoding"]


def _add_script(response: Response, script: str) -> None:
    """Put a script into a page, before everything else."""
    head = b"<head>"
    response.body = response.body.replace(head, head + f"<script>{script}</script>".encode(), 1)
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))


def _cookie(request: Request, name: str) -> str:
    try:
        cookies = SimpleCookie("; ".join(request.headers.get_all("Cookie")))
    except CookieError:
        return ""
    return cookies[name].value if name in cookies else ""


def _response(status: http.HTTPStatus, text: str) -> Response:
    body = text.encode()
    headers = Headers(
        [
            ("Content-Type", "text/html; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Connection", "close"),
        ]
    )
    return Response(status.value, status.phrase, headers, body)
