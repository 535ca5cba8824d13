"""Priority of this process: how soon the operating system lets it run on a busy machine."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

RAISE = 10
"""Steps of niceness; each is about a quarter more of a busy processor (Linux, ``sched(7)``)."""


@contextmanager
def raised_priority() -> Iterator[None]:
    """Put the calling thread, and what it starts, before others for as long as the context lasts.

    Who keeps servos waiting at the wrong time drops or stops them. Only a superuser may do it, on
    a system that has it: for others nothing changes.
    """
    if not hasattr(os, "setpriority"):
        yield
        return
    before = os.getpriority(os.PRIO_PROCESS, 0)
    try:
        os.setpriority(os.PRIO_PROCESS, 0, before - RAISE)
    except OSError:
        yield
        return
    try:
        yield
    finally:
        os.setpriority(os.PRIO_PROCESS, 0, before)
