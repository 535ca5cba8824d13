"""The options of every command that moves a body."""

from typing import Annotated

from pydantic import AfterValidator

from snakewalk.config.base import Strict
from snakewalk.controller.console.options import (
    VIEW_AT,
    Film,
    Force,
    Json,
    PartMb,
    PartMinutes,
    Ros,
    RunFolder,
    RunPort,
    View,
    ViewAt,
    check_port_name,
)


class RunOptions(Strict):
    """Target of a run, its observers, and the display of its results.

    One parameter of this type declares all options of a command.
    """

    port: Annotated[RunPort, AfterValidator(check_port_name)] = None
    view: View = False
    view_at: ViewAt = VIEW_AT
    ros: Ros = False
    film: Film = True
    part_mb: PartMb = None
    part_minutes: PartMinutes = None
    out: RunFolder = None
    force: Force = False
    as_json: Json = False
