"""The options of every command that moves a body."""

from dataclasses import dataclass

from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    Force,
    Json,
    Ros,
    RunFolder,
    RunPort,
    View,
    ViewAt,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class RunOptions:
    """Target of a run, its observers, and the display of its results.

    One parameter of this type declares all options of a command.
    """

    port: RunPort = None
    view: View = False
    view_at: ViewAt = VIEW_AT
    ros: Ros = False
    film: Film = True
    out: RunFolder = None
    force: Force = False
    as_json: Json = False
