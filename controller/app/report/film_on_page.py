"""The film on the page: inside it if small, beside it if not."""

import base64
import os
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import quote

from snakewalk.config.errors import InputError

INLINE_BYTES: Final = 8_000_000
_TYPES: Final = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


def film_html(film: Path, out_dir: Path) -> str:
    """HTML for a film; one above ``INLINE_BYTES`` is linked relative to ``out_dir``.

    Raises:
        InputError: there is no such file, or browsers do not play its type.

    """
    kind = _TYPES.get(film.suffix.lower())
    if kind is None:
        raise InputError(f"{film}: a film on the page is one of {', '.join(_TYPES)}")
    if not film.is_file():
        raise InputError(f"{film}: no such film")
    if film.stat().st_size <= INLINE_BYTES:
        source = f"data:{kind};base64," + base64.b64encode(film.read_bytes()).decode()
    else:
        source = quote(os.path.relpath(film.resolve(), out_dir.resolve()).replace(os.sep, "/"))
    if kind.startswith("image"):
        shown = f"<img src='{escape(source)}' alt='Film of the run'>"
    else:
        shown = f"<video controls autoplay muted loop playsinline src='{escape(source)}'></video>"
    return f"<section><h2>Film</h2><figure>{shown}</figure></section>"
