"""Configurations by shipped name or path: robots, worlds, runs, gaits."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel

from snakewalk.config import strict_toml
from snakewalk.config.archive import read_text, why_no_file
from snakewalk.config.errors import ConfigError
from snakewalk.config.gait import GaitSetConfig
from snakewalk.config.strict_toml import read_toml

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig
    from snakewalk.config.run import RunConfig
    from snakewalk.config.servo_model import ServoModel
    from snakewalk.config.world import WorldConfig

M = TypeVar("M", bound=BaseModel)
Kind = Literal[
    "robots",
    "worlds",
    "runs",
    "recordings",
    "gaits",
    "skins",
    "animals",
    "policies",
    "measurements",
]

_ONE_OF = {"policies": "policy"}
"""Singulars of the kinds of files that do not end in s."""


def shipped(kind: Kind) -> tuple[str, ...]:
    """Sorted names of the shipped configurations of a kind."""
    return tuple(sorted(p.name[:-5] for p in _folder(kind).iterdir() if p.name.endswith(".toml")))


def locate(kind: Kind, name_or_path: str, folder: Path | None = None) -> Path:
    """Path of a shipped name or of a ``.toml`` file (relative to ``folder`` if given)."""
    if not name_or_path.endswith(".toml"):
        path = _folder(kind) / f"{name_or_path}.toml"
        if path.is_file():
            return path
        raise ConfigError(
            f"{name_or_path}: no such {_ONE_OF.get(kind, kind[:-1])}; "
            f"shipped are {', '.join(shipped(kind))}; a file of your own ends in .toml"
        )
    path = Path(name_or_path)
    if folder is not None and not path.is_absolute() and (folder / path).is_file():
        path = folder / path
    if not path.is_file():
        raise ConfigError(why_no_file(path))
    return path


def load(path: Path, model: type[M]) -> M:
    """Read one TOML file into ``model``.

    Raises:
        ConfigError: missing file, broken TOML, or all schema faults, one line each.

    """
    data, text = read_toml(path)
    return checked(model, data, str(path), text)


def checked(model: type[M], data: dict[str, Any], source: str, text: str = "") -> M:
    """Validate ``data``; each fault begins with ``source`` and the line in ``text``.

    A value of another type is a fault: text is not a number, and true is not 1.

    Raises:
        ConfigError: all schema faults, one line each.

    """
    return strict_toml.checked(model, data, source, text, _files)


def place_of(path: Path, key: str) -> str:
    """File, line and name of a key, to begin a message."""
    number = strict_toml.line_number(read_text(path), key.split("."))
    return f"{path}: {key}" if number is None else f"{path}:{number}: {key}"


def with_keys(config: M, keys: Mapping[str, object], source: str) -> M:
    """Return ``config`` with the values of dotted ``keys`` replaced, as strictly as a file.

    Raises:
        ConfigError: all unknown keys and values out of range, one line each.

    """
    data = config.model_dump()
    for key, value in keys.items():
        *tables, last = key.split(".")
        table = data
        for name in tables:
            if table.get(name) is None:  # a missing or unknown table: the schema reports it
                table[name] = {}
            if not isinstance(table[name], dict):
                raise ConfigError(
                    f"{source}: {key}: {name} is not a table; remove the key or correct it"
                )
            table = table[name]
        table[last] = value
    if "servo" in data:
        data = with_models(data, None)
    return checked(type(config), data, source)


def load_robot(name_or_path: str, folder: Path | None = None) -> "RobotConfig":
    """Load a robot by shipped name or path."""
    path = locate("robots", name_or_path, folder)
    data, text = read_toml(path)
    return checked(_schemas().robot, with_models(data, path.parent), str(path), text)


def with_models(data: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """Data of a robot with the records of models that its file describes by files.

    A `model` may name a file, or a model of the folder `servos` next to the robot's file. Its name
    replaces it, and its record goes into `described_models`, so that a log is complete.

    Raises:
        ConfigError: the faults of such a file.

    """
    records: dict[str, BaseModel] = {}

    def named(table: object) -> object:
        model = table.get("model") if isinstance(table, dict) else None
        record = _schemas().described_model(model, folder) if isinstance(model, str) else None
        if record is None or not isinstance(table, dict):
            return table
        records[record.model] = record
        return {**table, "model": record.model}

    servo = named(data.get("servo"))
    joints = data.get("joints")
    joints = [named(joint) for joint in joints] if isinstance(joints, list | tuple) else joints
    if not records:
        return data
    described_models = [
        described_model
        for described_model in data.get("described_models", ())
        if described_model.get("model") not in records
    ]
    more = {
        "described_models": [
            *described_models,
            *(record.model_dump() for record in records.values()),
        ]
    }
    given = {"servo": servo, "joints": joints}
    return data | {key: value for key, value in given.items() if value is not None} | more


def load_world(name_or_path: str, folder: Path | None = None) -> "WorldConfig":
    """Load a world by shipped name or path; searches its ground's file in the world's folder.

    Raises:
        ConfigError: no such file, world or ground, or each fault of it.

    """
    path = locate("worlds", name_or_path, folder)
    world = load(path, _schemas().world)
    named: str | None = getattr(world.ground, "source", None)
    if named is not None:
        source = (path.parent / named).absolute()  # a log names it to other folders
        if source.is_file():
            ground = world.ground.model_copy(update={"source": str(source)})
            return world.model_copy(update={"ground": ground})
        if named.endswith(".npz") and not Path(named).is_file():
            raise ConfigError(
                f"{path}: ground.source: {named}: no such file in the folder of "
                f"{path} or in the working folder; correct the path"
            )
    return world


def load_run(name_or_path: str) -> "RunConfig":
    """Load a run by shipped name or path."""
    return load(locate("runs", name_or_path), _schemas().run)


def load_gait(name_or_path: str) -> GaitSetConfig:
    """Load a set of gait parameters by shipped name or path."""
    return load(locate("gaits", name_or_path), GaitSetConfig)


def known_keys() -> list[str]:
    """Dotted keys of a run, a robot and a world, after the name of their file."""
    keys = [key for name, model in _files().items() for key in _dotted_keys(name, model)]
    return list(dict.fromkeys(keys))


def digest(*models: BaseModel) -> str:
    """Configuration hash: SHA-256 (16 hex digits) of the models' canonical JSON."""
    text = "\n".join(model.model_dump_json() for model in models)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _folder(kind: Kind) -> Path:
    return Path(__file__).parent / kind


@dataclass(frozen=True)
class _Schemas:
    """Schemas of the three files of a run, and the reader of a servo model's file."""

    run: "type[RunConfig]"
    robot: "type[RobotConfig]"
    world: "type[WorldConfig]"
    described_model: "Callable[[str, Path | None], ServoModel | None]"


@cache
def _schemas() -> _Schemas:
    """Import the schemas; a list of gaits needs none."""
    from snakewalk.config import robot, run, servo_catalogue, world  # noqa: PLC0415  slow to build

    return _Schemas(
        run.RunConfig, robot.RobotConfig, world.WorldConfig, servo_catalogue.described_model
    )


def _files() -> dict[str, type[BaseModel]]:
    """Schemas of the three files of a run, by name."""
    schemas = _schemas()
    return {"run": schemas.run, "robot": schemas.robot, "world": schemas.world}


def _dotted_keys(path: str, kind: Any) -> Iterator[str]:
    """Dotted keys of a table and of its single-valued tables, after ``path``."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            below = list(_dotted_keys(f"{path}.{name}", field.annotation))
            yield from below or [f"{path}.{name}"]
    elif get_origin(kind) not in {list, tuple, dict}:
        for part in get_args(kind):
            yield from _dotted_keys(path, part)
