"""Options of a command that are the fields of a model: one declaration for each.

Name, type, bounds, default and description are those of the field, so a call from Python has the
same defaults and bounds. ``Flag`` adds what only a command line has.
"""

import inspect
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

import typer
from pydantic import BeforeValidator, ValidationError
from pydantic.fields import FieldInfo
from typer.models import ParameterInfo

from snakewalk.config.base import Strict
from snakewalk.config.errors import InputError
from snakewalk.config.field_facts import bounds_of, description_of
from snakewalk.config.value_faults import in_words
from snakewalk.controller.console.completion import Complete
from snakewalk.controller.console.options import key_values

M = TypeVar("M", bound=Strict)


@dataclass(frozen=True, slots=True)
class Flag:
    """How a command line spells a field; part of the field's annotation."""

    names: tuple[str, ...] = ()
    """Names of the option with dashes, ``--film/--no-film`` with an opposite; by default ``--`` and
    the field's."""
    metavar: str | None = None
    """Name of the value in the help."""
    complete: Complete | None = None
    """Completion of the value."""
    is_argument: bool = False
    """Whether the value has no name before it."""


def numbers(form: str, *counts: int) -> BeforeValidator:
    """Return a rule that reads numbers from a word: ``1,0.5,90``; ``form`` says what is expected.

    ``counts`` are the valid numbers of numbers.
    """

    def split(given: Any) -> Any:
        if not isinstance(given, str):
            return given
        try:
            values = tuple(float(part) for part in given.split(","))
        except ValueError:
            values = ()
        if len(values) not in counts or not all(map(math.isfinite, values)):
            raise ValueError(form)
        return values

    return BeforeValidator(split)


def parameters(model: type[Strict]) -> Iterator[inspect.Parameter]:
    """Yield the parameter of each field of a model, as Typer reads it."""
    for name, field in model.model_fields.items():
        yield _parameter(name, field)


def key_parameter(given: inspect.Parameter) -> inspect.Parameter:
    """Return a parameter whose type is the named type of a key, as Typer reads it."""
    if given.default is given.empty:
        return _parameter(given.name, FieldInfo.from_annotation(given.annotation))
    field = FieldInfo.from_annotated_attribute(given.annotation, given.default)
    return _parameter(given.name, field)


def _parameter(name: str, field: FieldInfo) -> inspect.Parameter:
    kind = _type_of_words(field)
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if field.is_required() else _default(field, kind),
        annotation=Annotated[kind, _typer_info(name, field, kind)],
    )


def from_words(model: type[M], values: Mapping[str, Any]) -> M:
    """Return a model with the values of a command line.

    Raises:
        InputError: one line per value that the model rejects.

    """
    given = {
        name: _pairs(name, field, values[name])
        for name, field in model.model_fields.items()
        if not (values[name] is None and field.default in ((), {}))
    }
    try:
        return model(**given)
    except ValidationError as error:
        raise InputError([_fault(model, dict(fault)) for fault in error.errors()]) from None


def _pairs(name: str, field: FieldInfo, value: Any) -> Any:
    """Return a table from its KEY=VALUE pairs, and any other value as it is."""
    if get_origin(field.annotation) is not dict:
        return value
    of_text = get_args(field.annotation)[1] is str
    pairs = key_values(_names(name, _flag(field))[0], value)
    return {key: str(item) if of_text else item for key, item in pairs.items()}


def _fault(model: type[Strict], fault: dict[str, Any]) -> str:
    """Return a rejected value with the option that it was given to."""
    text = in_words(fault).rstrip(".")
    place: tuple[Any, ...] = fault["loc"]
    if not place:
        return text
    field = model.model_fields[str(place[0])]
    flag = _flag(field)
    option = str(place[0]) if flag.is_argument else _names(str(place[0]), flag)[0]
    given = fault.get("input")
    shown = f" {given}" if isinstance(given, str | int | float) and given != field.default else ""
    return f"{option.partition('/')[0]}{shown}: {text}"


def _flag(field: FieldInfo) -> Flag:
    return next((metadata for metadata in field.metadata if isinstance(metadata, Flag)), Flag())


def _names(name: str, flag: Flag) -> tuple[str, ...]:
    return flag.names or (f"--{name.replace('_', '-')}",)


def _typer_info(name: str, field: FieldInfo, kind: Any) -> ParameterInfo:
    ready = next(
        (metadata for metadata in field.metadata if isinstance(metadata, ParameterInfo)), None
    )
    if ready is not None:  # an option that plain signatures share
        return ready
    flag = _flag(field)
    bounds = bounds_of(field)
    facts: dict[str, Any] = {
        "help": description_of(field),
        "metavar": flag.metavar,
        "autocompletion": flag.complete,
    }
    if {int, float} & {kind, *get_args(kind)}:
        facts |= {"min": bounds.get("ge"), "max": bounds.get("le")}
    if flag.is_argument:
        info: ParameterInfo = typer.Argument(**facts)
    else:
        is_switch = kind is bool and not flag.names
        info = typer.Option(*(_names(name, flag) if flag.names or is_switch else ()), **facts)
    return info


def _type_of_words(field: FieldInfo) -> Any:
    """Return the type that Typer reads: text for a value with a validator of its words."""
    if any(isinstance(metadata, BeforeValidator) for metadata in field.metadata):
        return str | None if type(None) in get_args(field.annotation) else str
    if get_origin(field.annotation) is dict:
        return list[str] | None
    arguments = get_args(field.annotation)
    if get_origin(field.annotation) is tuple and arguments[1:] == (Ellipsis,):
        return list[_type_word(arguments[0])] | None  # type: ignore[misc]
    return _type_word(field.annotation)


def _type_word(annotation: Any) -> Any:
    if get_origin(annotation) is Annotated:
        inner, *rules = get_args(annotation)
        return (
            str if any(isinstance(rule, BeforeValidator) for rule in rules) else _type_word(inner)
        )
    if get_origin(annotation) in {Union, UnionType}:
        return Union[tuple(_type_word(arg) for arg in get_args(annotation))]  # noqa: UP007  a list of types
    return str if get_origin(annotation) is tuple else annotation


def _default(field: FieldInfo, kind: Any) -> Any:
    """Return a field's default as a command line shows it."""
    if field.default in ((), {}):
        return None
    if kind is str and isinstance(field.default, tuple):
        return ",".join(f"{number:g}" for number in field.default)
    return field.default
