"""``snakewalk view``: a log or a glTF in the browser, in 3-D."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import VIEW_AT, ViewAt
from snakewalk.controller.studies.run_comparison import log_names
from snakewalk.controller.view.live_view import host_and_port
from snakewalk.controller.view.log_page import LogPage, play
from snakewalk.controller.view.model_page import open_model
from snakewalk.drivers.clock import WallClock

_MOST_LOGS = 2


@command(
    "view",
    examples=("view runs/flat-square-walk-seed0/log.mcap", "view place.glb"),
)
def view(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE [LOG]",
            help="log.mcap of a run, the .part of a killed one, two of them, or a glTF (.glb)",
        ),
    ],
    view_at: ViewAt = VIEW_AT,
) -> None:
    """Show a log in the browser: body, path, servos, curves; or a glTF.

    A slider sets the time. ^C ends it. Two logs are shown side by side, or over each other if they
    have the same ground. The camera flies through a glTF of a place.

    To watch a run, use --view of run, gait run and play.
    """
    host, port = host_and_port(view_at)
    if len(logs) > _MOST_LOGS:
        raise InputError(
            f"{len(logs)} logs: the page shows one or two; more: snakewalk log compare"
        )
    if len(logs) == 1 and logs[0].suffix.lower() == ".glb":
        server, url = open_model(logs[0], host, port)
        print(f"{url}  (^C ends)", flush=True)
        server.sleep_forever()
    records = {}
    for log, name in zip(logs, log_names(logs), strict=True):
        records[name] = open_log(log).from_torque_on()
    page = LogPage(records, host, port)
    print(f"{page.url}  (^C ends)", flush=True)
    play(page, WallClock())
