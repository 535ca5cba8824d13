"""Hints on names and files that do not exist: the closest ones."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


def name_hint(name: str, names: Iterable[str]) -> str:
    """Hint on an unknown name: the closest ones."""
    lower = {known.lower(): known for known in names}
    near = [lower[close] for close in get_close_matches(name.lower(), lower, 3, 0.5)]
    return f"; did you mean {', '.join(near)}?" if near else ""


def file_hint(path: Path) -> str:
    """Hint on a file that does not exist: the closest names in its folder."""
    return name_hint(path.name, [file.name for file in path.parent.glob("*")])
