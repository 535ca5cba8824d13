"""Files of results: checked before any work, written completely or not at all."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra

try:
    import fcntl
except ImportError:  # Windows deletes no file that a program has open
    fcntl = None  # type: ignore[assignment]

_HAS_LOCKS: bool = fcntl is not None
LOG = "log.mcap"
FILM = "film.mp4"
REPORT = "report.html"
SUMMARY = "summary.json"
MAP = "map.npz"
"""Map of a run that maps its ground; a world of kind ``map`` accepts it."""
_PARTS = "log.part*.mcap"
"""Further parts of a long log; the one that is being written has one more ending."""
RUN_FILES = (LOG, f"{LOG}.part", FILM, REPORT, SUMMARY, MAP)
"""Files of a run in its folder, which holds the files of one run only."""
PICTURE_ENDINGS = (".png", ".svg", ".pdf")


def refuse_to_overwrite(paths: Sequence[Path | None], force: bool) -> None:
    """Check the files of all results before any work; None is ignored.

    Raises:
        InputError: one line per file that exists (without ``force``), whose folder is missing or
            not writable, or that is named twice.

    """
    files = [path for path in paths if path is not None]
    faults = [f"{path}: is a folder; name a file" for path in files if path.is_dir()]
    if not force:
        exist = [path for path in files if path.exists() and not path.is_dir()]
        faults += [f"{path}: exists; --force overwrites it" for path in exist]
    for folder in dict.fromkeys(path.parent for path in files):
        fault = _folder_fault(folder)
        faults += [] if fault is None else [fault]
    if len({path.absolute() for path in files}) < len(files):
        faults.append("two results have the same name")
    if faults:
        raise InputError(faults)


def _folder_fault(folder: Path) -> str | None:
    """Return why a folder accepts no new file, or None.

    It creates an unnamed file: permissions alone do not reveal a read-only disk.
    """
    if not folder.is_dir():
        return f"{folder}: no such folder"
    try:
        with tempfile.TemporaryFile(dir=folder):
            return None
    except OSError as error:
        return f"{folder}: takes no file: {error.strerror}"


@contextmanager
def run_folder(name: str, out: Path | None) -> Iterator[Path]:
    """Yield the folder of a new run: ``out``, else ``runs/name``, numbered from 2 if taken.

    A numbered folder is made at once, so that two programs never share one; an empty one is
    removed.

    Raises:
        InputError: the folder cannot be made, or accepts no file.

    """
    folder = Path("runs") / name if out is None else out
    new: list[Path] = []
    try:
        for number in count(2):
            new = [place for place in (folder, *folder.parents) if not place.exists()]
            try:
                folder.mkdir(parents=True)
            except FileExistsError:
                if out is not None:
                    break
                folder = Path("runs") / f"{name}-{number}"
            else:
                break
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror}") from None
    try:
        fault = _folder_fault(folder)
        if fault is not None:
            raise InputError(fault)
        yield folder
    finally:
        with suppress(OSError):
            for place in new:
                place.rmdir()


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Keep other runs out of the folder of a run; the system ends the lock of a killed program.

    A file system without locks (some network disks) does not keep them out.

    Raises:
        InputError: another run uses the folder.

    """
    if not _HAS_LOCKS:
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        with suppress(OSError):  # no locks here
            if not _lock(descriptor):
                raise InputError(
                    f"{folder}: another run uses this folder; give another --out, or wait for "
                    "its end"
                )
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Lock an open folder for this program; False if another one has locked it."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def cleared_folder(folder: Path, force: bool) -> Iterator[None]:
    """Make or clear the folder of a run that begins, and keep other runs out of it.

    Raises:
        InputError: another run uses it, or (without ``force``) it holds a run's files.

    """
    folder.mkdir(parents=True, exist_ok=True)
    with locked_folder(folder):
        _refuse_run_files(folder, force)
        clear_run(folder)
        yield


def refuse_another_run(folder: Path, force: bool) -> None:
    """Check that a folder has no run's files, and that no run uses it.

    Raises:
        InputError: it has (without ``force``), or a run uses it.

    """
    if folder.is_dir():
        with locked_folder(folder):
            _refuse_run_files(folder, force)


def _refuse_run_files(folder: Path, force: bool) -> None:
    there = run_files(folder)
    if there and not force:
        names = ", ".join(file.name for file in there)
        raise InputError(
            f"{folder}: holds a run ({names}); give another --out, or --force, which deletes these"
        )


def refuse_mixture(log: Path, folder: Path, force: bool) -> None:
    """Check that page and film of a log are not written into the folder of another run.

    In the log's own folder they are replaced. Elsewhere ``force`` deletes an old page and film,
    never a log.

    Raises:
        InputError: the folder has another log, or (without ``force``) a page or a film.

    """
    logs = [folder / name for name in RUN_FILES[:2] if (folder / name).exists()]
    if any(earlier_log.samefile(log) for earlier_log in logs):
        return
    if logs:
        raise InputError(f"{logs[0]}: is another run's log; give another --out")
    refuse_another_run(folder, force)
    clear_run(folder)


def clear_run(folder: Path) -> None:
    """Delete the files of an earlier run, so that none is mistaken for one of the next."""
    for file in run_files(folder):
        file.unlink(missing_ok=True)


def run_files(folder: Path) -> list[Path]:
    """Return the files of a run in its folder, and the further parts of its log."""
    return [file for name in (*RUN_FILES, f"{_PARTS}*") for file in folder.glob(name)]


def check_ending(path: Path | None, what: str, *endings: str) -> None:
    """Reject a file of ``what`` with another ending; None is ignored.

    Raises:
        InputError: the ending is another one.

    """
    if path is not None and path.suffix.lower() not in endings:
        raise InputError(f"{path}: {what} ends in {', '.join(endings)}")


def check_picture(path: Path | None) -> None:
    """Reject a file that cannot be drawn; None is ignored.

    Raises:
        InputError: the ending is not a picture's, or matplotlib is not installed.

    """
    check_ending(path, "a picture", *PICTURE_ENDINGS)
    if path is not None:
        require_extra("pictures need", "matplotlib")


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path, which becomes ``path`` if the block ends without an error.

    It has the same name, in a folder next to ``path``. Further files that the block writes next to
    it (a mesh's material) are moved too. After an error (a full disk, an interrupt) an older file
    is unchanged. Missing parent folders are made.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
        try:
            yield Path(folder) / path.name
        except OSError as error:
            if error.errno is None:
                raise
            raise OSError(error.errno, error.strerror, str(path)) from error
        for part in sorted(Path(folder).iterdir()):
            part.replace(path.parent / part.name)


def write_result(path: Path, text: str) -> None:
    """Write a text file as ``atomic_write`` does."""
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")
