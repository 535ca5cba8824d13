"""Order and subjects of the command line's first level, and the former names of commands."""

from collections.abc import Collection, Sequence
from difflib import get_close_matches
from typing import Final

EVERY_DAY: Final = "Every day"
SUBJECTS: Final = "By subject"
OTHERS: Final = "Other packages"
"""Groups of ``snakewalk --help``; a command of another package may name its own."""
VERBS: Final = ("init", "list", "plan", "run", "play", "stop", "view", "doctor", "trials")
"""First words of the group ``EVERY_DAY``, in their order."""
FAMILIES: Final = {
    "trials": "Many runs",
    "gait": "Gaits",
    "gait policy": "Learnt policies",
    "gait repertoire": "Actions recorded from the physics",
    "log": "The log of a run",
    "bus": "Servos and their settings",
    "robot": "A robot",
    "world": "Worlds from real ground",
    "animal": "Animals from video",
    "animal fish": "Fish from video",
    "pose": "Poses by camera or port",
    "ros": "",
    "tools": "Tools",
}
"""Subject of commands that begin with the same words; ``ros`` is one command."""
FORMER: Final = {
    "trials": "trials run",
    "rehearse": "trials rehearse",
    "tasks": "trials tasks",
    "policy trials": "trials policy",
    "policy": "gait policy",
    "repertoire": "gait repertoire",
    "sweep": "gait sweep",
    "tune": "gait tune",
    "report": "log report",
    "export": "log export",
    "compare": "log compare",
    "replay": "log replay",
    "shadow": "log shadow",
    "judge": "log judge",
    "scan": "bus scan",
    "calibrate": "bus calibrate",
    "bus identify": "bus inventory",
    "identify": "robot identify",
    "terrain from-stereo": "world stereo",
    "terrain": "world",
    "camera board": "pose board",
    "camera calibrate": "pose calibrate",
    "camera check": "pose camera",
    "camera markers": "pose markers",
    "camera": "pose",
    "capture": "animal capture",
    "track": "animal track",
    "analyse": "animal analyse",
    "stride": "animal stride",
    "body": "animal body",
    "synthesise": "animal synthesise",
    "people": "animal people",
    "fish": "animal fish",
    "walk": "animal graph",
    "compile": "tools compile",
    "schema": "tools schema",
}
"""Current words by former words, of commands and of families."""


def former_name(words: Sequence[str], names: Collection[str]) -> tuple[str, str] | None:
    """Return the former name with which the words begin, and the current one.

    Args:
        words: the words of a command line behind ``snakewalk``.
        names: the names of all commands. A former name has no effect if one of them begins with it,
            or if none begins with the current one.

    """
    for count in (2, 1):
        old = " ".join(words[:count])
        new = FORMER.get(old, "")
        if not new or not _below(new, names):
            continue
        kinds = _below(old, names)
        if not kinds or (new.startswith(f"{old} ") and _is_argument(words[count:], kinds)):
            return old, new
    return None


def _below(words: str, names: Collection[str]) -> list[str]:
    """Return the words that follow, an empty one for a command of this name."""
    return [
        f"{name} ".removeprefix(f"{words} ") for name in names if f"{name} ".startswith(f"{words} ")
    ]


def _is_argument(rest: Sequence[str], kinds: Sequence[str]) -> bool:
    """Whether words follow that are neither a request for help nor, with an error, a kind."""
    kind_names = [kind.split()[0] for kind in kinds]
    return (
        bool(rest)
        and rest[0] not in ("-h", "--help")
        and not get_close_matches(rest[0], kind_names)
    )
