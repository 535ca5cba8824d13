"""Declaration of a command: its words, and runnable examples."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeVar

F = TypeVar("F", bound=Callable[..., object])
T = TypeVar("T")

_ATTRIBUTE: Final = "snakewalk_command"


@dataclass(frozen=True, slots=True)
class CommandInfo:
    """Words and examples of a command."""

    words: str
    """``plan``, or ``bus serve`` for a command below a subject."""
    examples: tuple[str, ...]
    """Command lines without the leading ``snakewalk``."""
    results: tuple[str, ...] = ()
    """Options that name files of results; ``--force`` overwrites them."""
    tables: tuple[str, ...] = ()
    """Options that name tables to which the command appends rows."""


def command(
    words: str,
    *,
    examples: tuple[str, ...] = (),
    results: tuple[str, ...] = (),
    tables: tuple[str, ...] = (),
) -> Callable[[F], F]:
    """Declare a function as a command; ``python -m tests.architecture.manifests`` lists it.

    The files of ``results`` and ``tables`` are checked before its module is imported.
    """

    def declare(function: F) -> F:
        setattr(function, _ATTRIBUTE, CommandInfo(words, examples, results, tables))
        return function

    return declare


def command_info(function: Callable[..., object]) -> CommandInfo:
    """Return the declaration of a command's function."""
    info = getattr(function, _ATTRIBUTE)
    assert isinstance(info, CommandInfo)
    return info


def plugin(kind: str, name: str) -> Callable[[T], T]:
    """Declare an object as a plug-in of a kind of ``console.plugins.KINDS``."""
    assert kind
    assert name
    return lambda target: target
