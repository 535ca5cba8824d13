"""TOML to schema, strictly: every fault of a file at once, each with its path inside the file."""

import hashlib
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticSerializationError, to_json

from snakewalk.config.archive import read_text, why_no_file
from snakewalk.config.errors import ConfigError
from snakewalk.config.gait import GaitSetConfig

if TYPE_CHECKING:
    from snakewalk.config.robot import RobotConfig
    from snakewalk.config.run import RunConfig
    from snakewalk.config.world import WorldConfig

M = TypeVar("M", bound=BaseModel)
Kind = Literal["robots", "worlds", "runs", "recordings", "gaits", "skins", "animals", "policies"]

_ONE_OF: Final = {"policies": "policy"}
"""Kinds whose singular is not the word without its s."""


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
            f"{name_or_path}: no such {_ONE_OF.get(kind, kind[:-1])}; "
            f"shipped are {', '.join(shipped(kind))}; a file of your own ends in .toml"
        )
    path = Path(name_or_path)
    if beside is not None and not path.is_absolute() and (beside / path).is_file():
        path = beside / path
    if not path.is_file():
        raise ConfigError(why_no_file(path))
    return path


def load(path: Path, model: type[M]) -> M:
    """Read one TOML file into ``model``.

    Raises:
        ConfigError: missing file, broken TOML, or schema faults, all of them, one line each.

    """
    try:
        text = read_text(path, _MOST_BYTES)
        _check_keys(text)
        data = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}") from None
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        where = f"{path}:{place[1]}" if place else str(path)
        raise ConfigError(f"{where}: not TOML: {_PLACE.sub('', str(error))}") from None
    except RecursionError:
        raise ConfigError(f"{path}: not TOML: nested too deeply") from None
    except ValueError as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None
    return checked(model, data, str(path), text)


def checked(model: type[M], data: dict[str, Any], source: str, text: str = "") -> M:
    """Validate ``data``; ``source`` leads each line of the faults, with the line in ``text``.

    A value of another type is a fault: text is no number, and true is not 1.

    Raises:
        ConfigError: schema faults, all of them, one line each.

    """
    try:
        plain = to_json(data, inf_nan_mode="constants", fallback=_plain)
        return model.model_validate_json(plain, strict=True)
    except PydanticSerializationError as error:
        raise ConfigError(f"{source}: {error}") from None
    except ValidationError as error:
        raise ConfigError(
            [_line(model, source, text, dict(fault)) for fault in error.errors()]
        ) from None


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
            if table.get(name) is None:  # a table left out, or an unknown one: the schema says
                table[name] = {}
            if not isinstance(table[name], dict):
                raise ConfigError(f"{source}: {key}: {name} is no table of it")
            table = table[name]
        table[last] = value
    return checked(type(config), data, source)


def load_robot(name_or_path: str, beside: Path | None = None) -> "RobotConfig":
    """Load a robot by shipped name or path."""
    from snakewalk.config.robot import RobotConfig  # noqa: PLC0415  slow to build; a list of gaits needs none

    return load(locate("robots", name_or_path, beside), RobotConfig)


def load_world(name_or_path: str, beside: Path | None = None) -> "WorldConfig":
    """Load a world by shipped name or path; its ground's file is looked for beside it.

    Raises:
        ConfigError: no such file, world or ground; each fault of it.

    """
    from snakewalk.config.world import ElevationGround, MapGround, WorldConfig  # noqa: PLC0415  slow to build

    path = locate("worlds", name_or_path, beside)
    world = load(path, WorldConfig)
    if isinstance(world.ground, ElevationGround | MapGround):
        named = world.ground.source
        source = (path.parent / named).absolute()  # a log names it to other folders
        if source.is_file():
            ground = world.ground.model_copy(update={"source": str(source)})
            return world.model_copy(update={"ground": ground})
        if named.endswith(".npz") and not Path(named).is_file():
            raise ConfigError(f"{path}: ground.source: {named}: no such file beside it, nor here")
    return world


def load_run(name_or_path: str) -> "RunConfig":
    """Load a run by shipped name or path."""
    from snakewalk.config.run import RunConfig  # noqa: PLC0415  slow to build

    return load(locate("runs", name_or_path), RunConfig)


def load_gait(name_or_path: str) -> GaitSetConfig:
    """Load a set of gait parameters by shipped name or path."""
    return load(locate("gaits", name_or_path), GaitSetConfig)


def known_keys() -> list[str]:
    """Keys of a run, a robot and a world, dotted behind the name of their file."""
    found = [key for name, model in _files().items() for key in _dotted(name, model)]
    return list(dict.fromkeys(found))


def digest(*models: BaseModel) -> str:
    """SHA-256 (16 hex digits) over the canonical JSON of the models: the configuration hash."""
    text = "\n".join(model.model_dump_json() for model in models)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    """Return numbers of numpy, or arrays of them, as Python's own.

    Raises:
        TypeError: it is something else.

    """
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no value of a configuration")


def _check_keys(text: str) -> None:
    """Refuse keys of hundreds of tables, for which ``tomllib`` takes minutes.

    Raises:
        ValueError: there is one.

    """
    for number, line in enumerate(text.splitlines(), start=1):
        if line.count(".") > _MOST_TABLES and any(
            key.count(".") > _MOST_TABLES for key in _NO_KEY.split(line)
        ):
            raise ValueError(f"a key of over {_MOST_TABLES} tables in line {number}")


