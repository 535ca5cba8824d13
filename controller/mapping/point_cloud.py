"""Point clouds: PCD of the Point Cloud Library in all three encodings, PLY, and tables of x, y, z.

PCD is decoded here: trimesh cannot, and other readers include a viewer. Format: pointclouds.org,
"The PCD (Point Cloud Data) file format"; ``binary_compressed`` is LZF.
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_BYTES, check_expansion, read_bytes, read_head
from snakewalk.config.arrays import Bytes, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.drivers.compiling import compiled, readonly_array

_KINDS = {
    **{("F", size): f"<f{size}" for size in (4, 8)},
    **{("I", size): f"<i{size}" for size in (1, 2, 4, 8)},
    **{("U", size): f"<u{size}" for size in (1, 2, 4, 8)},
}
_HEADER_BYTES = 4096
"""A header is searched for its last line so far (ours)."""


@dataclass(frozen=True, slots=True)
class PcdCloud:
    """Points of a PCD file."""

    points: Floats
    """(n, 3) finite points in the file's unit."""
    image: tuple[int, int] | None
    """Width and height of a picture of points, as of a depth camera; None of other clouds."""
    notes: tuple[str, ...]
    """Parts that were left out."""


def read_pcd(file: Path) -> PcdCloud:
    """Read a PCD file; ignores the sensor's pose (VIEWPOINT).

    Raises:
        InputError: the file is not a point cloud, is damaged, or would expand too far.
        OSError: the file cannot be opened.

    """
    data = read_bytes(file)
    try:
        points = _pcd(file, data)
        header, _ = _header(data)
        width, height = int(header["WIDTH"][0]), int(header.get("HEIGHT", ["1"])[0])
        pose = [float(word) for word in header.get("VIEWPOINT", [])]
    except (ValueError, KeyError, IndexError, struct.error, OverflowError) as error:
        raise InputError(
            f"{file}: is not a complete PCD file: {error}; choose another file"
        ) from None
    finite = np.isfinite(points).all(axis=1)
    notes = []
    if not finite.all():
        notes.append(f"{int((~finite).sum())} points without numbers are left out")
    if pose not in ([], [0, 0, 0, 1, 0, 0, 0]):
        notes.append(f"VIEWPOINT {' '.join(f'{number:g}' for number in pose)} is not used")
    return PcdCloud(points[finite], (width, height) if height > 1 else None, tuple(notes))


def _pcd(file: Path, data: bytes) -> Floats:
    header, start = _header(data)
    names = header["FIELDS"]
    sizes = [int(size) for size in header["SIZE"]]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    kinds = [_KINDS[key] for key in zip(header["TYPE"], sizes, strict=True)]
    if not {"x", "y", "z"} <= set(names):
        raise ValueError(f"its fields are {' '.join(names)}; x, y and z are needed")
    if len(set(names)) < len(names):  # padding may repeat a name
        names = [n if n in "xyz" else f"{n}{k}" for k, n in enumerate(names)]
    if min(counts) < 1 or len(counts) != len(names):
        raise ValueError("COUNT must be 1 or more of each field")
    total = (
        int(header["POINTS"][0])
        if "POINTS" in header
        else (int(header["WIDTH"][0]) * int(header["HEIGHT"][0]))
    )
    row = np.dtype([(n, k, (c,)) for n, k, c in zip(names, kinds, counts, strict=True)])
    if total < 0:
        raise ValueError(f"states {total} points")
    encoding = header["DATA"][0]
    body = data[start:]
    if encoding == "ascii":
        return _ascii(body, names, counts, total)
    check_expansion(file, len(data), total * row.itemsize)
    if encoding == "binary":
        if len(body) < total * row.itemsize:
            raise ValueError(f"states {total} points, and contains {len(body) // row.itemsize}")
        points = np.frombuffer(body, row, total)
        return np.stack([points[axis][:, 0].astype(float) for axis in "xyz"], axis=-1)
    if encoding != "binary_compressed":
        raise ValueError(f"DATA {encoding} is not one of ascii, binary, binary_compressed")
    return _decompressed_points(body, row, total)


