"""The file of a picture, looked at before any work is done."""

from importlib.util import find_spec
from pathlib import Path

from snakewalk.config.errors import InputError

ENDINGS = (".png", ".svg", ".pdf")


def check_picture(path: Path | None) -> None:
    """Refuse a file that cannot be drawn; None is no picture.

    Raises:
        InputError: another ending, or matplotlib is missing.

    """
    if path is None:
        return
    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"{path}: a picture ends in {', '.join(ENDINGS)}")
    if find_spec("matplotlib") is None:
        raise InputError("pictures need matplotlib: pip install 'snakewalk[view]'")
