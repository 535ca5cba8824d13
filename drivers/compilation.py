"""Observers of loops that numba compiles because its cache lacks them."""

from collections.abc import Callable

_OBSERVERS: list[Callable[[str], None]] = []


def observe_compilation(observer: Callable[[str], None]) -> Callable[[], None]:
    """Call ``observer`` with the name of each compiled loop; return a function that removes it."""
    _OBSERVERS.append(observer)

    def remove() -> None:
        _OBSERVERS.remove(observer)

    return remove


def report_compiled(loop: str) -> None:
    """Inform the observers that ``loop`` was compiled."""
    for observer in list(_OBSERVERS):
        observer(loop)
