"""Recorded exchanges: JSON lines of ``bus serve --record``, hex text, or raw bytes."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from snakewalk.config.archive import parse_json, read_bytes
from snakewalk.config.errors import InputError

_MOST_BYTES = 200_000_000
"""Limit of a recording (ours)."""


class TraceWriter:
    """A ``PacketTap`` that writes one JSON line per packet: ``t`` in s, ``from``, ``hex``."""

    def __init__(self, out: TextIO) -> None:
        self._out = out

    def __call__(self, time_s: float, from_host: bool, data: bytes) -> None:
        """Write one packet."""
        side = "host" if from_host else "servo"
        self._out.write(
            json.dumps({"t": round(time_s, 9), "from": side, "hex": data.hex(" ")}) + "\n"
        )


def read_exchange(path: Path) -> Iterator[tuple[float, bool, bytes]]:
    """(time in s, whether the host sent it, bytes) of a ``TraceWriter``'s file.

    Raises:
        InputError: the file is missing, or has a wrong line.

    """
    try:
        text = read_bytes(path, _MOST_BYTES).decode("ascii")
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(
            f"{path}: is not an exchange of bus serve --record; choose another file"
        ) from None
    for number, line in enumerate(text.splitlines(), 1):
        try:
            entry = parse_json(line)
            time_s = float(entry["t"])
            side = entry["from"]
            data = bytes.fromhex(entry["hex"])
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path}: line {number}: no packet as bus serve --record writes it"
            ) from None
        if side not in {"host", "servo"}:
            raise InputError(f"{path}: line {number}: from is {side!r}; host or servo")
        yield time_s, side == "host", data


def read_trace(path: Path) -> Iterator[tuple[float, bytes]]:
    """(time in s, bytes) of a recording; hex text and raw bytes have time 0.

    Raises:
        InputError: the file is missing, or has a wrong line.

    """
    try:
        data = read_bytes(path, _MOST_BYTES)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError:
        yield 0.0, data
        return
    for number, line in enumerate(text.splitlines(), 1):
        shown = line.split("#")[0].strip()
        if not shown:
            continue
        try:
            if shown.startswith("{"):
                entry = parse_json(shown)
                yield float(entry["t"]), bytes.fromhex(entry["hex"])
            else:
                yield 0.0, bytes.fromhex(shown)
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path}: line {number}: neither hex bytes nor a recorded packet"
            ) from None
