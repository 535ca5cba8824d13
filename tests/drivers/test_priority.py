"""Priority is raised only for as long as it is needed, and only by whom the system lets."""

import os
import subprocess
import sys

import pytest

from snakewalk.drivers.priority import LOWER, RAISE, give_way, raised_priority

REAL_TIME = hasattr(os, "sched_setscheduler")


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """What the system was asked for; this process stays as it is."""
    words: list[object] = []
    if REAL_TIME:
        monkeypatch.setattr(
            os, "sched_setscheduler", lambda pid, policy, _: words.append(("policy", policy))
        )
    monkeypatch.setattr(os, "setpriority", lambda which, who, value: words.append(value))
    return words


def refuse(*given: object) -> None:
    raise PermissionError


@pytest.mark.skipif(not REAL_TIME, reason="no real-time scheduling here")
def test_it_is_raised_and_given_back_whatever_happens(asked: list[object]) -> None:
    with pytest.raises(RuntimeError, match="within"), raised_priority():
        raise RuntimeError("within")
    assert asked == [("policy", os.SCHED_RR), ("policy", os.SCHED_OTHER)]


def test_without_real_time_it_is_niceness(
    asked: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "sched_getscheduler", raising=False)
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with raised_priority():
        assert asked == [before - RAISE]
    assert asked == [before - RAISE, before]


def test_who_may_neither_goes_on_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("sched_setscheduler", "setpriority"):
        monkeypatch.setattr(os, name, refuse, raising=False)
    done = False
    with raised_priority():
        done = True
    assert done


def test_a_system_without_either_goes_on_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("sched_getscheduler", "setpriority", "getpriority"):
        monkeypatch.delattr(os, name, raising=False)
    with raised_priority():
        assert not hasattr(os, "setpriority")


def test_who_gives_way_keeps_nothing_of_its_parents_priority(
    asked: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "getpriority", lambda which, who: -RAISE)
    give_way()
    assert asked[-1] == LOWER
    if REAL_TIME:
        assert asked[0] == ("policy", os.SCHED_OTHER)


@pytest.mark.skipif(
    not REAL_TIME or os.geteuid() != 0, reason="only a superuser may raise its priority"
)
def test_the_system_does_it() -> None:
    told = subprocess.run(
        [
            sys.executable,
            "-c",
            "import os\n"
            "from snakewalk.drivers.priority import give_way, raised_priority\n"
            "with raised_priority():\n"
            "    print(os.sched_getscheduler(0), flush=True)\n"
            "    if os.fork() == 0:\n"
            "        give_way()\n"
            "        print(os.sched_getscheduler(0), flush=True)\n"
            "        os._exit(0)\n"
            "    os.wait()\n"
            "print(os.sched_getscheduler(0))\n",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    first, child, last = map(int, told.stdout.split())
    assert first in (os.SCHED_RR, os.SCHED_OTHER)  # a container may keep it from a superuser, too
    assert (child, last) == (os.SCHED_OTHER, os.SCHED_OTHER)
