"""Damage of a file by a seeded generator: cut, flipped, doubled, with huge sizes, NaN, controls."""

import bz2
import gzip
import io
import lzma
import re
import shutil
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

Rng = np.random.Generator
PACKINGS: Final[tuple[tuple[bytes, Any], ...]] = (
    (b"\x1f\x8b", gzip), (b"BZh", bz2), (b"\xfd7zXZ\x00", lzma)
)  # fmt: skip
"""First bytes of packed files, and what unpacks and packs them."""
NUMBER: Final = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NUMBERS: Final = (b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"0", b"-1", b"2147483648",
                  b"9999999999999", b"1" * 400, b"", b"1e-320", b"0x10", b"one")  # fmt: skip
WORDS: Final = (b"\xff" * 4, b"\xff" * 8, b"\xff\xff\xff\x7f", b"\x00" * 4, b"\x00" * 8,
                b"\x00\x00\xc0\x7f", b"\x00\x00\x00\x00\x00\x00\xf8\x7f",
                b"\x00\x00\x00\x00\x00\x00\xf0\x7f", b"\x7f\xff\xff\xff", b"\x00\x00\x00\x40",
                b"\x00\x00\x00\x00\x00\x00\x00\x40")  # fmt: skip
"""Largest and other sizes of 4 and 8 bytes, NaN and infinity."""
CONTROLS: Final = (b"\x00", b"\x1b[2J", b"\r", b"\n\n", b"\x07", b"\xc2\x85", b"\xe2\x80\xae",
                   b"\xff\xfe", b'"', b"<", b"&", b",,", b"\\", b"%s", b"{")  # fmt: skip


def place(data: bytes, rng: Rng) -> int:
    """Place in a file: half of them in its first 400 bytes, where sizes are."""
    return int(rng.integers(max(1, len(data) if rng.random() < 0.5 else min(400, len(data)))))


def truncated(data: bytes, rng: Rng) -> bytes:
    return data[: place(data, rng)]


def flipped(data: bytes, rng: Rng) -> bytes:
    raw = bytearray(data)
    for _ in range(int(rng.integers(1, 9)) if raw else 0):
        raw[place(data, rng)] ^= 1 << int(rng.integers(8))
    return bytes(raw)


def doubled(data: bytes, rng: Rng) -> bytes:
    at = place(data, rng)
    end = at + int(rng.integers(1, 2000))
    return data[:end] + data[at:]


def without(data: bytes, rng: Rng) -> bytes:
    at = place(data, rng)
    return data[:at] + data[at + int(rng.integers(1, 300)) :]


def overwritten(data: bytes, rng: Rng) -> bytes:
    word, at = WORDS[int(rng.integers(len(WORDS)))], place(data, rng) & ~3
    return data[:at] + word + data[at + len(word) :]


def renumbered(data: bytes, rng: Rng) -> bytes:
    """Another number in a text: huge, negative, none, or not finite."""
    at = place(data, rng)
    found = NUMBER.search(data, at) or NUMBER.search(data)
    if found is None:
        return overwritten(data, rng)
    other = NUMBERS[int(rng.integers(len(NUMBERS)))]
    return data[: found.start()] + other + data[found.end() :]


def controlled(data: bytes, rng: Rng) -> bytes:
    at = place(data, rng)
    return data[:at] + CONTROLS[int(rng.integers(len(CONTROLS)))] + data[at:]


DAMAGES: Final[tuple[Callable[[bytes, Rng], bytes], ...]] = (
    truncated, flipped, doubled, without, overwritten, renumbered, controlled
)  # fmt: skip


def damaged(data: bytes, rng: Rng) -> bytes:
    """Bytes with one damage, or up to three; half of the packed files are damaged inside."""
    inside = rng.random() < 0.5
    for mark, packing in PACKINGS:
        if inside and data.startswith(mark):
            return bytes(packing.compress(damaged(packing.decompress(data), rng)))
    if inside and data.startswith(b"PK"):
        return _damaged_member(data, rng)
    for _ in range(1 if rng.random() < 0.6 else int(rng.integers(2, 4))):
        data = DAMAGES[int(rng.integers(len(DAMAGES)))](data, rng)
    return data


def _damaged_member(data: bytes, rng: Rng) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(out, "w") as made:
        names = archive.namelist()
        hit = names[int(rng.integers(len(names)))]
        for name in names:
            member = archive.read(name)
            made.writestr(name, damaged(member, rng) if name == hit else member)
    return out.getvalue()


def damage(source: Path, folder: Path, name: str, seed: int) -> Path:
    """Copy a file, or a folder of which one file is damaged, into a folder; return the copy."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), seed])
    copy = folder / source.name
    if not source.is_dir():
        copy.write_bytes(damaged(source.read_bytes(), rng))
        return copy
    shutil.copytree(source, copy)
    files = sorted(file for file in copy.rglob("*") if file.is_file())
    hit = files[int(rng.integers(len(files)))]
    hit.write_bytes(damaged(hit.read_bytes(), rng))
    return copy
