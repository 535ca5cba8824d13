"""TOML to schema, strictly: every fault of a file at once, each with its path in the file."""

import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticSerializationError, to_json

from snakewalk.config.archive import read_text
from snakewalk.config.errors import ConfigError
from snakewalk.config.value_faults import given, in_words, unit_hint

M = TypeVar("M", bound=BaseModel)
Schemas = Callable[[], Mapping[str, type[BaseModel]]]
"""Schemas of files by their names; a hint names the file that has an unknown key."""


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """Read a TOML file; return its data and its text.

    Raises:
        ConfigError: missing file, or broken TOML.

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
    return data, text


def checked(
    model: type[M],
    data: dict[str, Any],
    source: str,
    text: str = "",
    others: Schemas = dict,
) -> M:
    """Validate ``data``; each fault begins with ``source`` and the line in ``text``.

    A value of another type is a fault: text is not a number, and true is not 1.

    Raises:
        ConfigError: all schema faults, one line each.

    """
    try:
        plain = to_json(data, inf_nan_mode="constants", fallback=_to_python)
        return model.model_validate_json(plain, strict=True)
    except PydanticSerializationError as error:
        raise ConfigError(f"{source}: {error}") from None
    except ValidationError as error:
        faults = error.errors()
        lines = [_line(model, source, text, dict(fault), others) for fault in faults[:_MOST_FAULTS]]
        if len(faults) > _MOST_FAULTS:
            lines.append(
                f"{source}: {len(faults) - _MOST_FAULTS} further faults; correct these first"
            )
        raise ConfigError(lines) from None


def _to_python(value: Any) -> Any:
    """Convert numpy's numbers and arrays to Python's.

    Raises:
        TypeError: it is something else.

    """
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(
        f"{type(value).__name__} cannot be a value of a configuration; use a "
        "number, text, list or table"
    )


def _check_keys(text: str) -> None:
    """Reject keys of hundreds of tables: ``tomllib`` needs minutes for them.

    Raises:
        ValueError: a key has too many.

    """
    for number, line in enumerate(text.splitlines(), start=1):
        if line.count(".") > _MOST_TABLES and any(
            key.count(".") > _MOST_TABLES for key in _NO_KEY.split(line)
        ):
            raise ValueError(f"a key of over {_MOST_TABLES} tables in line {number}")


_MOST_BYTES = 4_000_000
_MOST_FAULTS = 100
"""Faults that are listed (ours)."""
_MOST_TABLES = 100
"""Limit of tables in a TOML file, and in a dotted key (ours)."""
_NO_KEY = re.compile(r"[^\w.\s\"'-]+")
_PLACE = re.compile(r" ?\(at line (\d+), column \d+\)")
_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"""^\s*([\w."' -]+?)\s*=""")


def line_number(text: str, loc: Sequence[str | int]) -> int | None:
    """Line that sets the innermost existing key of ``loc`` in a TOML text, or None."""
    innermost = [str(part) for part in loc if isinstance(part, str)]
    places = [part for part in loc if isinstance(part, int)]
    table: list[str] = []
    table_counts: Counter[str] = Counter()
    key_line = None
    depth = 0
    is_inside_table = True
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _TABLE.match(line):
            keys = table = _parts(header[2])
            is_inside_table = header[1] == "[" or places[:1] == [table_counts[header[2]]]
            table_counts[header[2]] += 1
        elif key := _KEY.match(line):
            keys = table + _parts(key[1])
        else:
            continue
        rest = iter(innermost)
        if is_inside_table and len(keys) > depth and all(part in rest for part in keys):
            key_line = number
            depth = len(keys)
    return key_line


def _parts(key: str) -> list[str]:
    return [part.strip(" \"'") for part in key.split(".")]


def _keys(kind: Any) -> Iterator[str]:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            yield name
            yield from _keys(field.annotation)
    else:
        for part in get_args(kind):
            yield from _keys(part)


def _key_hint(model: type[BaseModel], key: str, others: Schemas) -> str:
    """Hint on an unknown key: a similar key, or the file that has it."""
    near = get_close_matches(key, set(_keys(model)) - {key}, 1, 0.78)
    if near:
        return f"; did you mean {near[0]}?"
    owner = next((n for n, m in others().items() if m is not model and key in m.model_fields), None)
    return "" if owner is None else f"; it is a key of a {owner}'s file"


def _line(
    model: type[BaseModel], path: str, text: str, fault: dict[str, Any], others: Schemas
) -> str:
    loc = fault["loc"]
    where = ".".join(str(p) for p in loc)
    number = line_number(text, loc)
    if number is not None:
        path = f"{path}:{number}"
    hint = _key_hint(model, str(loc[-1]), others) if fault["type"] == "extra_forbidden" else ""
    text_of = in_words(fault, hint) + given(fault) + unit_hint(fault)
    return f"{path}: {where}: {text_of}" if where else f"{path}: {text_of}"
