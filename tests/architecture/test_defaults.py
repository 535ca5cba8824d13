"""No default of a command is declared again in the code below it."""

from typing import Final

from tests.architecture.defaults import repeated

_LEFT: Final = 28
"""Commands with plain signatures whose defaults are declared twice; lower it with each one."""


def test_no_more_defaults_are_declared_twice() -> None:
    assert len(repeated()) == _LEFT
