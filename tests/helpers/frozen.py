"""What the suite has imported and collected is left out of garbage collections."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

frozen_objects: Final[Callable[[], int]] = gc.get_freeze_count
"""Python's own count, which goes over all of them: 20 to 60 ms in the suite."""


def freeze() -> None:
    """Freeze the present objects, and count them once: a command and a run ask several times."""
    gc.freeze()
    count = frozen_objects()
    gc.get_freeze_count = lambda: count


@contextmanager
def unfrozen() -> Iterator[None]:
    """Let a test see garbage collections as a program does."""
    gc.unfreeze()
    gc.get_freeze_count = frozen_objects
    try:
        yield
    finally:
        freeze()
