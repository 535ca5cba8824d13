"""Priority of this process on a busy machine."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

RAISE = 10
"""Steps of niceness if real-time scheduling is not available: each is about a quarter more of a
busy processor (Linux, ``sched(7)``), with autogroup only within a terminal."""
LOWER = 10
"""Niceness of work that may wait."""


@contextmanager
def raised_priority() -> Iterator[None]:
    """Raise the priority of the calling thread and its children within the context.

    On Linux it is the least real-time priority (``SCHED_RR``), which needs a superuser or
    ``rtprio`` (``limits.conf(5)``); otherwise lower niceness, which also needs a superuser.
    """
    restore = _real_time() or _lower_niceness()
    try:
        yield
    finally:
        if restore is not None:
            restore()


def give_way() -> None:
    """Give this process the lowest usual priority."""
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            before = os.getpriority(os.PRIO_PROCESS, 0)
            os.setpriority(os.PRIO_PROCESS, 0, max(before, LOWER))


def _real_time() -> Callable[[], None] | None:
    """Set the least real-time priority; return a function that restores it, or None."""
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except (AttributeError, OSError):
        return None
    return lambda: os.sched_setscheduler(0, *before)


def _lower_niceness() -> Callable[[], None] | None:
    """Lower the niceness; return a function that restores it, or None."""
    try:
        before = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, 0, before - RAISE)
    except (AttributeError, OSError):
        return None
    return lambda: os.setpriority(os.PRIO_PROCESS, 0, before)
