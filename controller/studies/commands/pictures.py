"""The pictures that commands of studies draw with ``--picture``."""

from types import ModuleType


def pictures() -> ModuleType:
    """Return the package that draws; it needs matplotlib."""
    from snakewalk.controller.studies import plots  # noqa: PLC0415  --picture: an extra

    return plots
