"""``snakewalk log shadow``: differences between a robot, by its log, and the simulator."""

import json

from snakewalk.config.extras import require_extra
from snakewalk.config.loader import load_world
from snakewalk.controller.console.command import command
from snakewalk.controller.console.opened_log import open_log
from snakewalk.controller.console.options import Json, RunLog, Workers, World, check_files, console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.studies.shadow.diagnosis import diagnose, goals_of


@command(
    "log shadow",
    examples=(
        "log shadow runs/gait-lateral-undulation-yaw16/log.mcap",
        "gait run lateral-undulation --port /dev/ttyUSB0 --shadow",
    ),
)
def shadow(
    log: RunLog,
    world: World = None,
    workers: Workers = 2,
    as_json: Json = False,
) -> None:
    """Send a log's goals to a simulated robot; exit code 1 if it names a cause of differences."""
    require_extra("a shadow needs", "mujoco")
    check_files(None, None, world)
    record = open_log(log)
    robot = record.header.robot
    goals, measured = goals_of(record, None if world is None else load_world(world))
    with ProgressBar("shadow", transient=True) as bar:
        diagnosis = diagnose(goals, measured, workers=workers, on_progress=bar.update)
    if as_json:
        print(
            json.dumps({"log": str(log), "text": diagnosis.text(robot)} | diagnosis.to_dict(robot))
        )
    else:
        console.print(diagnosis.text(robot))
        for cause in diagnosis.causes[1:4] if diagnosis.named else ():
            console.print(
                f"  less likely by e^{diagnosis.evidence_over(cause):.0f}: {cause.text(robot)}"
            )
    if diagnosis.named is not None:
        raise SystemExit(1)
