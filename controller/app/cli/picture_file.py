"""The file of a picture, looked at before any work is done."""

from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra

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
    require_extra("pictures need", "matplotlib")
