"""The entry for recordings: a shipped name, a file of figures, or a file of bodies."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from snakewalk.config.archive import ending, read_head, read_text
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load
from snakewalk.config.near_names import file_hint
from snakewalk.config.reading import Fact, Facts, answered
from snakewalk.config.recording import RecordingConfig
from snakewalk.controller.track.choice import ALL, Choice
from snakewalk.controller.track.readers.arrays import load_mat, load_npy, load_npz
from snakewalk.controller.track.readers.bvh import load_bvh
from snakewalk.controller.track.readers.formats import HEAD_BYTES, KNOWN, Format, format_of
from snakewalk.controller.track.readers.generated import EMBEDDED, embedded, generate
from snakewalk.controller.track.readers.keypoints import KEYPOINT_RATE_HZ, Keypoints
from snakewalk.controller.track.readers.marker_tables import load_trc
from snakewalk.controller.track.readers.markers import load_c3d, load_qtm
from snakewalk.controller.track.readers.tables import load_csv
from snakewalk.controller.track.readers.wcon import load_wcon, zipped_text
from snakewalk.controller.track.track import Track


def choice_among(name: str, names: Sequence[str], choice: Choice) -> Choice:
    """Return the choice for one of several recordings: it is for files if there are any."""
    return ALL if name in EMBEDDED and not {*names} <= {*EMBEDDED} else choice


def load_track(name_or_path: str, choice: Choice = ALL) -> Track:
    """Load a shipped recording by name, or a file by path.

    Args:
        name_or_path: a name of ``EMBEDDED``, figures in a ``.toml`` (``RecordingConfig``), or a
            file in a format of ``formats.KNOWN``.
        choice: facts that the file may not state, and parts of it.

    Raises:
        InputError: neither name nor file, an unknown format, or a fault inside it.

    """
    path = Path(name_or_path)
    if name_or_path in EMBEDDED or path.suffix == ".toml":
        choice.only(path, "a shipped recording")
        if choice.rate or choice.min_score:
            raise InputError(
                f"{name_or_path}: its figures hold the frame rate, and no scores; give --rate and "
                "--min-score for files"
            )
    if name_or_path in EMBEDDED:
        return embedded(name_or_path)
    if not path.exists():
        raise InputError(
            f"{name_or_path}: no such recording or file{file_hint(path)}; shipped are "
            f"{', '.join(EMBEDDED)}; a file may be {KNOWN}"
        )
    if path.suffix == ".toml":
        return generate(load(path, RecordingConfig))
    return load_file(path, choice)


def load_file(path: str | Path, choice: Choice = ALL) -> Track:
    """Load a recording from a file, whose content decides its format.

    Args:
        path: of the file.
        choice: facts that the file may not state, and parts of it.

    Raises:
        InputError: no such file, an unknown format, or a fault inside it.

    """
    file = Path(path)

    def read(choice: Choice) -> Track:
        loaded = _loaded_recording(file, choice)
        if isinstance(loaded, Track):
            return loaded
        track = loaded.track(choice)
        return replace(track, facts=loaded.facts)

    return answered(file, choice, read)


def _facts(file: Path, kind: Format, loaded: Track | Keypoints, choice: Choice) -> Facts:
    """Facts about a recording: by the user, by its format, or inferred."""
    its_format = f"its format, {ending(file)[1:] or kind}"
    if isinstance(loaded, Keypoints):
        length, rate_hz = loaded.scale_m, loaded.rate_hz
        order = Fact("head first", "inferred", "the order of its names, which lie along a body")
    else:
        length, rate_hz = loaded.length_m, None if loaded.rate_assumed else loaded.rate_hz
        order = Fact("head first", "file", its_format)
    if choice.keypoints:
        order = Fact("head first", "user", "--keypoints")
    unit = Fact("m", "file", its_format)
    if length is None:
        unit = Fact("body lengths", "inferred", "the file states no length")
    rate = f"{rate_hz or KEYPOINT_RATE_HZ:g} Hz"
    time = Fact(rate, "file", its_format)
    if choice.rate or choice.time_unit:
        time = Fact(rate, "user", "--rate" if choice.rate else "--time-unit")
    elif rate_hz is None:
        time = Fact(rate, "inferred", "the default of its format; --rate states another")
    elif kind == "csv" and isinstance(loaded, Track):
        time = Fact(rate, "inferred", "no other unit is possible; --time-unit states another")
    return {
        "quantity": Fact("bodies of an animal", "file", its_format),
        "unit": unit,
        "order": order,
        "time": time,
        **loaded.facts,
    }


def load_keypoints(path: str | Path, choice: Choice = ALL) -> Keypoints:
    """Load all keypoints of one animal, including those off its midline; see ``load_file``.

    Raises:
        InputError: as ``load_file``, or the file holds midlines.

    """
    file = Path(path)

    def read(choice: Choice) -> Keypoints:
        loaded = _loaded_recording(file, choice)
        if isinstance(loaded, Keypoints):
            return loaded
        raise InputError(
            f"{path}: holds midlines; expected named keypoints: SLEAP, DeepLabCut, QTM, Vicon, TRC "
            "or C3D"
        )

    return answered(file, choice, read)


def _loaded_recording(file: Path, choice: Choice) -> Track | Keypoints:
    kind = _format(file)
    loaded = _read(file, kind, choice)
    if isinstance(loaded, Keypoints):
        least_score = loaded.least_score if choice.min_score is None else choice.min_score
        loaded = replace(loaded, rate_hz=choice.rate or loaded.rate_hz, least_score=least_score)
    return replace(loaded, facts=_facts(file, kind, loaded, choice))


def _read(file: Path, kind: Format, choice: Choice) -> Track | Keypoints:
    if kind in _MARKERS:
        return _MARKERS[kind](file, choice)
    match kind:
        case "zip":
            text = zipped_text(file)
            if text is not None:
                return load_wcon(file, text, choice)
            choice.only(file, "an .npz")
            return load_npz(file, choice)
        case "npy":
            choice.only(file, "an .npy")
            return load_npy(file, choice)
        case "hdf5":
            require_extra(f"{file}: HDF5 needs", "h5py")
            from snakewalk.controller.track.readers.hdf5 import load_hdf5  # noqa: PLC0415  an extra

            return load_hdf5(file, choice)
        case "mat":
            choice.only(file, "a MATLAB file")
            return load_mat(file, choice)
        case "json":
            return load_wcon(file, _json(file), choice)
        case "csv":
            return load_csv(file, choice)
    reason = "is empty" if kind == "empty" else "is no recording"
    raise InputError(f"{file}: {reason}; known: {KNOWN}")


_MARKERS: dict[str, Callable[[Path, Choice], Track | Keypoints]] = {
    "qtm": load_qtm,
    "bvh": load_bvh,
    "trc": load_trc,
    "c3d": load_c3d,
}
"""Readers of motion capture."""


def _format(file: Path) -> Format:
    try:
        head = read_head(file, HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}") from None
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{file}: is in UTF-16; save it in UTF-8")
    return format_of(head)


def _json(file: Path) -> str:
    try:
        return read_text(file)
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no JSON in UTF-8; known: {KNOWN}") from None


def track_beside(name_or_path: str, folder: Path | None) -> str:
    """Path of a recording named in a file in ``folder``: relative to it if it exists there."""
    if folder is None or name_or_path in EMBEDDED or not (folder / name_or_path).is_file():
        return name_or_path
    return str(folder / name_or_path)
