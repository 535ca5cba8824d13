"""Results as JSON lines: a file that grows by whole rows, and is continued."""

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from snakewalk.config.archive import parse_json, read_text
from snakewalk.config.errors import InputError

A = TypeVar("A")
B = TypeVar("B")


def read_lines(path: Path, parse: Callable[[Any], A], what: str) -> list[A]:
    """Return the results in a file; none if it does not exist.

    Args:
        path: the file.
        parse: makes a result of a row; raises ValueError, KeyError or TypeError for another row.
        what: a row, in the message.

    Raises:
        InputError: a line is damaged, or is not such a row.

    """
    lines_parsed: list[A] = []
    lines = read_text(path).splitlines() if path.exists() else []
    for number, line in enumerate(lines, 1):
        try:
            lines_parsed.append(parse(parse_json(line)))
        except (ValueError, KeyError, TypeError):
            raise InputError(
                f"{path}: line {number} is not {what}; remove it, or choose another file"
            ) from None
    return lines_parsed


def append_lines(
    path: Path, finished: Iterable[tuple[A, B]], row_of: Callable[[B], dict[str, Any]]
) -> Iterator[tuple[A, B]]:
    """Yield items and results, each after its row is in the file."""
    with path.open("a", encoding="utf-8") as file:
        for item, result in finished:
            file.write(json.dumps(row_of(result)) + "\n")
            file.flush()
            yield item, result