def _decompressed_points(body: bytes, row: np.dtype[Any], total: int) -> Floats:
    """Points (N, 3) of compressed data, which hold one field after another."""
    packed, unpacked = struct.unpack("<II", body[:8])
    if unpacked != total * row.itemsize or packed > len(body) - 8:
        raise ValueError("the sizes of its compressed data do not fit its points")
    plain = np.zeros(unpacked, np.uint8)
    if _expand(np.frombuffer(body[8 : 8 + packed], np.uint8), plain) != unpacked:
        raise ValueError("its compressed data are damaged")
    columns = {}
    offset = 0
    for name in row.names or ():
        field = row[name]
        width = field.itemsize * total
        if name in "xyz":
            count = field.shape[0]
            columns[name] = plain[offset : offset + width].view(field.base)[::count].astype(float)
        offset += width
    return np.stack([columns[axis] for axis in "xyz"], axis=-1)


def _header(data: bytes) -> tuple[dict[str, list[str]], int]:
    mark = data[:_HEADER_BYTES].find(b"\nDATA ")
    end = data.find(b"\n", mark + 1) + 1
    if mark < 0 or end == 0:
        raise ValueError("it has no header with a line DATA")
    lines = data[:end].decode("ascii").splitlines()
    words = [line.split() for line in lines if line.strip() and not line.startswith("#")]
    return {key: rest for key, *rest in words}, end


def _ascii(body: bytes, names: list[str], counts: list[int], total: int) -> Floats:
    first = dict(zip(names, np.cumsum([0, *counts[:-1]]).tolist(), strict=True))
    rows = [line.split() for line in body.splitlines()[:total]]
    if len(rows) < total:
        raise ValueError(f"states {total} points, and contains {len(rows)}")
    rows_m = [[float(row[first[axis]]) for axis in "xyz"] for row in rows]
    return np.array(rows_m, dtype=float).reshape(-1, 3)


@compiled(f"int64({readonly_array('uint8', layout='C')}, uint8[::1])")
def _expand(packed: Bytes, plain: Bytes) -> int:
    """Expand LZF; return the number of bytes written, or -1 for damaged data.

    A control byte below 32 precedes that many and one plain bytes. Any other is a back reference:
    three high bits are the length, five low ones the high bits of the distance.
    """
    position = 0
    out = 0
    while position < len(packed):
        control = int(packed[position])
        position += 1
        if control < 32:
            length = control + 1
            if position + length > len(packed) or out + length > len(plain):
                return -1
            for k in range(length):
                plain[out + k] = packed[position + k]
            position += length
        else:
            length = control >> 5
            if length == 7:
                if position >= len(packed):
                    return -1
                length += int(packed[position])
                position += 1
            if position >= len(packed):
                return -1
            back = out - ((control & 31) << 8) - int(packed[position]) - 1
            position += 1
            length += 2
            if back < 0 or out + length > len(plain):
                return -1
            for k in range(length):  # byte by byte: source and target may overlap
                plain[out + k] = plain[back + k]
        out += length
    return out


def read_ply(file: Path) -> tuple[Floats, Any]:
    """Vertices (n, 3) and faces (k, 3) of a PLY, in its unit; faces are None for a cloud.

    Raises:
        InputError: it cannot be read.
        OSError: the file cannot be opened.

    """
    require_extra("PLY needs", "trimesh")
    import trimesh  # noqa: PLC0415  an extra

    head = read_head(file, _HEADER_BYTES)
    said = [line.split() for line in head.split(b"end_header")[0].splitlines()]
    try:
        counts = [int(words[2]) for words in said if words[:1] == [b"element"]]
        size = file.stat().st_size
        if any(not 0 <= count <= size for count in counts):  # each needs a byte or more
            raise ValueError("says more elements than it can hold")
        check_expansion(file, size, min(MOST_BYTES, 100 * sum(counts)))
        mesh: Any = trimesh.load(file, process=False)
        points = np.asarray(mesh.vertices, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError("holds no vertices")
        faces = getattr(mesh, "faces", None)
        getattr(mesh, "triangles", None)  # fails if a face has a vertex that is not there
    except InputError:
        raise
    except Exception as error:  # trimesh raises the exceptions of its parsers
        raise InputError(f"{file}: cannot be read as a PLY: {error}") from None
    if faces is None or len(faces) == 0:
        return points[np.isfinite(points).all(axis=1)], None
    if not math.isfinite(float(points.sum())):
        raise InputError(f"{file}: its vertices are not all finite")
    return points, np.asarray(faces, dtype=np.int64)
