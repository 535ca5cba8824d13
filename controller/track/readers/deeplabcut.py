"""DeepLabCut's files: tables with column names in three or four stacked rows.

The rows are ``scorer``, ``individuals`` (several animals only), ``bodyparts`` and ``coords`` (x, y,
likelihood; hand labels have no likelihood). The HDF5 file is the same table as pandas writes it: a
group, usually ``df_with_missing``, with a ``table`` of ``values_block_0``. Its column names are a
pickle in the group's attribute ``non_index_axes``.
"""

import io
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.errors import InputError
from snakewalk.config.text_table import numbers_of
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.track import frame_numbers

PCUTOFF = 0.6
"""DeepLabCut's own default: likelihood below which a point is not drawn."""
_LEVELS = {"scorer", "individuals", "bodyparts", "coords"}
_NUMBER = re.compile(r"(\d+)(?:\.[A-Za-z]+)?$")  # 12, or labeled-data/film/img0012.png
_NO_INDIVIDUAL = "single"  # body parts that belong to no animal
Column = tuple[str, str, str]
"""Individual, body part, coordinate."""


def is_deeplabcut(rows: list[list[str]]) -> bool:
    """Whether these rows begin like DeepLabCut's CSV."""
    return len(rows) > 3 and rows[0][0] == "scorer" and "coords" in (rows[2][0], rows[3][0])


def load_rows(
    file: Path,
    rows: list[list[str]],
    choice: Choice,
) -> Keypoints:
    """Load the rows of a CSV; see ``load.load_file``."""
    depth = 4 if rows[3][0] == "coords" else 3
    level = {row[0]: row for row in rows[:depth]}
    if not {"bodyparts", "coords"} <= level.keys() or level.keys() - _LEVELS:
        raise InputError(
            f"{file}: DeepLabCut's first lines are scorer, (individuals,) bodyparts, coords; found "
            f"{', '.join(row[0] for row in rows[:depth])}"
        )
    first = 1
    while first < len(level["coords"]) and not level["coords"][first]:
        first += 1  # hand labels have three columns: folder, video and image
    animal_names = level.get("individuals", [""] * len(level["coords"]))
    columns = list(zip(animal_names, level["bodyparts"], level["coords"], strict=False))[first:]
    names = [f"{part} {axis}" for _, part, axis in columns]
    lines = range(depth + 1, len(rows) + 1)
    values = numbers_of(file, [row[first:] for row in rows[depth:]], names, lines)
    frame = _frames(file, [row[first - 1] for row in rows[depth:]])
    return _track(file, columns, values, frame, choice)


def _frames(file: Path, names: list[str]) -> Ints | None:
    """(T,) frame numbers: the index of predictions, or the number in a hand label's image name.

    Raises:
        InputError: the numbers do not rise, as in a table of several films.

    """
    matches = [_NUMBER.search(name) for name in names]
    numbers = [float(number_match[1]) for number_match in matches if number_match]
    if len(numbers) < len(names):
        return None
    if not np.all(np.diff(numbers) > 0.0):
        raise InputError(
            f"{file}: the numbers of its images do not rise; expected the labels of one film"
        )
    return frame_numbers(str(file), np.array(numbers))


def load_group(file: Path, group: Any, choice: Choice) -> Keypoints:
    """Load the open HDF5 group that holds ``table``; see ``load.load_file``."""
    table = group["table"]
    blocks = [name for name in table.dtype.names or () if name.startswith("values_block_")]
    if len(blocks) != 1 or table.dtype[blocks[0]].base.kind != "f":
        raise InputError(f"{file}: {group.name}: expected one block of numbers, found {blocks}")
    rows = np.asarray(table[:])
    values = np.asarray(rows[blocks[0]], dtype=float).reshape(len(rows), -1)
    columns = _columns(file, group.attrs.get("non_index_axes"), values.shape[1])
    numbers = rows["index"] if "index" in (table.dtype.names or ()) else None
    frame = None if numbers is None or numbers.dtype.kind not in "iu" else numbers.astype(np.int64)
    return _track(file, columns, values, frame, choice)


class _OnlyPlain(pickle.Unpickler):
    """Unpickler of plain values; rejects a pickle that names a class or function."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"names {module}.{name}")


def _columns(file: Path, stored: Any, count: int) -> list[Column]:
    """Column names of the HDF5 table."""
    try:
        data = stored.encode("latin-1") if isinstance(stored, str) else bytes(stored)
        axes = _OnlyPlain(io.BytesIO(data), encoding="latin-1").load()
        names = [tuple(map(str, name)) for name in axes[0][1]]
    except (pickle.UnpicklingError, ValueError, TypeError, LookupError, EOFError, AttributeError):
        raise InputError(
            f"{file}: the names of its columns cannot be read; use DeepLabCut's CSV instead"
        ) from None
    if len(names) != count or any(len(name) not in (3, 4) for name in names):
        raise InputError(
            f"{file}: has {len(names)} column names for {count} columns; use the CSV instead"
        )
    return [("" if len(name) == 3 else name[1], name[-2], name[-1]) for name in names]


def _track(
    file: Path,
    columns: list[Column],
    values: Floats,
    frame: Ints | None,
    choice: Choice,
) -> Keypoints:
    index_by_column = {column: k for k, column in enumerate(columns)}
    names = list(dict.fromkeys(individual for individual, _, _ in columns))
    animals = [individual for individual in names if individual != _NO_INDIVIDUAL] or names
    animals_with_points = {
        column[0] for k, column in enumerate(columns) if np.isfinite(values[:, k]).any()
    }
    animal_names = choice.animal(
        file,
        animals,
        [individual for individual in animals if individual in animals_with_points] or animals[:1],
    )
    parts = list(
        dict.fromkeys(part for individual, part, _ in columns if individual == animal_names)
    )
    missing = [
        p
        for p in parts
        if not {(animal_names, p, "x"), (animal_names, p, "y")} <= index_by_column.keys()
    ]
    if missing or not parts:
        raise InputError(f"{file}: expected x and y of each body part; {missing[:3]} lacks one")
    pixels = np.stack(
        [
            values[
                :,
                [
                    index_by_column[animal_names, part, "x"],
                    index_by_column[animal_names, part, "y"],
                ],
            ]
            for part in parts
        ],
        axis=1,
    )
    sure = [
        index_by_column[animal_names, p, "likelihood"]
        for p in parts
        if (animal_names, p, "likelihood") in index_by_column
    ]
    scores = values[:, sure] if len(sure) == len(parts) else None
    return Keypoints(
        file,
        parts,
        pixels * [1.0, -1.0],
        scores,
        least_score=0.0 if scores is None else PCUTOFF,
        frame=frame,
    )
