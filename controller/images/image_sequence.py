"""Images of one recording: their order, the pages of stacks, and missing numbers."""

import re
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from snakewalk.config.arrays import Ints

STACKS = (".tif", ".tiff")


def in_order(file: Path) -> list[tuple[int, str]]:
    """Sort key that puts 2.png before 10.png."""
    return [
        (int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)
    ]


def pages_of(files: Sequence[Path]) -> tuple[tuple[Path, ...], tuple[int, ...]]:
    """Return each image once per page, and the page of each, from 0."""
    found = [
        (file, page)
        for file in files
        for page in range(_page_count(file) if file.suffix.lower() in STACKS else 1)
    ]
    return tuple(file for file, _ in found), tuple(page for _, page in found)


def _page_count(file: Path) -> int:
    try:
        return max(1, int(cv2.imcount(str(file))))
    except cv2.error:
        return 1  # reading the file reports the fault


def frame_numbers_of(files: Sequence[Path]) -> Ints | None:
    """(T,) frame numbers from 0, by the last number in the names.

    None if no number is missing at a constant step, or if the names do not form one sequence.
    """
    parts = [re.fullmatch(r"(.*?)(\d+)(\D*)", file.name) for file in files]
    known = [one for one in parts if one is not None]
    if len(files) < 3 or len(known) < len(files) or len({(m[1], m[3]) for m in known}) > 1:
        return None
    number = np.array([int(one[2]) for one in known], dtype=np.int64)
    step = np.diff(number)
    if step.min() < 1 or (step % step.min()).any() or (step == step.min()).all():
        return None
    return np.asarray((number - number[0]) // step.min(), dtype=np.int64)
