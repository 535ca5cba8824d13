"""Fast imports of many modules; imported before everything else."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collections() -> Iterator[None]:
    """Pause Python's garbage collection while modules are imported.

    Imports make some 300,000 objects that live until the end. Python searches them for garbage
    again and again, which needs a seventh of the time of a start. Afterwards they belong to the
    oldest generation, so that the next collection of new objects does not search them.
    """
    if not gc.isenabled():  # by the caller
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        if gc.get_freeze_count() == 0:
            gc.freeze()
            gc.unfreeze()
        gc.enable()
