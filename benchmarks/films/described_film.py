"""The TOML file that describes a film: source, licence, options of ``capture``, truth.

``film`` names a video or a folder of images, relative to the folder of films or to the TOML file.
``[[animals]]`` have ``marks``: rows of frame, x and y between the eyes (or of the tip of the head),
x and y of the tip of the tail. ``lines`` names an .npz whose array ``key`` (T, P, 2) has a midline
for each frame, head first; ``lines_end_early`` if they end before the tips. ``length_px`` is the
length of the animal.
"""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.track.resample import equal_arc_length

SHIPPED = Path(__file__).parent
_VIDEOS = {".mp4", ".avi", ".mov", ".mkv", ".tif", ".tiff"}
_KEYS = {"film", "source", "licence", "options", "animals", "length_px", "notes"}
_KEYS |= {"lines", "key", "lines_end_early"}


@dataclass(frozen=True, slots=True)
class Marks:
    """The ends of one animal in some frames."""

    name: str
    ends_px: dict[int, Floats]
    """By frame: (2, 2) x, y of the point at the head and of the tip of the tail."""


@dataclass(frozen=True, slots=True)
class DescribedFilm:
    """A film and what is known of it."""

    path: Path
    source: str = "not stated"
    licence: str = "not stated"
    options: tuple[str, ...] = ()
    animals: tuple[Marks, ...] = ()
    lines_px: dict[int, Floats] = field(default_factory=dict)
    """By frame: (101, 2) the midline, head first."""
    lines_end_early: bool = False
    """Whether the midlines end before the tips: only stations that they cover are compared."""
    length_px: float | None = None

    @classmethod
    def read(cls, toml: Path, folder: Path) -> "DescribedFilm | None":
        """Read a description; None if its film is not in the folder.

        Raises:
            InputError: a file that does not describe a film.

        """
        try:
            given = tomllib.loads(toml.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise InputError(f"{toml}: {error}; correct the file") from None
        unknown = sorted(set(given) - _KEYS)
        if "film" not in given or unknown:
            wrong = f"unknown keys {', '.join(unknown)}" if unknown else "no key `film`"
            raise InputError(f"{toml}: {wrong}; use {', '.join(sorted(_KEYS))}")
        path = _within(given["film"], toml.parent, folder)
        if path is None:
            return None
        lines: dict[int, Floats] = {}
        if "lines" in given:
            archive = _within(given["lines"], toml.parent, folder)
            if archive is None:
                raise InputError(f"{toml}: {given['lines']} does not exist; correct `lines`")
            with np.load(archive) as held:
                every = np.asarray(held[given.get("key", "midlines")], dtype=float)
            lines = {
                k: equal_arc_length(one) for k, one in enumerate(every) if np.isfinite(one).all()
            }
        animals = tuple(
            Marks(one["name"], {int(k): np.reshape(ends, (2, 2)) for k, *ends in one["marks"]})
            for one in given.get("animals", [])
        )
        return cls(
            path,
            given.get("source", "not stated"),
            given.get("licence", "not stated"),
            tuple(given.get("options", ())),
            animals,
            lines,
            given.get("lines_end_early", False),
            given.get("length_px"),
        )


def films_of(folder: Path) -> list[DescribedFilm]:
    """All films of a folder: those with a description in it or in this package, and all videos."""
    found: dict[Path, DescribedFilm] = {}
    for toml in [*sorted(SHIPPED.glob("*.toml")), *sorted(folder.rglob("*.toml"))]:
        one = DescribedFilm.read(toml, folder)
        if one is not None:
            found[one.path] = one
    for path in _videos(folder):
        found.setdefault(path, DescribedFilm(path))
    return [found[path] for path in sorted(found)]


def _videos(folder: Path) -> Iterator[Path]:
    return (one.resolve() for one in folder.rglob("*") if one.suffix.lower() in _VIDEOS)


def _within(name: str, beside: Path, folder: Path) -> Path | None:
    """The file or folder of that name next to the description or in the folder of films."""
    for place in (beside / name, folder / name):
        if place.exists():
            return place.resolve()
    return None
