"""A ROS graph of this machine alone, in a domain of the test's own, and a client in it."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.helpers.ros_client import Client


@pytest.fixture
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.helpers.ros_client import LOOPBACK

    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name, value in LOOPBACK.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def client() -> Iterator["Client"]:
    from tests.helpers.ros_client import Client

    made = Client()
    yield made
    made.close()
