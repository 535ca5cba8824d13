"""The module path of a command, without the working folder.

Python puts the working folder on the module path for ``python -m``, ``python -c``, and an empty
entry in ``PYTHONPATH``. A file ``numpy.py`` next to a downloaded model would be executed.
"""

import os
import sys
from collections.abc import Mapping
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
