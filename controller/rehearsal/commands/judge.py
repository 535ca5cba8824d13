"""``snakewalk log judge``: compare a run with the truth of the robot that was served."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Json, RunLog, show
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.rehearsal.judgement import judge as judged
from snakewalk.controller.runlog.truth import read_truth


@command("log judge", examples=("log judge truth.jsonl runs/my-run/log.mcap",))
def judge(
    truth: Annotated[Path, typer.Argument(help="file of `snakewalk bus serve --truth`")],
    log: RunLog,
    as_json: Json = False,
) -> None:
    """Compare a run with the truth of the served robot; exit code 1 unless it truly arrived."""
    record = open_log(log)
    judgement = judged(read_truth(truth), record, summary(record))
    facts = judgement.facts()
    show(facts if as_json else {"judgement": judgement.text, **facts}, as_json)
    if (
        not judgement.has_arrived
        or not judgement.is_true
        or judgement.claimed < judgement.waypoints
    ):
        raise SystemExit(1)
