"""``python -m benchmarks.clean_poses``: no run rejects a good pose, whatever the ground.

Each case draws a ground (floor, hills, ramps, steps, gravel, a floor with ice), one of the three
friction laws, and friction of 0.5 to 1.4 times the file. The served robot is rehearsed with a
tracker of 1 cm, 3 degrees and 100 ms of error for at most ``--seconds``. A case rejects a good pose
if the run ends because of it, holds because of it, or ends with an unconfirmed pose. A limp body
that truly slid from its start before torque is counted apart: ``slid_m`` is the way of its head.
``--write FILE`` keeps rows as lines of JSON; cases in it are not repeated.
"""

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from benchmarks.wrong_poses import TRACKER
from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import LAWS, LawName
from snakewalk.controller.pose.tracker import Sent
from snakewalk.controller.rehearsal import judgement, rehearsal
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.external.served_robot import ServedRobot
from snakewalk.controller.runlog.record import RunRecord

FRICTION: Final = (0.5, 1.4)
"""Smallest and largest factor on the friction of the world's file."""
ICE: Final = 1.0 / 3.0
"""Friction on ice over that of the ground around it."""
ICE_M: Final = (0.6, 1.8)
"""Where the ice begins and ends along x; the body is on it while its head is."""
GRAVEL: Final = {"world.ground.correlation_m": 0.12, "world.ground.rms_slope_rad": 0.12}
"""Hills that are shorter than two links."""
GROUNDS: Final[dict[str, tuple[str, dict[str, float]]]] = {
    "floor": ("flat-slalom", {}),
    "ice": ("flat-slalom", {}),
    "gravel": ("random-10", GRAVEL),
    "hills": ("random-10", {}),
    "traverse": ("jacksboro-traverse", {}),
    "around": ("jacksboro-around", {}),
    "ramp up": ("ramp-10-up", {}),
    "ramp along": ("ramp-10-along", {}),
    "steps": ("steps-4cm", {}),
}
"""Runs and changed keys of the grounds."""


SLID_M: Final = 0.05
"""True way of the head before torque, beyond which a body slid from its start."""


@dataclass(frozen=True, slots=True)
class CleanCase:
    """A ground, a law, and a factor on the friction."""

    number: int
    ground: str
    law: LawName
    factor: float

    @classmethod
    def drawn(cls, number: int) -> "CleanCase":
        """Return the case of a number: grounds and laws by turns, the factor drawn."""
        names = tuple(GROUNDS)
        low, high = np.log(FRICTION)
        factor = float(np.exp(np.random.default_rng([number, 64]).uniform(low, high)))
        law = LAWS[number // len(names) % len(LAWS)]
        return cls(number, names[number % len(names)], law, round(factor, 3))


def rehearsed(case: CleanCase, seconds: float) -> dict[str, Any]:
    """Rehearse a case; returns its row."""
    run, keys = GROUNDS[case.ground]
    faults: list[str] = []
    last: list[bool] = []
    places_m: list[Floats] = []
    true = ServedRobot.due
    deviation = Deviation(case.factor, case.factor, law=case.law)

    def due(self: ServedRobot, now_s: float) -> Sequence[Sent]:
        places_m.append(self.body.head_pose().head_in_world_m.copy())
        if case.ground == "ice":
            body = self.body
            along, across, back, code = body.world.friction.grip
            on_ice = ICE_M[0] < body.head_pose().head_in_world_m[0] < ICE_M[1]
            share = ICE if on_ice else 1.0
            body.mechanics.mu = (share * along, share * across, share * back, code)
        return true(self, now_s)

    def judged(truth: Any, record: RunRecord, numbers: Any) -> Any:
        source = record.pose_source
        faults.extend(dict.fromkeys(fault for fault in source.fault if fault))
        last.append(len(source.is_confirmed) > 0 and bool(source.is_confirmed[-1]))
        return judgement.judge(truth, record, numbers)

    with (
        patch.object(ServedRobot, "due", due),
        patch.object(rehearsal, "judge", judged),
        patch.object(rehearsal, "NO_DEVIATION", deviation),
    ):
        row = rehearsal.rehearse(
            rehearsal.RehearsalCase(run, 1000 + case.number, has_errors=False, tracker=TRACKER),
            {"keys": keys, "time_limit_s": seconds},
        )
    error = row.get("error")
    slid_m = float(np.linalg.norm(places_m[-1] - places_m[0])) if error else 0.0
    is_confirmed = bool(last) and last[-1]
    rejected = faults[0] if faults else error or ("" if is_confirmed else "unconfirmed")
    return {
        "number": case.number,
        "ground": case.ground,
        "law": case.law,
        "factor": case.factor,
        "rejected": "" if slid_m > SLID_M else rejected,
        "slid_m": round(slid_m, 3),
        "claimed": row.get("claimed", 0),
        "reached_as_stated": row.get("reached_as_stated", 0),
        "truly_reached": row.get("truly_reached", 0),
        "position_sd_m": row.get("position_sd_m"),
        "pose_error_max_m": row.get("pose_error_max_m"),
        "end": error or row["verdict"],
    }


def main() -> int:
    """Rehearse and print the counts; 1 if a good pose is rejected, or a claim is false."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.clean_poses", description=__doc__)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--write", type=Path, help="file of rows")
    parser.add_argument("--most", type=int, default=10_000, help="largest number of new rehearsals")
    given = parser.parse_args()
    kept = given.write
    lines = kept.read_text().splitlines() if kept is not None and kept.exists() else []
    rows = {row["number"]: row for row in map(json.loads, lines)}
    wanted = [n for n in range(given.first, given.first + given.cases) if n not in rows]
    for number in wanted[: given.most]:
        rows[number] = rehearsed(CleanCase.drawn(number), given.seconds)
        if kept is not None:
            with kept.open("a") as file:
                file.write(json.dumps(rows[number]) + "\n")
    rejected = [row for row in rows.values() if row["rejected"]]
    false = [row for row in rows.values() if row["claimed"] > row["reached_as_stated"]]
    counts = Counter(row["ground"] for row in rows.values())
    print(", ".join(f"{ground} {count}" for ground, count in sorted(counts.items())))
    for row in [*rejected, *false]:
        print(row)
    slid = sum(row.get("slid_m", 0.0) > SLID_M for row in rows.values())
    print(f"{slid} bodies slid from their start before torque")
    print(f"{len(rows)} runs; good poses rejected: {len(rejected)}; false claims: {len(false)}")
    return int(bool(rejected or false))


if __name__ == "__main__":
    raise SystemExit(main())
