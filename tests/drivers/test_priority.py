"""Priority is raised only for as long as it is needed, and only by whom the system lets."""

import os

import pytest

from snakewalk.drivers.priority import RAISE, raised_priority


def niceness() -> int:
    return os.getpriority(os.PRIO_PROCESS, 0)


@pytest.fixture
def kept(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """What the system was asked for; this process stays as it is."""
    asked: list[int] = []
    monkeypatch.setattr(os, "setpriority", lambda which, who, value: asked.append(value))
    return asked


def test_it_is_raised_and_given_back_whatever_happens(kept: list[int]) -> None:
    before = niceness()
    with pytest.raises(RuntimeError, match="within"), raised_priority():
        raise RuntimeError("within")
    assert kept == [before - RAISE, before]


def test_who_may_not_goes_on_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(which: int, who: int, value: int) -> None:
        raise PermissionError

    before, done = niceness(), False
    monkeypatch.setattr(os, "setpriority", refuse)
    with raised_priority():
        done = True
    assert done
    assert niceness() == before


def test_a_system_without_it_goes_on_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "setpriority")
    with raised_priority():
        assert not hasattr(os, "setpriority")


@pytest.mark.skipif(os.geteuid() != 0, reason="only a superuser may raise its priority")
def test_the_system_does_it() -> None:
    before = niceness()
    with raised_priority():
        assert niceness() == max(before - RAISE, -20)
    assert niceness() == before
