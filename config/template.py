"""Configurations as TOML: a template with every key, or a robot without defaults."""

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from snakewalk.config.document import (
    WRITTEN_BY_PROGRAM,
    row_model,
    table_models,
    value_kind,
)
from snakewalk.config.field_facts import description_of

_COLUMN = 42
"""Column in which the description behind a key begins."""


def template(config: BaseModel, comment: str, without: Collection[str] = ()) -> str:
    """Text of a TOML file that reads back to ``config`` and shows all other keys.

    Keys with defaults are comments. ``comment`` is the head; the tables ``without`` are omitted.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    values = config.model_dump()
    given = config.model_dump(exclude_defaults=True)
    lines += _table(type(config), values, given, "", without)
    return "\n".join(lines) + "\n"


def _table(
    model: type[BaseModel],
    values: Mapping[str, Any],
    given: Mapping[str, Any] | None,
    place: str,
    without: Collection[str] = (),
) -> Iterator[str]:
    inner: list[str] = []
    for key, field in model.model_fields.items():
        where = f"{place}.{key}".removeprefix(".")
        row = row_model(field.annotation)
        choices = table_models(field.annotation)
        if key in without or (key in WRITTEN_BY_PROGRAM and not values.get(key)):
            continue
        if row is not None:
            inner += _rows(row, (given or {}).get(key, ()), where)
        elif choices:
            inner += _inner_table_lines(
                field, choices, values.get(key), (given or {}).get(key), where
            )
        else:
            value = values.get(key, field.default)
            is_kind = (
                get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1
            )
            yield _line(key, value, field, given is not None and (key in given or is_kind))
    yield from inner


def _inner_table_lines(
    field: FieldInfo, choices: list[type[BaseModel]], values: Any, given: Any, where: str
) -> Iterator[str]:
    """A table in a table; of several kinds the present one, else the first as comments."""
    kinds = [
        str(choice.model_fields["kind"].default)
        for choice in choices
        if "kind" in choice.model_fields
    ]
    model = choices[0] if values is None else _kind_of(choices, values)
    yield ""
    if len(kinds) > 1:
        yield f"# kinds of {where}: {', '.join(kinds)}; their keys: docs/configuration.md"
    elif model.__doc__:
        yield f"# {model.__doc__.splitlines()[0]}"
    is_there = (
        values is not None
    )  # an empty table, so that its keys are not read as another table's
    yield f"[{where}]" if is_there else f"# [{where}]"
    yield from _table(model, values or {}, (given or {}) if is_there else None, where)


def _kind_of(choices: list[type[BaseModel]], values: Mapping[str, Any]) -> type[BaseModel]:
    """Schema with the ``kind`` of a table."""
    return next(
        choice
        for choice in choices
        if len(choices) == 1 or choice.model_fields["kind"].default == values["kind"]
    )


def _rows(model: type[BaseModel], rows: Sequence[Mapping[str, Any]], where: str) -> Iterator[str]:
    """Repeated tables; one table of comments if the list of rows is empty."""
    for row in rows or ({},):
        yield ""
        yield f"[[{where}]]" if row else f"# [[{where}]]"
        yield from _table(model, row, row or None, where)


def _line(key: str, value: Any, field: FieldInfo, is_given: bool) -> str:
    shown = "" if value is None or value is PydanticUndefined else toml_value(value)
    left = f"{key} = {shown}" if is_given else f"# {key} = {shown}".rstrip()
    kind = re.sub(r"`(-?\d+)`", r"\1", value_kind(field)).replace("`", '"')
    words = [kind, description_of(field)]
    return f"{left:<{_COLUMN}} # {'; '.join(word for word in words if word)}"


def plain_toml(model: BaseModel, comment: str = "") -> str:
    """Text of a file without default values, with a head ``comment``."""
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    lines += _plain_table(model.model_dump(exclude_defaults=True), "")
    return "\n".join(lines) + "\n"


def _plain_table(data: Mapping[str, Any], place: str) -> Iterator[str]:
    tables = {key: value for key, value in data.items() if isinstance(value, Mapping)}
    rows = {key: value for key, value in data.items() if _is_rows(value)}
    for key, value in data.items():
        if key not in tables and key not in rows and value is not None:
            name = key if re.fullmatch("[A-Za-z0-9_-]+", key) else toml_value(key)
            yield f"{name} = {toml_value(value)}"
    for key, table in tables.items():
        where = f"{place}.{key}".removeprefix(".")
        yield from ("", f"[{where}]", *_plain_table(table, where))
    for key, several in rows.items():
        for row in several:
            yield from ("", f"[[{key}]]", *_plain_table(row, key))


def _is_rows(value: Any) -> bool:
    return isinstance(value, tuple | list) and bool(value) and isinstance(value[0], Mapping)


def toml_value(value: Any) -> str:
    """A value in TOML; text, numbers and lists as in JSON."""
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(toml_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
