"""Ports of the servos of a chain: ``[[ports]]`` of a robot's file, ``--port`` of a run."""

import re
from collections.abc import Iterable, Sequence

from snakewalk.config.errors import InputError
from snakewalk.config.robot import LAST_ID

_SEGMENT = re.compile(r"\s*(?P<ids>\d[\d\s,-]*)=(?P<port>[^,]+)(?:,|$)")
_EXAMPLE = "write 1-8=/dev/ttyUSB0,9-16=/dev/ttyUSB1"


def is_port_map(text: str) -> bool:
    """Whether ``--port`` names a port per segment, ``1-8=PORT,9-16=PORT``."""
    return _SEGMENT.match(text) is not None


def parse_port_map(text: str) -> list[tuple[str, tuple[int, ...]]]:
    """Read ``IDS=PORT,IDS=PORT``, IDs as ``1-8`` or ``1,2,5-8``; return ports and their IDs.

    Raises:
        InputError: unreadable text, an ID outside 0 to 252, or a reversed range.

    """
    segments = []
    end = 0
    while end < len(text):
        segment = _SEGMENT.match(text, end)
        if segment is None:
            raise InputError(f"--port {text}: {text[end:]!r} names no IDs and port; {_EXAMPLE}")
        pieces = segment["ids"].rstrip(", ").split(",")
        ids = [
            servo_id for piece in pieces for servo_id in id_range(piece, f"--port {text}", _EXAMPLE)
        ]
        segments.append((segment["port"].strip(), tuple(ids)))
        end = segment.end()
    return segments


def ports_in(text: str) -> list[str]:
    """Return the ports that ``--port`` names.

    Raises:
        InputError: as ``parse_port_map``.

    """
    return [port for port, _ in parse_port_map(text)] if is_port_map(text) else [text]


def port_map_text(ports: Iterable[tuple[str, Sequence[int]]]) -> str:
    """Inverse of ``parse_port_map``."""
    return ",".join(f"{_ids_text(ids)}={port}" for port, ids in ports)


def id_range(piece: str, source: str, example: str) -> range:
    """Read ``7`` or ``1-8``; faults begin with ``source`` and end with ``example``.

    Raises:
        InputError: no numbers, an ID outside 0 to 252, or a reversed range.

    """
    first, dash, last = piece.partition("-")
    try:
        low = int(first)
        high = int(last) if dash else low
    except ValueError:
        raise InputError(f"{source}: {piece!r} is no ID; {example}") from None
    if high < low:
        raise InputError(f"{source}: {piece} runs backwards")
    wrong = [value for value in (low, high) if not 0 <= value <= LAST_ID]
    if wrong:
        raise InputError(f"{source}: ID {wrong[0]}: a servo has 0 to {LAST_ID}")
    return range(low, high + 1)


def _ids_text(ids: Sequence[int]) -> str:
    runs: list[list[int]] = []
    for servo_id in ids:
        if runs and servo_id == runs[-1][-1] + 1:
            runs[-1].append(servo_id)
        else:
            runs.append([servo_id])
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
