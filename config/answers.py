"""Answers of the user about a file: options of the commands that read it."""

from pydantic import BeforeValidator, Field

from snakewalk.config.base import Strict


class Answers(Strict):
    """Facts that a file may not state: options of commands, and keys of ``FILE.reading.toml``."""

    remember: bool = Field(
        False,
        description="store these answers in FILE.reading.toml for later commands",
    )


LISTED = BeforeValidator(
    lambda given: [part.strip() for part in given.split(",")] if isinstance(given, str) else given
)
"""Rule that reads a list from words: A,B,C."""


class TableAnswers(Strict):
    """Columns of a table with other names, or none."""

    columns: dict[str, str] = Field(
        {},
        description="MEANING=COLUMN: name that the reader expects of a column, and that column's "
        "name or number; may be repeated",
    )
