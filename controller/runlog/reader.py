"""Reads a log back, up to the break if a kill cut it, and without the parts that are damaged."""

import json
import os
import re
import struct
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Header, McapRecord, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from pydantic import ValidationError
from zstandard import ZstdError, decompress, frame_content_size

from snakewalk.config.archive import MOST_LOG_BYTES, check_expansion
from snakewalk.config.errors import InputError
from snakewalk.controller.runlog.column import ROWS, storage_folder
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.tables import RowPacker, record_of
from snakewalk.controller.runlog.topics import FORMAT, ConfigTable, CycleTable
from snakewalk.controller.runlog.writer import REPEATED, part_path

_MAGIC = bytes([137, 77, 67, 65, 80, 48, 13, 10])
_HEAD = struct.Struct("<BQ")  # opcode and length before every record
_FOOTER = 2
_CHUNK = 6
_CHUNK_HEAD = struct.Struct("<16xQ4xI")  # two times, bytes unpacked, CRC, length of a name
_CHUNK_LENGTH = 8  # after the packing's name, before the packed bytes
_ZSTD_HEAD = 18  # at most
_NAME_BYTES = 1000
"""Bytes of a chunk that hold its head and the name of its packing (ours)."""
_COMPRESSIONS = ("zstd", "")
_MOST_NAMED_TOPICS = 8
"""Topics that a message names at most (ours)."""
_BROKEN = (McapError, ZstdError, ValueError, KeyError, RecursionError, struct.error)
_REPEATED = [table.topic.name for table in REPEATED]
Rows = dict[str, list[dict[str, Any]]]


class LogError(InputError):
    """A log is missing, is another kind of file, or breaks off before its header ends."""


def read_log(
    path: Path,
    *,
    is_snakewalk_log: bool = False,
    on_progress: Callable[[float, float], None] = lambda done, total: None,
) -> RunRecord:
    """Read a log (``.mcap``, or the ``.mcap.part`` of a killed run).

    Args:
        path: the log, or a part of it; a log's further parts in its folder are read after it.
        is_snakewalk_log: whether this process wrote it, so that no limit of expansion applies.
        on_progress: called with (bytes read, of) of all parts while they are read.

    Raises:
        LogError: the file does not exist, is not a log of ours, or its start is missing.
        InputError: it would expand too far (``archive.check_expansion``).

    """
    if path.is_dir():
        raise LogError(f"{path}: is a folder; a run's log is {path / 'log.mcap'}")
    try:
        with path.open("rb") as file:
            start = file.read(len(_MAGIC))
            if not start or not _MAGIC.startswith(start):  # a device without an end is not a log
                raise LogError(f"{path}: is not an MCAP log; a run writes log.mcap")
            stream = file if file.seekable() else BytesIO(start + file.read())
            return _record(path, stream, is_snakewalk_log, on_progress)
    except OSError as error:
        part = part_path(path)
        hint = f"; a run that was killed left {part}" if part.is_file() else ""
        raise LogError(f"{path}: {error.strerror or error}{hint}") from None


