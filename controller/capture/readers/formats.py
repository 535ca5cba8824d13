"""Recordings of every kind in a file: the content, not the name, says which it is."""

from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.capture.readers.arrays import load_npy, load_npz
from snakewalk.controller.capture.readers.kinds import KNOWN
from snakewalk.controller.capture.readers.tables import load_csv
from snakewalk.controller.capture.readers.wcon import load_wcon, zipped_text
from snakewalk.controller.capture.track import Track

_HDF5 = b"\x89HDF\r\n\x1a\n"


def load_file(
    path: str | Path, rate_hz: float | None = None, least_score: float | None = None
) -> Track:
    """Load a recording.

    Args:
        path: of the file.
        rate_hz: frames a second, taken instead of what the file (or its format) says.
        least_score: keypoints whose score is below it count as missing; default 0, and for
            DeepLabCut its own 0.6.

    Raises:
        InputError: no such file, none of the known formats, or a fault inside it.

    """
    file = Path(path)
    if rate_hz is not None and not 0.0 < rate_hz < float("inf"):
        raise InputError(f"{file}: the frame rate must be above 0 Hz, not {rate_hz}")
    if least_score is not None and not 0.0 <= least_score <= 1.0:
        raise InputError(f"{file}: the least score must be from 0 to 1, not {least_score}")
    try:
        with file.open("rb") as stream:
            head = stream.read(128)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    if head.startswith(b"PK\x03\x04"):
        text = zipped_text(file)
        if text is not None:
            return load_wcon(file, text, rate_hz)
        return load_npz(file, rate_hz, least_score)
    if head.startswith(b"\x93NUMPY"):
        return load_npy(file, rate_hz)
    if head.startswith((_HDF5, b"MATLAB 7.3 MAT-file")):
        return _load_hdf5(file, rate_hz, least_score)
    if head.startswith(b"MATLAB 5.0 MAT-file"):
        from snakewalk.controller.capture.readers.matlab import load_mat  # noqa: PLC0415  scipy.io is slow to import

        return load_mat(file, rate_hz, least_score)
    if not head or b"\x00" in head:
        raise InputError(f"{file}: {'is empty' if not head else 'is no recording'}; known: {KNOWN}")
    if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        try:
            return load_wcon(file, file.read_text(encoding="utf-8-sig"), rate_hz)
        except UnicodeDecodeError:
            raise InputError(f"{file}: is no JSON in UTF-8; known: {KNOWN}") from None
    return load_csv(file, rate_hz, least_score)


def _load_hdf5(file: Path, rate_hz: float | None, least_score: float | None) -> Track:
    require_extra(f"{file}: HDF5 needs", "h5py")
    from snakewalk.controller.capture.readers.hdf5 import load_hdf5  # noqa: PLC0415  an extra

    return load_hdf5(file, rate_hz, least_score)
