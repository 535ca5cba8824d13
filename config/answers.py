"""Answers of the user about a file: options of the commands that read it."""

from pydantic import BeforeValidator, Field

from snakewalk.config.base import Strict


class Answers(Strict):
    """Facts that a file may not state: options of commands, and keys of ``FILE.reading.toml``."""

    remember: bool = Field(
        False,
        description="store these answers in FILE.reading.toml for later commands",
    )


def _listed(given: object) -> object:
    parts = [part.strip() for part in given.split(",")] if isinstance(given, str) else given
    return tuple(parts) if isinstance(parts, list) else parts


LISTED = BeforeValidator(_listed)
"""Rule that reads a tuple from words, A,B,C, or from a stored list."""


class TableAnswers(Strict):
    """Columns of a table with other names, or none."""

    columns: dict[str, str] = Field(
        {},
        description="MEANING=COLUMN: name that the reader expects of a column, and that column's "
        "name or number; may be repeated",
    )