def _record(
    path: Path,
    file: BinaryIO,
    is_snakewalk_log: bool,
    on_progress: Callable[[float, float], None],
) -> RunRecord:
    """Return the record of an open log; only a chunk of it is in memory at once."""
    packer = RowPacker(storage_folder(path))
    rows: Rows = defaultdict(list)
    parts = _next_parts(path)
    files = (path, *parts.values())
    ends = [*accumulate(part.stat().st_size for part in files)]
    starts = dict(zip(files, (0, *ends), strict=False))
    read = partial(
        _add_rows,
        packer,
        rows,
        is_snakewalk_log,
        lambda part, position: on_progress(starts[part] + position, ends[-1]),
    )
    last_s, complete, lost, fault = read(path, file)
    for part in parts.values():
        if fault:
            break
        with part.open("rb") as opened:
            last_s, is_whole, lost_here, fault = read(part, opened)
        complete = complete and is_whole
        lost += lost_here
    missing = [number for number in range(2, max(parts, default=1)) if number not in parts]
    configs = rows[ConfigTable.topic.name]
    if not configs:
        if _whole_records(file)[1] and _crcs_agree(file) and not lost:
            raise LogError(f"{path}: {_foreign(file)}")
        raise LogError(f"{path}: ends before its header; nothing can be recovered")
    if configs[0].get("format") != FORMAT:
        raise LogError(
            f"{path}: has format {configs[0].get('format')}, this version reads {FORMAT}"
        )
    note = "" if complete else f"the log is cut or damaged; its last row is of {last_s:.2f} s"
    if lost:
        note += f"; {lost} damaged parts are left out"
    if missing:
        note += f"; its parts {', '.join(map(str, missing))} are missing"
    if fault:
        note = f"only its first {last_s:.0f} s were read: {fault}; free space in {packer.folder}"
    try:
        return record_of(rows, complete=complete, note=note, parts=packer.parts)
    except (LookupError, TypeError, ValueError, AttributeError, ValidationError) as error:
        raise LogError(f"{path}: is not a log of this version: {error}") from None


def _next_parts(log: Path) -> dict[int, Path]:
    """Return the further parts of a log by their numbers; a killed run left the last one open."""
    name = re.compile(rf"{re.escape(log.stem)}\.part(\d+){re.escape(log.suffix)}(\.part)?")
    named = ((name.fullmatch(file.name), file) for file in log.parent.iterdir())
    return dict(sorted((int(match[1]), file) for match, file in named if match))


def _foreign(file: BinaryIO) -> str:
    """Return the sentence about a complete MCAP that another program wrote."""
    profile = ""
    topics = set[str]()
    for record in _records(file, []):
        if isinstance(record, Header):
            profile = record.profile
        elif isinstance(record, Channel):
            topics.add(record.topic)
    if ConfigTable.topic.name in topics:
        return "its /config is no JSON object, or is nested too deeply; read a copy of the log"
    listed = ", ".join(sorted(topics)[:_MOST_NAMED_TOPICS]) + (
        ", ..." if len(topics) > _MOST_NAMED_TOPICS else ""
    )
    with_topics = f"with topics {listed}" if topics else "without topics"
    return (
        f"is a complete MCAP of profile {profile!r} {with_topics}, but no log of snakewalk; "
        "`snakewalk play` accepts one with joint states"
    )


def _add_rows(
    packer: RowPacker,
    rows: Rows,
    is_snakewalk_log: bool,
    on_position: Callable[[Path, int], None],
    path: Path,
    file: BinaryIO,
) -> tuple[float, bool, int, str]:
    """Add the rows of a part of a log to those of the parts before, by topic.

    Returns: time of the last row, whether the file is whole, damaged chunks, fault of the disk.
    """
    has_begun = not rows
    complete, unpacked, packed = _whole_records(file)
    if not is_snakewalk_log:
        check_expansion(path, packed, unpacked, most_bytes=MOST_LOG_BYTES)
    complete = complete and _crcs_agree(file)
    lost = list[str]()
    topics = _topics(path, file)
    last_ns = 0
    fault = ""
    try:
        for number, record in enumerate(_records(file, lost)):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                row = json.loads(record.data)
                if not isinstance(row, dict):
                    raise ValueError("a row is a JSON object")
                topic = topics[record.channel_id]
                has_begun |= topic == CycleTable.topic.name
                if has_begun or not _is_repeated(path, topic, row, rows):
                    rows[topic].append(row)
                    packer.pack(topic, rows)
                    last_ns = max(last_ns, record.log_time)
            if number % ROWS == 0:
                on_position(path, file.tell())
    except _BROKEN:
        complete = False  # the end of a cut file comes as an error too; damage fails a CRC
    except OSError as error:  # a run that has ended well does not fail because of its log
        complete = False
        fault = error.strerror or str(error)
    return last_ns * 1e-9, complete and not lost, len(lost), fault


