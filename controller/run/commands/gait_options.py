"""Options and facts that several ``snakewalk gait`` commands share."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from snakewalk.controller.console import completion
from snakewalk.controller.console.options import key_values

if TYPE_CHECKING:
    from snakewalk.controller.gaits.gait import Gait

Name = Annotated[
    str,
    typer.Argument(
        help="gait, shipped set of parameters, or file of parameters (.toml)",
        autocompletion=completion.GAITS,
    ),
]
Param = Annotated[
    list[str] | None,
    typer.Option("--param", "-p", help="NAME=VALUE: a parameter of the gait; may be repeated"),
]


def parameters(given: list[str] | None) -> dict[str, Any]:
    """Read NAME=VALUE pairs; the gait's schema checks the values."""
    return key_values("--param", given, "NAME=VALUE")


def needed_joints(gait: "type[Gait]") -> list[str]:
    """Return the kinds of joints that a gait needs."""
    return [name for name in ("yaw", "pitch", "legs", "wheels") if getattr(gait.needs, name)]
