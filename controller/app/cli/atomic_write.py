"""Results that are written whole or not at all, and never over what is there without being told."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from snakewalk.config.errors import InputError


def refuse_to_overwrite(paths: Sequence[Path | None], force: bool) -> None:
    """Check all results before any work is done.

    Raises:
        InputError: one line for each that exists (without ``force``), whose folder does not, or
            that is named twice.

    """
    wanted = [path for path in paths if path is not None]
    faults = [f"{path}: exists; --force overwrites it" for path in wanted if path.exists()]
    if force:
        faults = [f"{path}: is a folder" for path in wanted if path.is_dir()]
    folders = dict.fromkeys(path.parent for path in wanted)
    faults += [f"{folder}: no such folder" for folder in folders if not folder.is_dir()]
    if len({path.absolute() for path in wanted}) < len(wanted):
        faults.append("two results have the same name")
    if faults:
        raise InputError(faults)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Write to the path that is given; it takes its name when the block ends without a fault."""
    with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
        part = Path(folder) / path.name
        yield part
        part.replace(path)
