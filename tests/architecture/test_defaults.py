"""No default of a command is declared again in the code below it."""

from tests.architecture.defaults import repeated


def test_no_default_is_declared_twice() -> None:
    assert repeated() == []
