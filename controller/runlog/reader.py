"""Reads a log back, up to the break if a kill or a bad disk cut it."""

import json
import struct
from collections import defaultdict
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from pydantic import ValidationError
from zstandard import ZstdError

from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.schema import FORMAT
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.runlog.writer import part_path

_MAGIC: Final = bytes([137, 77, 67, 65, 80, 48, 13, 10])
_HEAD: Final = struct.Struct("<BQ")  # opcode and length before every record
_FOOTER: Final = 2
_BROKEN = (McapError, ZstdError, ValueError, struct.error)
Rows = dict[str, list[dict[str, Any]]]


class LogError(InputError):
    """A log is missing, is none, or breaks off before it says what ran."""


def read_log(path: Path) -> RunRecord:
    """Read a log (``.mcap``, or the ``.mcap.part`` of a killed run).

    Raises:
        LogError: there is no such file, it is no log of ours, or not even its start is left.

    """
    if path.is_dir():
        raise LogError(f"{path}: is a folder; a run's log is {path / 'log.mcap'}")
    try:
        data = path.read_bytes()
    except OSError as error:
        part = part_path(path)
        hint = f"; a run that was killed left {part}" if part.is_file() else ""
        raise LogError(f"{path}: {error.strerror or error}{hint}") from None
    if not data.startswith(_MAGIC[: len(data)]) or not data:
        raise LogError(f"{path}: is not an MCAP log")
    rows, last_s, complete = _rows(data)
    if not rows["/config"]:
        raise LogError(f"{path}: breaks off before it says what ran: nothing can be recovered")
    config = rows["/config"][0]
    if config.get("format") != FORMAT:
        raise LogError(f"{path}: has format {config.get('format')}, this version reads {FORMAT}")
    note = "" if complete else f"the log is cut or damaged; its last row is of {last_s:.2f} s"
    try:
        return record_of(rows, complete=complete, note=note)
    except (KeyError, ValidationError) as error:
        raise LogError(f"{path}: is not a log of this version: {error}") from None


def _rows(data: bytes) -> tuple[Rows, float, bool]:
    """Rows by topic, time of the last one, and whether the file is whole."""
    end, complete = _whole_records(data)
    rows: Rows = defaultdict(list)
    topics: dict[int, str] = {}
    last_ns = 0
    try:
        for record in StreamReader(BytesIO(data[:end]), validate_crcs=True).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                rows[topics[record.channel_id]].append(json.loads(record.data))
                last_ns = max(last_ns, record.log_time)
    except _BROKEN:
        complete = False  # the end of a cut file comes as an error too; damage fails a CRC
    return rows, last_ns * 1e-9, complete


def _whole_records(data: bytes) -> tuple[int, bool]:
    """Bytes up to the end of the last record that is all there, and whether that is the footer."""
    at, opcode = len(_MAGIC), 0
    while at + _HEAD.size <= len(data) and opcode != _FOOTER:
        opcode, length = _HEAD.unpack_from(data, at)
        if at + _HEAD.size + length > len(data):
            return at, False
        at += _HEAD.size + length
    complete = opcode == _FOOTER and data[at:] == _MAGIC
    return at + (len(_MAGIC) if complete else 0), complete
