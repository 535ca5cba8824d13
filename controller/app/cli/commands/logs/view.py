"""``snakewalk view``: a log in the browser, in 3-D, with a time slider."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.options import VIEW_AT, ViewAt
from snakewalk.controller.app.messages import LOGGER


def view(
    log: Annotated[Path, typer.Argument(help="log.mcap of a run, or the .part of a killed one")],
    view_at: ViewAt = VIEW_AT,
) -> None:
    """Show a log in the browser: body, path, servos and curves, with a time slider. ^C ends it.

    A run is shown while it lasts by --view of run, gait run and play.
    """
    require_extra("the page needs", "viser")
    from snakewalk.controller.app.view.live_view import host_and_port  # noqa: PLC0415
    from snakewalk.controller.app.view.log_page import LogPage, play  # noqa: PLC0415  heavy
    from snakewalk.controller.runlog.reader import read_log  # noqa: PLC0415
    from snakewalk.drivers.clock import WallClock  # noqa: PLC0415

    host, port = host_and_port(view_at)
    record = read_log(log)
    if record.note:
        LOGGER.warning("%s: %s", log, record.note)
    try:
        page = LogPage(record, host, port)
    except InputError as fault:
        raise InputError([f"{log}: {line}" for line in fault.faults]) from None
    print(f"{page.url}  (^C ends)", flush=True)
    play(page, WallClock())
