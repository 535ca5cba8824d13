"""Markers of a C3D, by ezc3d, which may end its process on a damaged file."""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_head
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError


def child(file: str) -> tuple[dict[str, Floats], dict[str, Any]]:
    """Places (T, K, 3) of the markers, and the file's statements; the separate process's work."""
    import ezc3d  # noqa: PLC0415  an extra

    c3d = ezc3d.c3d(file)
    about = c3d["parameters"]["POINT"]

    def text(name: str) -> str:
        return str((about.get(name, {}).get("value") or [""])[0])

    places = np.asarray(c3d["data"]["points"], dtype=float)[:3].transpose(2, 1, 0)
    first_frame = c3d["header"]["points"]["first_frame"] + 1
    head = read_head(Path(file), 10)
    order = "<" if struct.unpack_from("<H", head, 6)[0] == first_frame else ">"
    first, last = struct.unpack_from(f"{order}HH", head, 6)
    if len(places) < last - first + 1:  # ezc3d does not report it
        raise InputError(
            f"states {last - first + 1} frames, and contains {len(places)}; copy or export it again"
        )
    return {"places": places}, {
        "names": [str(name) for name in about["LABELS"]["value"]],
        "unit": text("UNITS"),
        "rate_hz": float(about["RATE"]["value"][0]),
        "up": text("Y_SCREEN").strip().lower(),
    }
