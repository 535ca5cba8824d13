"""How a program imports: not from the working folder, and many modules fast.

Imported before everything else. Python puts the working folder on the module path for
``python -m``, ``python -c``, and an empty entry in ``PYTHONPATH``. A file ``numpy.py`` next to a
downloaded model would be executed.
"""

import gc
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import snakewalk

_ROOT = str(Path(snakewalk.__file__).parents[1])
"""Folder from which this package is imported."""


def make_path_safe() -> None:
    """Remove the working folder from ``sys.path``, unless ``PYTHONPATH`` names it.

    If it is the folder of this package, it becomes the last entry, so that it hides no other
    module.
    """
    try:
        folder = os.path.realpath(os.curdir)
    except OSError:  # the working folder is deleted
        return
    named = {os.path.realpath(entry) for entry in module_folders(os.environ)}
    if folder not in named:
        sys.path[:] = [
            entry for entry in sys.path if os.path.realpath(entry or os.curdir) != folder
        ]
    if _ROOT not in sys.path:
        sys.path.append(_ROOT)


def module_folders(environ: Mapping[str, str]) -> list[str]:
    """Return the folders in ``PYTHONPATH``, without empty entries (the working folder)."""
    return [entry for entry in environ.get("PYTHONPATH", "").split(os.pathsep) if entry]


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
