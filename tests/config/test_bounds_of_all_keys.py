"""Every number of every schema and option group rejects NaN, infinities and values out of bounds.

The values come from Python, where no command line checks them first.
"""

import math
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic import ValidationError
from pydantic.fields import FieldInfo

import snakewalk.config.document
import snakewalk.controller.animals.fish.film_options
import snakewalk.controller.animals.fish.synthesis_options
import snakewalk.controller.console.run_options  # noqa: F401  declare their schemas
from snakewalk.config.base import Strict
from snakewalk.config.field_facts import bounds_of


def schemas(base: type[Strict] = Strict) -> Iterator[type[Strict]]:
    """Yield the schemas of the library."""
    for schema in base.__subclasses__():
        if schema.__module__.startswith("snakewalk."):
            yield schema
        yield from schemas(schema)


def numbers() -> Iterator[tuple[type[Strict], str, FieldInfo]]:
    """Yield the keys that are a number, or a number and None."""
    for schema in dict.fromkeys(schemas()):
        for name, field in schema.model_fields.items():
            kinds = {field.annotation, *get_args(field.annotation)}
            while any(get_args(kind) for kind in kinds):  # of a named type
                kinds |= {part for kind in kinds for part in get_args(kind)}
                kinds = {kind for kind in kinds if not get_args(kind)}
            if float in kinds or int in kinds:
                yield schema, name, field


def is_rejected(schema: type[Strict], name: str, value: Any) -> bool:
    """Whether a schema names a fault of one of its keys; others may lack values."""
    try:
        schema.model_validate({name: value})
    except ValidationError as error:
        return any(fault["loc"][:1] == (name,) for fault in error.errors())
    return False


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_accepts_what_is_not_finite(value: float) -> None:
    keys = list(numbers())
    assert len(keys) > 300
    assert [(s.__name__, name) for s, name, _ in keys if not is_rejected(s, name, value)] == []


def test_no_number_accepts_a_value_beyond_its_bounds() -> None:
    beyond = [
        (schema, name, value)
        for schema, name, field in numbers()
        for kind, bound in bounds_of(field).items()
        for value in [bound if kind in {"gt", "lt"} else bound + (1 if kind == "le" else -1)]
    ]
    assert len(beyond) > 300
    assert [(s.__name__, name, v) for s, name, v in beyond if not is_rejected(s, name, v)] == []
