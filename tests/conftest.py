"""Fixtures shared by all tests."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of recordings made by other people; its tests are skipped where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("recordings of other people are not beside this clone")
    return folder


def pytest_addoption(parser: pytest.Parser) -> None:
    """Where the metal is: ``pytest -m metal --port /dev/ttyUSB0 --robot yaw16``."""
    group = parser.getgroup("metal", "a real bus, for tests marked 'metal'")
    group.addoption("--port", help="serial device of the bus")
    group.addoption("--robot", default="yaw16", help="shipped robot or TOML file on that bus")
