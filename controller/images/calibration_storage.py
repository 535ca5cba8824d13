"""Camera calibrations: files of OpenCV's FileStorage, or plain lists in JSON."""

from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_STORAGE_BYTES, parse_json, read_bytes
from snakewalk.config.errors import InputError
from snakewalk.controller.console.separate_reader import read_separately
from snakewalk.controller.images import storage_file


def read_storage(file: Path) -> dict[str, Any]:
    """Matrices and numbers by name of a file of OpenCV's FileStorage, or of JSON lists.

    Raises:
        InputError: it cannot be read, or is too large.
        OSError: it cannot be opened.

    """
    lists = _json_lists(file, read_bytes(file, MOST_STORAGE_BYTES))
    if lists is not None:
        return lists
    matrices, others = read_separately(file, storage_file.__name__)
    return matrices | others


def _json_lists(file: Path, data: bytes) -> dict[str, Any] | None:
    """Values of a JSON file of plain lists and numbers, as from ``json.dump``.

    An object with ``data`` is a matrix of OpenCV, also next to plain lists.

    Returns:
        Arrays and numbers by name, other values as they are; None for another ending, or a file
        that only OpenCV reads: one with comments, or with matrices in base64.

    Raises:
        InputError: it is too large, is no JSON object, or has a ragged list.
        OSError: it cannot be read.

    """
    if file.suffix.lower() != ".json":
        return None
    text = data.decode("utf-8-sig", errors="replace")
    try:
        values = parse_json(text)
    except ValueError as error:
        if "//" in text or "/*" in text:
            return None
        raise InputError(f"{file}: cannot be read as JSON: {error}; correct it") from None
    if not isinstance(values, dict):
        raise InputError(f"{file}: lacks names of its matrices; write a JSON object")
    lists: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict) and isinstance(value.get("data"), str):
            return None
        if isinstance(value, str | bool) or value is None:
            lists[name] = value
            continue
        try:
            lists[name] = _matrix(value) if isinstance(value, dict) else np.asarray(value, float)
        except (TypeError, ValueError):
            raise InputError(
                f"{file}: {name} is not a list of numbers or of rows of equal length; correct it"
            ) from None
    return lists


def _matrix(value: dict[str, Any]) -> Any:
    """Array of a matrix of OpenCV; another object as it is."""
    if "data" not in value:
        return value
    sizes = value.get("sizes", [value.get("rows", -1), value.get("cols", 1)])
    return np.asarray(value["data"], dtype=float).reshape([int(size) for size in sizes])