def _folder(kind: Kind) -> Path:
    return Path(__file__).parent / kind


_MOST_BYTES: Final = 4_000_000
_MOST_TABLES: Final = 100
"""Of a TOML file, and of a dotted key in it (ours)."""
_NO_KEY: Final = re.compile(r"[^\w.\s\"'-]+")
_PLACE: Final = re.compile(r" ?\(at line (\d+), column \d+\)")
_TABLE: Final = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY: Final = re.compile(r"""^\s*([\w."' -]+?)\s*=""")


def _line_number(text: str, loc: Sequence[str | int]) -> int | None:
    """Line on which a TOML text sets the innermost key of ``loc`` that it has; None if none."""
    wanted = [str(part) for part in loc if isinstance(part, str)]
    places = [part for part in loc if isinstance(part, int)]
    table: list[str] = []
    seen: Counter[str] = Counter()
    found, depth, here = None, 0, True
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _TABLE.match(line):
            keys = table = _parts(header[2])
            here = header[1] == "[" or places[:1] == [seen[header[2]]]
            seen[header[2]] += 1
        elif key := _KEY.match(line):
            keys = table + _parts(key[1])
        else:
            continue
        rest = iter(wanted)
        if here and len(keys) > depth and all(part in rest for part in keys):
            found, depth = number, len(keys)
    return found


def _parts(key: str) -> list[str]:
    return [part.strip(" \"'") for part in key.split(".")]


def _files() -> dict[str, type[BaseModel]]:
    """Schemas of the three files of a run, by their names."""
    from snakewalk.config import robot, run, world  # noqa: PLC0415  slow to build

    return {"run": run.RunConfig, "robot": robot.RobotConfig, "world": world.WorldConfig}


def _keys(kind: Any) -> Iterator[str]:
    """Keys of a schema and of all tables in it."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            yield name
            yield from _keys(field.annotation)
    else:
        for part in get_args(kind):
            yield from _keys(part)


def _dotted(path: str, kind: Any) -> Iterator[str]:
    """Keys of a table and of the tables in it that hold a single value, dotted behind ``path``."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            below = list(_dotted(f"{path}.{name}", field.annotation))
            yield from below or [f"{path}.{name}"]
    elif get_origin(kind) not in {list, tuple, dict}:
        for part in get_args(kind):
            yield from _dotted(path, part)


def _meant(model: type[BaseModel], key: str) -> str:
    """The key of the schema that an unknown one is like, or the file that has such a key."""
    near = get_close_matches(key, set(_keys(model)) - {key}, 1, 0.78)
    if near:
        return f"; did you mean {near[0]}?"
    owner = next((n for n, m in _files().items() if m is not model and key in m.model_fields), None)
    return "" if owner is None else f"; it is a key of a {owner}'s file"


def _pattern_in_words(pattern: str) -> str:
    letters = re.fullmatch(r"\^\[(\w+)\](?:\*|\{(\d+),(\d+)\})\$", pattern)
    if letters is None:
        return "holds '/', a control character or a leading dot"
    which, least, most = letters.groups()
    return f"must have the letters {' and '.join(which)} only" + (
        f", {least} to {most} of them" if least else ""
    )


def _line(model: type[BaseModel], path: str, text: str, fault: dict[str, Any]) -> str:
    loc = fault["loc"]
    where = ".".join(str(p) for p in loc)
    number = _line_number(text, loc)
    if number is not None:
        path = f"{path}:{number}"
    given = fault.get("input")
    shown = f" (got {given!r})" if isinstance(given, int | float | str | bool) else ""
    context = fault.get("ctx", {})
    bounds = {key: context[key] for key in ("gt", "ge", "lt", "le") if key in context}
    tag, known = context.get("tag"), context.get("expected_tags")
    said = {
        "missing": "is required",
        "tuple_type": "must be a list: [ ... ]",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "dict_type": "must be a table",
        "string_type": "must be text",
        "int_type": "must be a whole number",
        "int_from_float": "must be a whole number",
        "float_type": "must be a number",
        "bool_type": "must be true or false",
        "finite_number": "must be a finite number",
        "union_tag_invalid": f"kind {tag!r} is none of {known}",
        "union_tag_not_found": "needs a key kind, which says what it is",
        "literal_error": f"must be {context.get('expected')}",
        "greater_than": f"must be over {bounds.get('gt', 0):g}",
        "greater_than_equal": f"must be at least {bounds.get('ge', 0):g}",
        "less_than": f"must be under {bounds.get('lt', 0):g}",
        "less_than_equal": f"must be at most {bounds.get('le', 0):g}",
        "too_long": f"must have at most {context.get('max_length')} values",
        "too_short": f"must have at least {context.get('min_length')} values",
        "string_too_long": f"must have at most {context.get('max_length')} characters",
        "string_too_short": "must not be empty",
    }
    if fault["type"] == "extra_forbidden":
        said["extra_forbidden"] = f"unknown key{_meant(model, str(loc[-1]))}"
    pattern = str(context.get("pattern"))
    said["string_pattern_mismatch"] = _pattern_in_words(pattern)
    what = said.get(str(fault["type"]), str(fault["msg"]).removeprefix("Value error, "))
    return f"{path}: {where}: {what}{shown}" if where else f"{path}: {what}{shown}"
