"""Recordings of every kind in a file: the content, not the name, says which it is."""

from pathlib import Path

from config.errors import InputError
from controller.capture.arrays import load_npy, load_npz
from controller.capture.kinds import KNOWN
from controller.capture.tables import load_csv
from controller.capture.track import Track


def load_file(path: str | Path, rate_hz: float | None = None) -> Track:
    """Load a recording.

    Args:
        path: of the file.
        rate_hz: frames a second, taken instead of what the file (or its format) says.

    Raises:
        InputError: no such file, none of the known formats, or a fault inside it.

    """
    file = Path(path)
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise InputError(f"{file}: the frame rate must be above 0 Hz, not {rate_hz}")
    try:
        with file.open("rb") as stream:
            head = stream.read(8)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    if head.startswith(b"PK\x03\x04"):
        return load_npz(file, rate_hz)
    if head.startswith(b"\x93NUMPY"):
        return load_npy(file, rate_hz)
    if not head or b"\x00" in head:
        raise InputError(f"{file}: {'is empty' if not head else 'is no recording'}; known: {KNOWN}")
    return load_csv(file, rate_hz)
