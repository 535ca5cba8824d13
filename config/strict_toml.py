"""TOML to schema, strictly: every fault of a file at once, each with its path in the file."""

import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import PydanticSerializationError, to_json

from snakewalk.config.archive import read_text
from snakewalk.config.base import PATTERNS_IN_WORDS
from snakewalk.config.errors import ConfigError

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
        plain = to_json(data, inf_nan_mode="constants", fallback=_plain)
        return model.model_validate_json(plain, strict=True)
    except PydanticSerializationError as error:
        raise ConfigError(f"{source}: {error}") from None
    except ValidationError as error:
        raise ConfigError(
            [_line(model, source, text, dict(fault), others) for fault in error.errors()]
        ) from None


def _plain(value: Any) -> Any:
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


_MOST_BYTES: Final = 4_000_000
_MOST_TABLES: Final = 100
"""Limit of tables in a TOML file, and in a dotted key (ours)."""
_NO_KEY: Final = re.compile(r"[^\w.\s\"'-]+")
_PLACE: Final = re.compile(r" ?\(at line (\d+), column \d+\)")
_TABLE: Final = re.compile(r"^\s*(\[\[?)\s*([^\]]+?)\s*\]")
_KEY: Final = re.compile(r"""^\s*([\w."' -]+?)\s*=""")


def line_number(text: str, loc: Sequence[str | int]) -> int | None:
    """Line that sets the innermost existing key of ``loc`` in a TOML text, or None."""
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


def _keys(kind: Any) -> Iterator[str]:
    """Keys of a schema and of all its tables."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            yield name
            yield from _keys(field.annotation)
    else:
        for part in get_args(kind):
            yield from _keys(part)


def _meant(model: type[BaseModel], key: str, others: Schemas) -> str:
    """Hint on an unknown key: a similar key, or the file that has it."""
    near = get_close_matches(key, set(_keys(model)) - {key}, 1, 0.78)
    if near:
        return f"; did you mean {near[0]}?"
    owner = next((n for n, m in others().items() if m is not model and key in m.model_fields), None)
    return "" if owner is None else f"; it is a key of a {owner}'s file"


def _pattern_in_words(pattern: str) -> str:
    """Return the message for a text that does not match."""
    if pattern in PATTERNS_IN_WORDS:
        return PATTERNS_IN_WORDS[pattern]
    letters = re.fullmatch(r"\^\[([a-z]+)\](?:\*|\{(\d+),(\d+)\})\$", pattern)
    if letters is not None:
        which, least, most = letters.groups()
        return f"must have the letters {' and '.join(which)} only" + (
            f", {least} to {most} of them" if least else ""
        )
    classes = re.fullmatch(r"\^(?:\[([^]]+)\])?\[([^]]+)\][*+]\$", pattern)
    if classes is None:
        return f"must match {pattern}"
    first, others = classes.groups()
    begin = f"must begin with {_class_in_words(first)}, and " if first else "must "
    return f"{begin}have only {_class_in_words(others)}"


def _class_in_words(characters: str) -> str:
    ranges = {"a-z": "small letters", "A-Z": "capital letters", "0-9": "digits"}
    words = [name for each, name in ranges.items() if each in characters]
    rest = re.sub("a-z|A-Z|0-9", "", characters)
    listed = words + [repr(each) for each in rest]
    return " or ".join([", ".join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)


def _line(
    model: type[BaseModel], path: str, text: str, fault: dict[str, Any], others: Schemas
) -> str:
    loc = fault["loc"]
    where = ".".join(str(p) for p in loc)
    number = line_number(text, loc)
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
        "union_tag_invalid": f"kind {tag!r} is unknown; use one of {known}",
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
        said["extra_forbidden"] = f"unknown key{_meant(model, str(loc[-1]), others)}"
    pattern = str(context.get("pattern"))
    said["string_pattern_mismatch"] = _pattern_in_words(pattern)
    what = said.get(str(fault["type"]), str(fault["msg"]).removeprefix("Value error, "))
    return f"{path}: {where}: {what}{shown}" if where else f"{path}: {what}{shown}"
