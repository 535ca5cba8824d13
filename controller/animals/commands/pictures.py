"""The pictures that commands of fish and people draw with ``--picture``."""

from types import ModuleType


def pictures() -> tuple[ModuleType, ModuleType, ModuleType]:
    """Return the modules that draw matches and paths of fish, and people; they need matplotlib."""
    from snakewalk.controller.animals.plots import (  # noqa: PLC0415  --picture: an extra
        fish,
        fish_path,
        people,
    )

    return fish, fish_path, people
