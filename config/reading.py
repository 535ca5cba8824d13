"""Facts about the files of other programs, each with its source, and answers of the user.

A reader returns ``Facts`` with its values. Answers to its questions may be stored in
``FILE.reading.toml`` in the same folder, for later commands.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

from pydantic import BaseModel

from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked
from snakewalk.config.strict_toml import read_toml
from snakewalk.config.template import plain_toml

M = TypeVar("M", bound=BaseModel)


class Fact(NamedTuple):
    """A fact about a file."""

    value: str
    source: Literal["file", "user", "inferred"]
    """Stated by the file, stated by the user, or inferred by the reader."""
    basis: str
    """Place of the statement, or evidence of the inference."""

    def __str__(self) -> str:
        """Value, source and basis in words."""
        words = {"file": "stated by", "user": "stated by you:", "inferred": "inferred:"}
        return f"{self.value} ({words[self.source]} {self.basis})"


Facts = Mapping[str, Fact]
"""Facts about a file's values: quantity, unit, order, and time of a motion."""


def texts(facts: Facts) -> dict[str, str]:
    """Texts of facts, for the output."""
    return {name: str(fact) for name, fact in facts.items()}


def stated(data: Path, option: str, by_file: str | None, by_user: str | None) -> Fact | None:
    """Fact that the file or an option of the user states; None if neither does.

    Raises:
        InputError: both state one, and they differ.

    """
    if by_user not in (None, by_file) and by_file is not None:
        raise InputError(f"{option} {by_user}: {data} states {by_file}; leave the option out")
    if by_file is not None:
        return Fact(by_file, "file", "the names of its columns")
    return None if by_user is None else Fact(by_user, "user", option)


def with_stored(data: Path, answers: M) -> tuple[M, tuple[str, ...]]:
    """Return answers completed by those stored for a file, and a line for each of these.

    Raises:
        ConfigError: the stored answers have a fault.

    """
    file = _beside(data)
    if not file.is_file():
        return answers, ()
    stored, text = read_toml(file)
    given = answers.model_dump(exclude_defaults=True)
    lines = (f"{file.name}: {key} = {value}" for key, value in stored.items() if key not in given)
    return checked(type(answers), stored | given, str(file), text), tuple(lines)


def store(data: Path, answers: BaseModel) -> None:
    """Write answers into the folder of a file.

    Raises:
        InputError: no answer is given, or the folder cannot be written.

    """
    answers, _ = with_stored(data, answers)
    kept = answers.model_copy(update={"remember": False})
    text = plain_toml(kept, f"Answers about {data.name}")
    if "=" not in text:
        raise InputError(f"{data}: --remember: no option answers a question; leave it out")
    try:
        _beside(data).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{_beside(data)}: {error.strerror or error}") from None


def _beside(data: Path) -> Path:
    return data.with_name(f"{data.name}.reading.toml")
