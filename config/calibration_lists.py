"""Camera calibrations as plain lists in JSON."""

from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_STORAGE_BYTES, parse_json, read_text
from snakewalk.config.errors import InputError


def read_json_lists(file: Path) -> dict[str, Any] | None:
    """Values of a JSON file of plain lists and numbers, as from ``json.dump``.

    Returns:
        Arrays and numbers by name; None for another ending, or a matrix of OpenCV, which is an
        object with ``type_id``.

    Raises:
        InputError: it is too large, or has a value that is neither numbers nor text.
        OSError: it cannot be read.

    """
    if file.suffix.lower() != ".json":
        return None
    try:
        held = parse_json(read_text(file, MOST_STORAGE_BYTES))
    except ValueError:
        return None  # OpenCV also reads comments, and states the line of a fault
    if not isinstance(held, dict) or any(isinstance(value, dict) for value in held.values()):
        return None
    lists: dict[str, Any] = {}
    for name, value in held.items():
        if isinstance(value, str | bool) or value is None:
            continue
        try:
            lists[name] = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                f"{file}: {name} is not a list of numbers or of rows of equal length; correct it"
            ) from None
    return lists
