"""Colour pictures from files."""

from pathlib import Path

import cv2
import numpy as np
from PIL import Image as Pictures

from snakewalk.config.archive import check_expansion, read_bytes
from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError


def read_colours(file: Path) -> Image:
    """(H, W, 3) colours, blue first.

    Raises:
        InputError: no such file, or not a picture.

    """
    try:
        data = read_bytes(file)
        with Pictures.open(file) as opened:
            columns, rows = opened.size
        check_expansion(file, len(data), 3 * columns * rows)
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except (OSError, ValueError, SyntaxError, Pictures.DecompressionBombError, cv2.error):
        picture = None
    if picture is None:
        raise InputError(f"{file}: cannot be read as a picture")
    return np.asarray(picture, dtype=np.uint8)
