"""TOML to schema, strictly: every fault of a file at once, each with its path inside the file."""

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ValidationError

from snakewalk.config.errors import ConfigError
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig

M = TypeVar("M", bound=BaseModel)
Kind = Literal["robots", "worlds", "runs", "recordings", "gaits"]


def shipped(kind: Kind) -> tuple[str, ...]:
    """Names of the shipped configurations of a kind, sorted."""
    return tuple(sorted(p.name[:-5] for p in _folder(kind).iterdir() if p.name.endswith(".toml")))


def locate(kind: Kind, name_or_path: str, beside: Path | None = None) -> Path:
    """Path of a shipped name or of a ``.toml`` file (relative to ``beside`` if given)."""
    if not name_or_path.endswith(".toml"):
        path = _folder(kind) / f"{name_or_path}.toml"
        if path.is_file():
            return path
        raise ConfigError(
            f"{name_or_path}: no such {kind[:-1]}; shipped are {', '.join(shipped(kind))}; "
            "a file of your own ends in .toml"
        )
    path = Path(name_or_path)
    if beside is not None and not path.is_absolute() and (beside / path).is_file():
        path = beside / path
    if not path.is_file():
        raise ConfigError(f"{path}: no such file")
    return path


def load(path: Path, model: type[M]) -> M:
    """Read one TOML file into ``model``.

    Raises:
        ConfigError: missing file, broken TOML, or schema faults, all of them, one line each.

    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None
    return checked(model, data, str(path))


def checked(model: type[M], data: dict[str, Any], source: str) -> M:
    """Validate ``data``; ``source`` leads each line of the faults.

    Raises:
        ConfigError: schema faults, all of them, one line each.

    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise ConfigError([_line(source, dict(fault)) for fault in error.errors()]) from None


def with_keys(config: M, keys: Mapping[str, object], source: str) -> M:
    """Return ``config`` with the values of dotted ``keys`` replaced, as strict as a file.

    Raises:
        ConfigError: unknown keys and values out of range, all of them, one line each.

    """
    data = config.model_dump()
    for key, value in keys.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            if not isinstance(table.get(name), dict):
                raise ConfigError(f"{source}: {key}: {name} is no table of it")
            table = table[name]
        table[last] = value
    return checked(type(config), data, source)


def load_robot(name_or_path: str, beside: Path | None = None) -> RobotConfig:
    """Load a robot by shipped name or path."""
    return load(locate("robots", name_or_path, beside), RobotConfig)


def load_world(name_or_path: str, beside: Path | None = None) -> WorldConfig:
    """Load a world by shipped name or path."""
    return load(locate("worlds", name_or_path, beside), WorldConfig)


def load_run(name_or_path: str) -> RunConfig:
    """Load a run by shipped name or path."""
    return load(locate("runs", name_or_path), RunConfig)


def load_gait(name_or_path: str) -> GaitSetConfig:
    """Load a set of gait parameters by shipped name or path."""
    return load(locate("gaits", name_or_path), GaitSetConfig)


def digest(*models: BaseModel) -> str:
    """SHA-256 (16 hex digits) over the canonical JSON of the models: the configuration hash."""
    text = "\n".join(model.model_dump_json() for model in models)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _folder(kind: Kind) -> Path:
    return Path(__file__).parent / kind


def _line(path: str, fault: dict[str, Any]) -> str:
    loc = fault["loc"]
    where = ".".join(str(p) for p in loc) if isinstance(loc, tuple) else str(loc)
    given = fault.get("input")
    shown = f" (got {given!r})" if isinstance(given, int | float | str | bool) else ""
    said = {"extra_forbidden": "unknown key", "missing": "is required"}
    text = said.get(str(fault["type"]), str(fault["msg"]).removeprefix("Value error, "))
    return f"{path}: {where}: {text}{shown}" if where else f"{path}: {text}{shown}"
