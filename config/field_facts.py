"""Facts of a field of a schema: its description, and the bounds of its value."""

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


def description_of(field: FieldInfo) -> str:
    """Return the description of a field, of its named type, or of the option that it is.

    A table has that of its model, and the ``kind`` of a table says so.
    """
    if field.description:
        return field.description
    model = _model(field.annotation)
    if model is not None:
        text = (model.__doc__ or "").partition("\n")[0].rstrip(".")
        return f"{text[:1].lower()}{text[1:]}"
    if get_origin(field.annotation) is Literal and len(get_args(field.annotation)) == 1:
        return "kind of this table; selects its other keys"
    for rule in (*field.metadata, *_rules(field.annotation)):
        words = getattr(rule, "description", None) or getattr(rule, "help", None)
        if words:
            return str(words)
    return ""


def bounds_of(field: FieldInfo) -> dict[str, float]:
    """Return the bounds of a number: ``gt``, ``ge``, ``lt`` and ``le`` that the field has."""
    rules = [*field.metadata]
    for rule in _rules(field.annotation):
        rules += rule.metadata if isinstance(rule, FieldInfo) else [rule]
    return bounds_in(rules)


def bounds_in(rules: list[Any]) -> dict[str, float]:
    """Return the bounds among the rules of a type."""
    return {
        name: getattr(rule, name)
        for name in _SIGNS
        for rule in rules
        if getattr(rule, name, None) is not None
    }


def bounds_text(bounds: dict[str, float]) -> str:
    """Return bounds as a reader sees them: ``≥ 0, ≤ 1``."""
    return ", ".join(f"{_SIGNS[name]} {value:g}" for name, value in bounds.items())


def _model(annotation: Any) -> type[BaseModel] | None:
    """Return the only model of a table, of a table that may be left out, or of a list of tables."""
    parts = [
        member_type
        for member_type in get_args(annotation)
        if member_type not in {type(None), Ellipsis}
    ]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) in {Union, UnionType, tuple} and len(parts) == 1:
        return _model(parts[0])
    return None


def _rules(annotation: Any) -> Iterator[Any]:
    """Yield the rules of a named type that may also be None."""
    if get_origin(annotation) is Annotated:
        yield from get_args(annotation)[1:]
    elif get_origin(annotation) in {Union, UnionType}:
        for part in get_args(annotation):
            yield from _rules(part)
