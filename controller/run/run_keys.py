"""Single values of a run's files, replaced by key: ``--set`` and ``keys``."""

import math
from collections.abc import Mapping
from difflib import get_close_matches
from typing import TypeVar

from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.errors import InputError
from snakewalk.config.loader import with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig

C = TypeVar("C", RunConfig, RobotConfig, WorldConfig)
_FIELDS = {
    "run": tuple(RunConfig.model_fields),
    "robot": tuple(RobotConfig.model_fields),
    "world": tuple(WorldConfig.model_fields),
}
"""Keys and tables at the top of each file."""


_OWN_MOTION = {"run.robot": "--robot", "run.motion": "the command"}
OF_A_SOURCE = _OWN_MOTION | {"run.time_limit_s": "--seconds"}
OF_A_GAIT = _OWN_MOTION | {
    "run.gait.name": "the command",
    "run.gait.parameters": "--param",
    "run.gait.duration_s": "--seconds",
    "run.gait.then": "--then",
}
OF_A_SCHEDULE = _OWN_MOTION | {"run.repertoire": "FILE, --speed, --turn, --schedule, --seconds"}
OF_A_RECORDING = _OWN_MOTION | {
    "run.track": "TRACK",
    "run.playback": "--speed, --scale, --clip",
}
"""Keys that a command's own options set, with these options."""


def checked_keys(
    keys: Mapping[str, object] | None, refused: Mapping[str, str] | None = None
) -> dict[str, object]:
    """Return keys of the three files, angles in rad; options set those in ``refused``.

    Raises:
        InputError: no file has a key, or it is refused; one line each.

    """
    faults: list[str] = []
    for key in keys or {}:
        file, dot, rest = key.partition(".")
        if file not in _FIELDS or not (dot and all(rest.split("."))):
            faults.append(f"{key}: a key begins with run., robot. or world.{_key_hint(file, rest)}")
        for refused_key, option in (refused or {}).items():
            if f"{key}.".startswith(f"{refused_key}.") or (
                dot and refused_key.startswith(f"{key}.")
            ):
                faults.append(f"{key}: is given by {option}")
    if faults:
        raise InputError(faults)
    return dict(_key_in_rad(key, value) for key, value in (keys or {}).items())


def _key_hint(first: str, rest: str) -> str:
    """Hint on a key whose first word names no file."""
    files = get_close_matches(first, _FIELDS, 1, 0.7)
    if files and rest:
        return f"; did you mean {files[0]}.{rest}?"
    for file, fields in _FIELDS.items():
        for near in get_close_matches(first, fields, 1, 0.7):
            return f"; did you mean {'.'.join(filter(None, (file, near, rest)))}?"
    return ""


def _key_in_rad(key: str, value: object) -> tuple[str, object]:
    if not key.endswith("_deg"):
        return key, value
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = math.radians(value)
    return f"{key.removesuffix('_deg')}_rad", value


def with_keys_of(file: str, config: C, keys: Mapping[str, object]) -> C:
    """Replace values of a run's, robot's or world's file by their keys.

    Raises:
        InputError: one line per fault.

    """
    file_keys = {k.removeprefix(f"{file}."): v for k, v in keys.items() if k.startswith(f"{file}.")}
    return with_keys(config, file_keys, f"{file} {config.name}") if file_keys else config


def with_compliance(run: RunConfig, on: bool | None) -> RunConfig:
    """Return a run whose joints yield or not; None leaves the run's setting."""
    if on is None:
        return run
    table = (run.compliance or ComplianceConfig()) if on else None
    return run.model_copy(update={"compliance": table})
