"""Priority of this process: how soon the operating system lets it run on a busy machine."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

RAISE = 10
"""Steps of niceness if real-time scheduling is not available. Each step is about a quarter more of
a busy processor (Linux, ``sched(7)``). This holds only among the programs of one terminal if the
system groups them (autogroup)."""
LOWER = 10
"""Niceness of work that may wait."""


@contextmanager
def raised_priority() -> Iterator[None]:
    """Put the calling thread, and what it starts, before others for as long as the context lasts.

    A late command drops or stops the servos. On Linux it is a real-time priority (``SCHED_RR``, the
    least), on other systems niceness. Only a superuser, or who is granted ``rtprio``
    (``limits.conf(5)``), may have it: for others nothing changes. The system leaves a twentieth of
    the time to all others.
    """
    restore = _real_time() or _nicer()
    try:
        yield
    finally:
        if restore is not None:
            restore()


def give_way() -> None:
    """Let all others run before this process, whatever priority its parent has."""
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    if hasattr(os, "setpriority"):
        with suppress(OSError):
            before = os.getpriority(os.PRIO_PROCESS, 0)
            os.setpriority(os.PRIO_PROCESS, 0, max(before, LOWER))


def _real_time() -> Callable[[], None] | None:
    """Set the least real-time priority; returns a function that restores it, or None."""
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except (AttributeError, OSError):
        return None
    return lambda: os.sched_setscheduler(0, *before)


def _nicer() -> Callable[[], None] | None:
    """Do the same with niceness."""
    try:
        before = os.getpriority(os.PRIO_PROCESS, 0)
        os.setpriority(os.PRIO_PROCESS, 0, before - RAISE)
    except (AttributeError, OSError):
        return None
    return lambda: os.setpriority(os.PRIO_PROCESS, 0, before)