def _is_repeated(path: Path, topic: str, row: dict[str, Any], rows: Rows) -> bool:
    """Whether a row at the begin of a part repeats one of an earlier part.

    Raises:
        LogError: it is another configuration.

    """
    if topic in _REPEATED and row in rows[topic]:
        return True
    if topic == ConfigTable.topic.name:
        raise LogError(f"{path}: is of another run; move it to another folder")
    return False


def _from_start(file: BinaryIO, *, validate_crcs: bool = False) -> Iterator[McapRecord]:
    size = file.seek(0, os.SEEK_END)  # no damaged length reserves more memory
    file.seek(0)
    yield from StreamReader(
        file, emit_chunks=True, validate_crcs=validate_crcs, record_size_limit=size
    ).records


def _crcs_agree(file: BinaryIO) -> bool:
    """Whether a complete file has its stated checksums, except those of its chunks."""
    try:
        for _ in _from_start(file, validate_crcs=True):
            pass
    except _BROKEN:
        return False
    return True


def _topics(path: Path, file: BinaryIO) -> dict[int, str]:
    """Topics by number, of the summary: a damaged chunk may have been the first to name one.

    Raises:
        LogError: chunks are packed in a way that logs are not.

    """
    topics = dict[int, str]()
    chunks = 0
    try:
        for record in _from_start(file):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            if isinstance(record, Chunk):
                chunks += 1
                if chunks == 1 and record.compression not in _COMPRESSIONS:
                    raise LogError(
                        f"{path}: is packed with {record.compression!r}; a log is with zstd"
                    )
    except _BROKEN:
        pass
    return topics


def _records(file: BinaryIO, lost: list[str]) -> Iterator[McapRecord]:
    """Records of a log, also those in chunks; no chunk is unpacked to more than it says.

    The faults of damaged chunks go into ``lost``; a chunk's records come all or not at all.
    """
    for record in _from_start(file):
        if not isinstance(record, Chunk):
            yield record
            continue
        try:
            if record.compression not in _COMPRESSIONS:  # no CRC covers a chunk's head
                raise ValueError(f"packed with {record.compression!r}")
            inner = list(breakup_chunk(_unpacked_chunk(record), validate_crc=True))
        except _BROKEN as error:
            lost.append(str(error))
            continue
        yield from inner


def _unpacked_chunk(chunk: Chunk) -> Chunk:
    """Unpack a chunk to its stated number of bytes, which its frame must not contradict."""
    if not chunk.compression:
        return chunk
    if frame_content_size(chunk.data) not in (-1, chunk.uncompressed_size):
        raise ValueError("a chunk and its frame differ in size")
    data = decompress(chunk.data, max_output_size=chunk.uncompressed_size)
    return replace(chunk, compression="", data=data)


def _stated_bytes(chunk: bytes) -> int:
    said, name_length = _CHUNK_HEAD.unpack_from(chunk)
    frame = _CHUNK_HEAD.size + name_length + _CHUNK_LENGTH
    try:
        framed = frame_content_size(chunk[frame : frame + _ZSTD_HEAD])
    except ZstdError:
        framed = -1
    return int(said if framed < 0 else min(said, framed))


def _whole_records(file: BinaryIO) -> tuple[bool, int, int]:
    """Whether the footer ends the file, the stated unpacked bytes of its records, and its size."""
    size = file.seek(0, os.SEEK_END)
    position = len(_MAGIC)
    opcode = 0
    unpacked = 0
    while position + _HEAD.size <= size and opcode != _FOOTER:
        file.seek(position)
        opcode, length = _HEAD.unpack(file.read(_HEAD.size))
        if position + _HEAD.size + length > size:
            return False, unpacked, size
        chunk = opcode == _CHUNK and length >= _CHUNK_HEAD.size
        unpacked += _stated_bytes(file.read(min(length, _NAME_BYTES))) if chunk else length
        position += _HEAD.size + length
    file.seek(position)
    return opcode == _FOOTER and file.read(len(_MAGIC) + 1) == _MAGIC, unpacked, size
