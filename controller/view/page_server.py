"""viser behind a gate, with the look of every page."""

import logging
import socket
from contextlib import redirect_stdout, suppress
from io import StringIO

import viser

from snakewalk.config.errors import InputError
from snakewalk.controller.view.fresh_line import Freshness
from snakewalk.controller.view.gate import Gate, Insert

_LEFT_PX, _TOP_PX, _WIDTH_PX = 16.0, 170.0, 300.0
"""Place of a window over the scene: below the browser's own notices."""


def open_page(
    host: str, port: int, *inserts: Insert, freshness: Freshness | None = None
) -> tuple[viser.ViserServer, str]:
    """Serve an empty page; returns it with its address, which contains the token.

    ``inserts`` are elements of our own in it; ``freshness`` learns the age of its messages.

    Raises:
        OSError: nothing can be served there, or not behind the gate.

    """
    if not _is_local_host(host):  # viser would wait for ever
        raise OSError(
            f"{host} is not an address of this machine; use 127.0.0.1 (this machine only) or "
            "0.0.0.0 (all of its addresses)"
        )
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # each refusal is a trace
    gate = Gate(host, *inserts, freshness=freshness)
    with redirect_stdout(StringIO()):  # viser prints its address without the token
        server: viser.ViserServer = gate.install(
            lambda: viser.ViserServer(host=host, port=port, label="snakewalk", verbose=False)
        )
    if not gate.is_shut(host, server.get_port()):
        server.stop()
        raise OSError("this version of viser cannot be kept behind a token; see docs/view.md")
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.gui.set_panel_label("snakewalk")
    return server, f"http://{_in_url(host)}:{server.get_port()}/?token={gate.token}"


def served_page(host: str, port: int) -> tuple[viser.ViserServer, str]:
    """Serve an empty page as ``open_page`` does.

    Raises:
        InputError: nothing can be served there.

    """
    try:
        return open_page(host, port)
    except OSError as fault:
        raise InputError(f"--view-at {host}:{port}: {fault.strerror or fault}") from None


def served_model(host: str, port: int) -> tuple[viser.ViserServer, str]:
    """Serve a page with z up and without shadows, which a browser draws in less time."""
    server, url = served_page(host, port)
    server.scene.set_up_direction("+z")
    server.scene.configure_default_lights(cast_shadow=False)
    server.scene.configure_environment_map(None)
    return server, url


def _in_url(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _is_local_host(host: str) -> bool:
    """Whether this machine can serve at one of a host's addresses."""
    try:
        places = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):  # no such host; a name with an empty or too long part
        return False
    for family, kind, number, _, place in places:
        with suppress(OSError), socket.socket(family, kind, number) as line:
            line.bind(place)
            return True
    return False


def float_above(panel: viser.PanelHandle) -> None:
    """Let a panel float over the scene, where no other panel moves it out of sight."""
    panel.float(x=_LEFT_PX, y=_TOP_PX, width=_WIDTH_PX)
