"""Shell completion: shipped names, a user's files, and the words of a choice.

Each function maps the typed text to its completions. Without completions, the shell completes
files.
"""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

Complete = Callable[[str], list[str]]


def names(*kinds: str, files: tuple[str, ...] = (".toml",)) -> Complete:
    """Completion of shipped names of ``kinds``, and of files with these endings.

    ``kinds`` are folders of shipped configurations, ``all gaits`` or ``spine gaits``.
    """

    def complete(incomplete: str) -> list[str]:
        shipped_names = [
            name for kind in kinds for name in _shipped_names(kind) if name.startswith(incomplete)
        ]
        return [*shipped_names, *_files(incomplete, files)]

    return complete


def words(*choices: str) -> Complete:
    """Completion of fixed words."""
    return lambda incomplete: [word for word in choices if word.startswith(incomplete)]


def keys(incomplete: str) -> list[str]:
    """Keys of ``--set``, each with ``=``; ``run``, ``robot`` and ``world`` name the file."""
    return [f"{key}=" for key in _loader().known_keys() if key.startswith(incomplete)]


def _shipped_names(kind: str) -> list[str]:
    if kind in ("all gaits", "spine gaits"):
        from snakewalk.controller.gaits import registry  # noqa: PLC0415  --help does not need it

        return list(registry.GAITS if kind == "all gaits" else registry.SPINE_GAITS)
    return list(_loader().shipped(kind))


def _loader() -> ModuleType:
    from snakewalk.config import loader  # noqa: PLC0415  --help does not need it

    return loader


def _files(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    folder, slash, start = incomplete.rpartition("/")
    place = Path(f"{folder}{slash}") if slash else Path()
    if not place.is_dir():
        return []
    return sorted(
        f"{folder}{slash}{path.name}"
        for path in place.iterdir()
        if path.name.startswith(start) and path.suffix in endings and path.is_file()
    )


RUNS = names("runs")
ROBOTS = names("robots")
WORLDS = names("worlds")
GAITS = names("all gaits", "gaits")
RUNS_OR_GAITS = names("runs", "all gaits", "gaits")
RECORDINGS = names("recordings", files=(".csv", ".npz", ".wcon", ".h5", ".toml"))
ANIMALS = names("animals")
POLICIES = names("policies")
POLICIES_OR_GAITS = names("policies", "all gaits", "gaits")
BODIES = names("recordings", "skins", files=(".npz", ".obj", ".glb"))
MOVING = names("recordings", "spine gaits", files=(".mcap", ".npz", ".csv"))
MOTIONS = words("walk", "walk-printed", "walk-blind", "serpenoid")
LOOKS = words("servos", "animal")
