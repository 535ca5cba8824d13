"""Facts about the files of other programs, each with its source, and answers of the user.

A reader returns ``Facts`` with its values. Answers to its questions may be stored in
``FILE.reading.toml`` in the same folder, for later commands.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from pydantic import BaseModel

from snakewalk.config.answers import Answers
from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked
from snakewalk.config.strict_toml import read_toml
from snakewalk.config.template import plain_toml

M = TypeVar("M", bound=BaseModel)
A = TypeVar("A", bound=Answers)


R = TypeVar("R")


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


def by_user(option: str, value: str | None) -> Fact | None:
    """Fact that an option states; None without it."""
    return None if value is None else Fact(value, "user", option)


def by_file(place: str, value: str | None) -> Fact | None:
    """Fact that a place in a file states; None without it."""
    return None if value is None else Fact(value, "file", place)


def by_names(value: str | None, names: Iterable[str], columns: Mapping[str, str]) -> Fact | None:
    """Fact that names of columns state, in the file or in ``--columns``; None without it."""
    if {*names} & {*columns}:
        return by_user("--columns", value)
    return by_file("the names of its columns", value)


def stated(data: Path, option: str, before: Fact | None, answer: str | None) -> Fact | None:
    """Fact that was stated before, or by an option of the user; None if neither is.

    Raises:
        InputError: both are, and they differ.

    """
    if before is not None and answer not in (None, before.value):
        raise InputError(f"{option} {answer}: {data} states {before.value}; leave the option out")
    return before or by_user(option, answer)


def decided(
    where: object, question: str, option: str, readings: Mapping[str, str], given: Fact | None
) -> Fact:
    """Return the given fact, else ask for it.

    Args:
        where: file, for the question.
        question: the missing statement of the file.
        option: that answers it.
        readings: consequence of each possible value.
        given: stated by the file or the user, or inferred.

    Raises:
        InputError: the question.

    """
    if given is not None:
        return given
    listed = " or ".join(f"{words} ({option} {value})" for value, words in readings.items())
    raise InputError(f"{where}: {question}: {listed}")


def with_stored(data: Path, answers: M) -> tuple[M, tuple[str, ...]]:
    """Return answers completed by those stored for a file, and a line for each of these.

    Raises:
        ConfigError: the stored answers have a fault.

    """
    file = _beside(data)
    if not file.is_file():
        return answers, ()
    before, text = read_toml(file)
    given = answers.model_dump(exclude_defaults=True)
    lines = (f"{file.name}: {key} = {value}" for key, value in before.items() if key not in given)
    return checked(type(answers), before | given, str(file), text), tuple(lines)


def stored(data: Path) -> dict[str, Any]:
    """Answers stored for a file, unchecked.

    Raises:
        ConfigError: they are no TOML.

    """
    file = _beside(data)
    return read_toml(file)[0] if file.is_file() else {}


def answered(data: Path, answers: A, read: Callable[[A], R]) -> R:
    """Read a file with the answers of the user and the stored ones; store them if requested.

    Raises:
        InputError: of ``read``, or the answers cannot be stored.
        ConfigError: the stored answers have a fault.

    """
    answers, lines = with_stored(data, answers)
    result: Any = read(answers)
    if answers.remember:
        store(data, answers)
    noted: R = replace(result, notes=(*lines, *result.notes))
    return noted


def store(data: Path, answers: BaseModel) -> None:
    """Write complete answers into the folder of a file.

    Raises:
        InputError: no answer is given, or the folder cannot be written.

    """
    text = plain_toml(answers.model_copy(update={"remember": False}), f"Answers about {data.name}")
    if "=" not in text:
        raise InputError(f"{data}: --remember: no option answers a question; leave it out")
    try:
        _beside(data).write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{_beside(data)}: {error.strerror or error}") from None


def _beside(data: Path) -> Path:
    data = data if data.name else data.absolute()
    return data.with_name(f"{data.name}.reading.toml")
