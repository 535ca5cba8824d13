"""Rows of a topic as JSON."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from snakewalk.controller.runlog.column import LINK, REQUIRED, Column, Topic
from snakewalk.controller.runlog.encode import (
    DIGITS,
    encode,
    exact,
    exact_text,
    flags_text,
    floats,
    number,
    rounded_text,
    rounded_texts,
    text,
)


class RowPrinter:
    """Prints the rows of one topic as JSON."""

    def __init__(self, topic: Topic) -> None:
        self._topic = topic
        columns = topic.columns
        self._columns = tuple(columns.values())
        self._required = {name for name, column in columns.items() if column.default is REQUIRED}
        self._defaults = {name: column.default for name, column in columns.items()}
        self._arrays = [
            (index, (-1, 3) if column.shape == (LINK, 3) else (-1,))
            for index, column in enumerate(columns.values())
            if _shares_line(column)
        ]
        """Places of the arrays of a fast topic that one call prints, and their shapes."""
        row_of_goals = _exact_row()
        self._numbers = [
            index
            for index, column in enumerate(columns.values())
            if column.kind in DIGITS and not column.shape
        ]
        """Places of single numbers, which the template prints if they are finite."""
        self._printers = [
            (index, _printer(column, row_of_goals))
            for index, column in enumerate(columns.values())
            if index not in self._numbers and not _shares_line(column)
        ]
        self._templates: dict[tuple[int, ...], str] = {}
        """Templates of rows, by the places of the unknown numbers."""

    def row(self, values: Mapping[str, Any]) -> str:
        """Return the JSON of a row; a field that has a default may be missing.

        Raises:
            TypeError: a required field is missing, or a value is not a field of the topic.
            ValueError: an exact number is not finite.

        """
        if len(values) != len(self._defaults):
            self._check(values)
            values = {**self._defaults, **values}
        try:
            if self._topic.is_fast:
                return self._fast_row(values)
            columns = self._topic.columns.items()
            return encode({name: json_value(column, values[name]) for name, column in columns})
        except KeyError:
            self._check(values)
            raise

    def _check(self, values: Mapping[str, Any]) -> None:
        missing = sorted(self._required - values.keys())
        unknown = sorted(values.keys() - self._defaults.keys())
        if missing or unknown:
            raise TypeError(
                f"{self._topic.name}: missing fields: {missing}; fields that it lacks: {unknown}"
            )

    def _fast_row(self, values: Mapping[str, Any]) -> str:
        cells = [values[name] for name in self._defaults]
        places = []
        arrays = []
        for position, shape in self._arrays:
            value = cells[position]
            if value is None:
                cells[position] = "null"
                continue
            array = np.asarray(value, dtype=float)
            arrays.append(array if array.ndim == len(shape) else array.reshape(shape))
            places.append(position)
        for place, printed in zip(places, rounded_texts(arrays), strict=True):
            cells[place] = printed
        for cell_index, print_one in self._printers:
            cells[cell_index] = print_one(cells[cell_index])
        unknown: tuple[int, ...] = ()
        if not math.isfinite(sum([cells[number_index] for number_index in self._numbers])):
            unknown = tuple(
                [
                    number_index
                    for number_index in self._numbers
                    if not math.isfinite(cells[number_index])
                ]
            )
            for unknown_index in unknown:
                cells[unknown_index] = self._unknown_text(unknown_index, cells[unknown_index])
        template = self._templates.get(unknown)
        if template is None:
            template = self._templates[unknown] = self._row_template(unknown)
        return template % tuple(cells)

    def _unknown_text(self, index: int, value: float) -> str:
        """Return the JSON of a number that is not finite.

        Raises:
            ValueError: it is an exact number.

        """
        column = self._columns[index]
        return text(value) if column.kind == "exact" else rounded_text(value)

    def _row_template(self, unknown: Sequence[int]) -> str:
        finite_indices = set(self._numbers) - set(unknown)
        fields = [
            f'"{name}":%{DIGITS[column.kind] if index in finite_indices else "s"}'
            for index, (name, column) in enumerate(self._topic.columns.items())
        ]
        return "{" + ",".join(fields) + "}"


def json_value(column: Column, value: Any) -> Any:
    """Return the value of a field of one row as the plain encoder accepts it."""
    if value is None or column.kind in ("object", "text"):
        return value
    if column.kind in ("integer", "flag", "joints"):
        return np.asarray(value).tolist() if column.shape else int(value)
    if column.kind == "exact":
        return exact(value) if column.shape else value
    if column.shape == (3, 3):
        return floats(np.ravel(value))
    return floats(value) if column.shape else number(value)


def _shares_line(column: Column) -> bool:
    return column.kind == "rounded" and bool(column.shape) and not column.is_printed_alone


def _printer(column: Column, row_of_goals: Callable[[Any], str]) -> Callable[[Any], str]:
    """Return the function that prints a value of a fast topic."""
    match column.kind:
        case "exact":
            return row_of_goals
        case "rounded":
            return _rounded_row
        case "integer" if not column.shape:
            return lambda value: str(int(value))
        case "joints":
            return lambda value: encode([int(element) for element in value])
        case "integer" | "flag":
            return lambda value: flags_text(value.tobytes(), value.dtype.char)
        case _:
            return encode


def _rounded_row(values: Any) -> str:
    return "null" if values is None else rounded_texts([np.asarray(values, dtype=float)])[0]


def _exact_row() -> Callable[[Any], str]:
    """Return ``exact_text`` for values that mostly equal those of the call before."""
    last: bytes | None = None
    last_text = ""

    def print_row(values: Any) -> str:
        nonlocal last, last_text
        array = np.asarray(values, dtype=float)
        now = array.tobytes()
        if now != last:
            last = now
            last_text = exact_text(array)
        return last_text

    return print_row
