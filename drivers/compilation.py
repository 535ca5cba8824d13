"""Observers that are informed when a loop was compiled because numba's cache did not contain it."""

from collections.abc import Callable

_OBSERVERS: list[Callable[[str], None]] = []


def observe_compilation(observer: Callable[[str], None]) -> Callable[[], None]:
    """Call ``observer`` with the name of each loop after its compilation; returns a removal."""
    _OBSERVERS.append(observer)

    def remove() -> None:
        _OBSERVERS.remove(observer)

    return remove


def report_compiled(loop: str) -> None:
    """Inform the observers that ``loop`` was compiled."""
    for observer in list(_OBSERVERS):
        observer(loop)
