"""A command as it is called: checks its words and files first, then imports what it uses."""

import inspect
import math
import re
from collections.abc import Callable
from functools import partial, wraps
from types import ModuleType
from typing import Any

import typer
from typer.core import TyperCommand
from typer.models import ParameterInfo

from snakewalk.config.errors import InputError
from snakewalk.config.value_faults import given, in_words
from snakewalk.controller.console.command import command_info
from snakewalk.controller.console.messages import LOGGER, messages
from snakewalk.controller.console.options import (
    LogFile,
    LogLevel,
    Quiet,
    Verbose,
    check_files,
    check_idle,
)
from snakewalk.controller.console.plugins import take_problems
from snakewalk.controller.console.result_files import refuse_to_overwrite

_KINDS = {"bool": "", "str": "text", "int": "integer", "float": "number", "dir": "folder"}
"""Kinds of values as the help shows them; a switch has none."""


class CalledCommand(TyperCommand):
    """A command that refuses a value which would replace another one of the same option."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options and arguments."""
        return with_kinds(super().get_params(ctx))

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Read the words behind a command's name."""
        words = list(args)
        try:
            rest = super().parse_args(ctx, args)  # --help ends here
        except typer.BadParameter as error:
            faults = getattr(error.__cause__, "errors", None)  # pydantic's, behind typer's
            if faults is None:
                raise
            first = dict(faults()[0])
            text = in_words(first).rstrip(".")
            text += "" if repr(first.get("input")) in text else given(first)
            raise typer.BadParameter(text, ctx=ctx, param=error.param) from None
        if not ctx.resilient_parsing:  # of completion
            order: list[Any] = self.make_parser(ctx).parse_args(words)[2]
            for option in dict.fromkeys(order):
                if order.count(option) > 1 and _takes_one_value(option):
                    fault = f"given {order.count(option)} times, but has one value; leave one"
                    raise typer.BadParameter(fault, ctx=ctx, param=option)
            for param in self.params:
                _check_finite(ctx, param)
        return rest


def with_kinds(parameters: list[Any]) -> list[Any]:
    """Return parameters whose help shows kind and range of a value in words."""
    for parameter in parameters:
        shown = getattr(parameter, "display_type", None)  # typer before 0.29 has another form
        is_named = parameter.param_type_name == "option" and parameter.metavar
        if shown is not None and not is_named and "display_type_rich" not in vars(parameter):
            between = _range(parameter.min, parameter.max)
            parameter.min = parameter.max = None  # typer's own words; its check has them, too
            parameter.display_type_rich = partial(_kind, shown, between)
    return parameters


def _range(low: float | None, high: float | None) -> str:
    if low is None:
        return "" if high is None else f"up to {high:g}"
    return f"{low:g} or more" if high is None else f"{low:g} to {high:g}"


def _kind(shown: Callable[[Any], str], between: str, ctx: Any) -> str:
    kind = re.sub(r"list\[|[]<>]", "", shown(ctx))
    return between or _KINDS.get(kind, kind)


def _takes_one_value(option: Any) -> bool:
    """Whether a second value of an option replaces the first; a flag that only sets does not."""
    return not (option.multiple or (option.is_flag and not option.secondary_opts))


def _check_finite(ctx: Any, parameter: Any) -> None:
    """Reject NaN and infinity, unless the help of the option names the value.

    Bounds do not reject NaN in each comparison, and a configuration names its own keys.
    """
    value = ctx.params.get(parameter.name)
    words = (getattr(parameter, "help", None) or "").replace(":", " ").split()
    for element in value if isinstance(value, list | tuple) else (value,):
        if (
            isinstance(element, float)
            and not math.isfinite(element)
            and f"{abs(element)}" not in words
        ):
            fault = f"must be a finite number (got {element:g})"
            raise typer.BadParameter(fault, ctx=ctx, param=parameter)


def called(
    declared: Callable[..., Any], load: Callable[[], Callable[..., Any]]
) -> Callable[..., Any]:
    """Return the function of a command with the options that all commands have.

    It checks the files that the command names, of its input and of its results, before ``load``
    imports what the command uses. A parameter whose type is a model stands for the options that are
    the fields of the model (``console.option``).

    Args:
        declared: the command's signature, docstring and declaration.
        load: returns the function to call.

    """
    signature = inspect.signature(declared, eval_str=True)
    groups: dict[str, Any] = {
        name: parameter.annotation
        for name, parameter in signature.parameters.items()
        if _is_model(parameter.annotation)
    }
    given = [
        option for parameter in signature.parameters.values() for option in _options(parameter)
    ]
    defaults = {option.name: option.default for option in given}
    info = command_info(declared)

    @wraps(declared)
    def command(
        *, verbose: Verbose, quiet: Quiet, log_level: LogLevel, log_file: LogFile, **options: Any
    ) -> Any:
        if (log_level is not None) + verbose + quiet > 1:
            raise InputError("--verbose, --quiet and --log-level say the same thing: leave one")
        check_idle(options, defaults)
        level = log_level or ("debug" if verbose else "warning" if quiet else "info")
        with messages(level, log_file):
            for problem in take_problems():
                LOGGER.warning("%s", problem)
            named = {key: value for key, value in options.items() if isinstance(value, str)}
            check_files(named.get("run"), named.get("robot"), named.get("world"))
            force = bool(options.get("force"))
            refuse_to_overwrite([options[name] for name in info.results], force)
            refuse_to_overwrite([options[name] for name in info.tables], force=True)
            for name, group in groups.items():
                options[name] = _model(group, options)
            return load()(**options)

    shared = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, kind, default in (
            ("verbose", Verbose, False),
            ("quiet", Quiet, False),
            ("log_level", LogLevel, None),
            ("log_file", LogFile, None),
        )
    ]
    paragraphs = (inspect.getdoc(declared) or "").split("\n\n")
    command.__doc__ = "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)
    command.__annotations__ = {option.name: option.annotation for option in (*given, *shared)}
    command.__signature__ = signature.replace(parameters=[*given, *shared])  # type: ignore[attr-defined]
    return command


def _is_model(annotation: Any) -> bool:
    return hasattr(annotation, "model_fields")


def _options(given: inspect.Parameter) -> list[inspect.Parameter]:
    """Return the options of a parameter: of Typer, of a key's named type, or of a model."""
    kind = given.annotation
    if any(isinstance(metadata, ParameterInfo) for metadata in getattr(kind, "__metadata__", ())):
        return [given.replace(kind=inspect.Parameter.KEYWORD_ONLY)]
    option = _option_module()
    return [*option.parameters(kind)] if _is_model(kind) else [option.key_parameter(given)]


def _model(group: Any, options: dict[str, Any]) -> Any:
    """Return a model from its options, and remove these from the others."""
    return _option_module().from_words(
        group, {name: options.pop(name) for name in group.model_fields}
    )


def _option_module() -> ModuleType:
    """Return the module of options that are keys or fields of a model."""
    from snakewalk.controller.console import option  # noqa: PLC0415  --help has no models

    return option
