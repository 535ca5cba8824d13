"""One door for recordings: a shipped name, figures of your own, or a file of tracked bodies."""

from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load
from snakewalk.config.recording import RecordingConfig
from snakewalk.controller.capture.readers.formats import load_file
from snakewalk.controller.capture.readers.generated import EMBEDDED, embedded, generate
from snakewalk.controller.capture.readers.kinds import KNOWN
from snakewalk.controller.capture.track import Track


def load_track(
    name_or_path: str, rate_hz: float | None = None, least_score: float | None = None
) -> Track:
    """Load a shipped recording by name, or a file by path.

    Args:
        name_or_path: a name of ``EMBEDDED``; or figures in a ``.toml`` (``RecordingConfig``); or a
            file of one of the kinds of ``kinds.KNOWN``.
        rate_hz: frames a second of a file, taken instead of what it (or its kind) says.
        least_score: keypoints of a file whose score is below it count as missing.

    Raises:
        InputError: neither name nor file, no known format, or a fault inside it.

    """
    path = Path(name_or_path)
    made = name_or_path in EMBEDDED or path.suffix == ".toml"
    if made and rate_hz is not None:
        raise InputError(f"{name_or_path}: its figures hold the frame rate; give one for files")
    if made and least_score:
        raise InputError(
            f"{name_or_path}: is made from figures and has no scores; give one for files"
        )
    if name_or_path in EMBEDDED:
        return embedded(name_or_path)
    if not path.exists():
        raise InputError(
            f"{name_or_path}: no such recording or file; shipped are {', '.join(EMBEDDED)}; "
            f"a file may be {KNOWN}"
        )
    if path.suffix == ".toml":
        return generate(load(path, RecordingConfig))
    return load_file(path, rate_hz, least_score)


def track_beside(name_or_path: str, folder: Path | None) -> str:
    """Path of a recording named in a file in ``folder``: relative to it where it is there."""
    if folder is None or name_or_path in EMBEDDED or not (folder / name_or_path).is_file():
        return name_or_path
    return str(folder / name_or_path)
