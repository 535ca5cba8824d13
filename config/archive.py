"""Foreign files: limits of their size and expansion.

A few kilobytes of packed zeros can fill a robot's memory. The size that a file states is compared
with its own size before unpacking, and no more is unpacked. A device has no end, so text is read up
to a limit. Files of gzip, bzip2 and xz are unpacked, whatever their names are.
"""

import bz2
import gzip
import io
import json
import lzma
import math
import struct
import zipfile
import zlib
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from tokenize import TokenError
from typing import IO, TYPE_CHECKING, Any

from snakewalk.config.errors import InputError
from snakewalk.config.near_names import file_hint

if TYPE_CHECKING:
    from numpy.typing import NDArray

FREE_BYTES = 16_000_000
"""Size to which any file may expand (ours): a mask of zeros is packed a thousandfold."""
MOST_RATIO = 100
MOST_BYTES = 1_000_000_000
"""Largest ratio of unpacked to packed size, and largest unpacked size, above ``FREE_BYTES``
(ours)."""
MOST_TEXT_RATIO = 20
MOST_TEXT_BYTES = 500_000_000
"""Largest size of a JSON text (ours): parsing needs several times its size in memory."""
MOST_LOG_BYTES = 16_000_000_000
"""Largest size of a log, which is read row by row (ours): 30 hours of 16 servos at 50 Hz."""
MOST_JSON_BYTES = 64_000_000
"""Largest size of a JSON file that is read at once (ours)."""
MOST_STORAGE_BYTES = 1_000_000
"""Largest size of a calibration file (ours)."""
_PIECE_BYTES = 1_000_000
_PACKED: dict[bytes, Callable[..., Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\x00": lzma.open,
}
"""First bytes of compressed files, and what unpacks them."""
DAMAGE = (
    ValueError,
    EOFError,
    KeyError,
    NotImplementedError,  # an unknown packing
    RuntimeError,  # a password
    struct.error,
    SyntaxError,
    TokenError,  # a damaged header of .npy
    zipfile.BadZipFile,
    zlib.error,
)
"""Exceptions, besides ``OSError``, that reading a damaged archive raises."""


def why_no_file(path: Path, missing: str = "no such file") -> str:
    """Reason why a path is not a file that can be read repeatedly."""
    if path.is_dir():
        return f"{path}: is a folder"
    if path.exists():
        return f"{path}: is a pipe or a device; copy its contents into a file"
    return f"{path}: {missing}{file_hint(path)}"


def read_bytes(file: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """Bytes of a file up to a size; of a device or a pipe up to ``FREE_BYTES``.

    Raises:
        InputError: it is larger.
        OSError: it cannot be read.

    """
    size = file.stat().st_size  # 0 for a device or a pipe
    most_bytes = min(most_bytes, max(FREE_BYTES, MOST_RATIO * size))
    data = read_head(file, most_bytes + 1)
    if len(data) > most_bytes:
        raise InputError(f"{file}: is larger than the {most_bytes / 1e6:g} MB that are read of it")
    return data


def read_head(file: Path, count: int) -> bytes:
    """First bytes of a file, at most ``count``; of its contents if it is compressed.

    Raises:
        InputError: it is compressed, and damaged.
        OSError: it cannot be read.

    """
    with file.open("rb") as stream:
        start = stream.peek(1)
        unpack = next((opener for mark, opener in _PACKED.items() if start.startswith(mark)), None)
        if unpack is None:
            return _first_bytes(stream, count)
        try:
            with unpack(stream) as unpacked:
                return _first_bytes(unpacked, count)
        except (*DAMAGE, lzma.LZMAError, OSError):
            raise InputError(f"{file}: is compressed, and damaged; copy it again") from None


def _first_bytes(stream: IO[bytes], count: int) -> bytes:
    """Bytes in pieces: one read would reserve all of ``count``."""
    data = io.BytesIO()
    while piece := stream.read(min(_PIECE_BYTES, count - data.tell())):
        data.write(piece)
    return data.getvalue()


def ending(file: Path) -> str:
    """Ending of a file's name in lower case, without that of its compression."""
    name = file.with_suffix("") if file.suffix.lower() in (".gz", ".bz2", ".xz") else file
    return name.suffix.lower()


def read_text(file: Path, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Text of a UTF-8 file, up to a size, without byte order mark.

    Raises:
        InputError: it is larger.
        OSError: it cannot be read.
        UnicodeDecodeError: it is not UTF-8.

    """
    return read_bytes(file, most_bytes).decode("utf-8-sig")


def parse_json(text: str | bytes) -> Any:
    """Value of a JSON text.

    Raises:
        ValueError: it is not JSON, or is nested too deeply.

    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def read_json_object(path: Path, what: str = "a JSON object") -> dict[str, Any]:
    """Read a file whose JSON is an object; ``what`` names it in a message.

    Raises:
        InputError: the file cannot be read, or holds something else.

    """
    try:
        data = parse_json(read_bytes(path, MOST_JSON_BYTES))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"{path}: is not JSON; expected {what}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: expected {what}")
    return data


def check_expansion(
    file: Path,
    packed: int,
    unpacked: int,
    *,
    text: bool = False,
    most_bytes: int | None = None,
) -> None:
    """Check the unpacked size of a file before unpacking.

    Args:
        file: for the fault.
        packed: bytes of the file.
        unpacked: stated bytes of its content.
        text: whether the content is JSON.
        most_bytes: another limit of ``unpacked`` than the usual one.

    Raises:
        InputError: more than ``FREE_BYTES``, and more than the permitted ratio or size.

    """
    ratio, most = (MOST_TEXT_RATIO, MOST_TEXT_BYTES) if text else (MOST_RATIO, MOST_BYTES)
    most = most if most_bytes is None else most_bytes
    if unpacked > max(FREE_BYTES, min(ratio * packed, most)):
        raise InputError(
            f"{file}: its {packed / 1e6:.3g} MB would expand to {unpacked / 1e6:,.0f} MB; at most "
            f"{ratio} times the size of the file is unpacked, and at most {most / 1e6:.0f} MB "
            f"({FREE_BYTES / 1e6:.0f} MB of any file)"
        )


def check_members(file: Path, members: Sequence[zipfile.ZipInfo], *, text: bool = False) -> None:
    """Check the stated sizes of zip members.

    Raises:
        InputError: too much (``check_expansion``).
        ValueError: another packing than deflate, which is not bounded.

    """
    if any(m.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for m in members):
        raise ValueError("uses a compression other than deflate")
    check_expansion(file, file.stat().st_size, sum(m.file_size for m in members), text=text)


def read_arrays(
    file: Path, names: Collection[str] | None = None
) -> tuple[dict[str, Any], list[str]]:
    """Read arrays of numbers and text from an .npz, and list the names of other arrays.

    ``names`` are those to read, if present; None reads all.

    Raises:
        InputError: it would expand too far.
        OSError: it cannot be opened.
        ValueError: it is not an .npz of plain arrays, or is damaged.

    """
    if file.exists() and not file.is_file():  # the end of a device is searched for ever
        raise InputError(why_no_file(file))
    try:
        with zipfile.ZipFile(file) as archive:
            members = {
                member.filename.removesuffix(".npy"): member
                for member in archive.infolist()
                if member.filename.endswith(".npy")
            }
            requested_members = {n: m for n, m in members.items() if names is None or n in names}
            check_members(file, list(requested_members.values()))
            arrays = {name: _array(archive, member) for name, member in requested_members.items()}
    except (*DAMAGE, OSError) as error:
        if getattr(error, "filename", None):  # not a place before the file's begin
            raise
        raise ValueError(str(error) or type(error).__name__) from None
    return arrays, [name for name in members if name not in arrays]


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> "NDArray[Any]":
    import numpy as np  # noqa: PLC0415  a TOML file needs none

    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        if version not in ((1, 0), (2, 0)):
            raise ValueError(f"{member.filename}: is of version {version} of .npy")
        read_header = (
            np.lib.format.read_array_header_1_0
            if version == (1, 0)
            else np.lib.format.read_array_header_2_0
        )
        shape, _, dtype = read_header(stream)
    if dtype.hasobject:
        raise ValueError(f"{member.filename}: holds Python objects")
    if math.prod(shape) * max(dtype.itemsize, 1) > member.file_size:
        raise ValueError(f"{member.filename}: states {shape}, and contains less")
    with archive.open(member) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)
