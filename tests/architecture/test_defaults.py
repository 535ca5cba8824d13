"""No default of a command is declared again in the code below it."""

import pytest

from tests.architecture.defaults import repeated


@pytest.mark.costs("imports every declaration of an option")
def test_no_default_is_declared_twice() -> None:
    assert repeated() == []
