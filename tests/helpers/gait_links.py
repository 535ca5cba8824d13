"""Where the links of robots are after gaits that run together in a batch."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.friction_law import LawName
from snakewalk.config.loader import load_world
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.run.external.gait_batch import MakeBodies, run_together
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.runlog.reader import read_log

SECONDS = 4.0


def prepared_gaits(robot: str, gaits: Sequence[str], law: LawName | None = None) -> list[GaitRun]:
    """Prepare the gaits that fit a robot, on a level floor with a law of friction."""
    keys = {} if law is None else {"world.friction.law": law}
    found = []
    for name in gaits:
        world = load_world(GAITS[name].world)
        flat = world.ground.kind == "flat" and world.obstacle is None
        where = world.name if flat else "isotropic"
        try:
            run = prepare_gait(name, robot=robot, world=where, seconds=SECONDS + 1.0, keys=keys)
            run.check_plan()
        except InputError as error:
            print(f"{robot:15} {name:22} left out: {error.faults[0]}")
            continue
        found.append(run)
    return found


def links_of(
    prepared: list[GaitRun],
    make_bodies: MakeBodies,
    folder: Path,
    note: object = lambda time_s: None,
) -> list[Floats]:
    """Places of the links at the begin and at ``SECONDS``, (2, L, 3) of each run."""
    logs = [folder / f"{number}.mcap" for number in range(len(prepared))]
    run_together(prepared, logs, make_bodies, note)  # type: ignore[arg-type]
    found = []
    for log in logs:
        pose = read_log(log).pose
        at = int(np.searchsorted(pose.time_s, SECONDS - 1e-9))
        found.append(pose.links_m[[0, at]])
    return found
