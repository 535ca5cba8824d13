"""Files of results: checked before any work, written whole or not at all."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra

PICTURE_ENDINGS = (".png", ".svg", ".pdf")


def refuse_to_overwrite(paths: Sequence[Path | None], force: bool) -> None:
    """Check the files of all results before any work is done; None is no file.

    Raises:
        InputError: one line for each that exists (without ``force``), whose folder does not, or
            that is named twice.

    """
    files = [path for path in paths if path is not None]
    faults = [f"{path}: exists; --force overwrites it" for path in files if path.exists()]
    if force:
        faults = [f"{path}: is a folder" for path in files if path.is_dir()]
    folders = dict.fromkeys(path.parent for path in files)
    faults += [f"{folder}: no such folder" for folder in folders if not folder.is_dir()]
    if len({path.absolute() for path in files}) < len(files):
        faults.append("two results have the same name")
    if faults:
        raise InputError(faults)


def check_picture(path: Path | None) -> None:
    """Refuse a file that cannot be drawn; None is no picture.

    Raises:
        InputError: the ending is no picture's, or matplotlib is not installed.

    """
    if path is None:
        return
    if path.suffix.lower() not in PICTURE_ENDINGS:
        raise InputError(f"{path}: a picture ends in {', '.join(PICTURE_ENDINGS)}")
    require_extra("pictures need", "matplotlib")


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to; it becomes ``path`` when the block ends without an error.

    The temporary file has the same name, in a folder beside ``path``; further files that the block
    writes next to it (a mesh's material) are moved along. After an error (a full disk, an
    interrupt) nothing is left, and an older file is as it was. Missing parent folders are made.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
        yield Path(folder) / path.name
        for part in sorted(Path(folder).iterdir()):
            part.replace(path.parent / part.name)
