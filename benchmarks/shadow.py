"""``python -m benchmarks.shadow``: planted faults, and which of them a shadow names.

Each robot is simulated with servos, masses, horns and ground that differ a little, as those of
robots that are well do; four of five have a fault besides. The goals are those of a gait's run.
"""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.studies.shadow.diagnosis import Signatures, answers, goals_of

KINDS = ("none", "friction", "load", "weaker servo", "slipped horn")


def planted(robot: RobotConfig, kind: str, seed: int) -> tuple[Deviation, int | None, float]:
    """Draw a robot with a fault: where it is, and how much of it."""
    chance = np.random.default_rng([seed, KINDS.index(kind)])
    joints, links = robot.joint_count, robot.link_count
    along, across = 1.0 + 0.05 * chance.standard_normal(2)
    load_kg = 0.03 * robot.mean_link_mass_kg * chance.standard_normal(links)
    torque = 1.0 + 0.03 * chance.standard_normal(joints)
    slip_rad = 0.009 * chance.standard_normal(joints)
    at, amount = None, 0.0
    if kind == "friction":
        amount = float(
            chance.uniform(0.5, 0.75) if chance.random() < 0.5 else chance.uniform(1.4, 2)
        )
        which = chance.integers(3)
        along *= amount if which != 1 else 1.0
        across *= amount if which != 0 else 1.0
    elif kind == "load":
        at, amount = int(chance.integers(links)), float(chance.uniform(0.08, 0.25))
        load_kg[at] += amount
    elif kind == "weaker servo":
        at, amount = int(chance.integers(joints)), float(chance.uniform(0.4, 0.75))
        torque[at] *= amount
    elif kind == "slipped horn":
        sign = float(chance.choice([-1.0, 1.0]))
        at, amount = int(chance.integers(joints)), sign * float(chance.uniform(0.15, 0.35))
        slip_rad[at] += amount
    return Deviation(float(along), float(across), load_kg, torque, slip_rad), at, amount


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.shadow", description=__doc__)
    parser.add_argument("--gait", default="lateral-undulation")
    parser.add_argument("--robot", default="yaw16")
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args()
    prepared = prepare_gait(given.gait, robot=given.robot, seconds=given.seconds)
    with TemporaryDirectory() as folder:
        record = run_robot(RunRequest(prepared, Path(folder) / "run", stoppable=False)).record
    goals, _ = goals_of(record)
    signatures = Signatures(goals)
    console = Console(width=200)
    rows = {kind: [0, 0, 0, 0] for kind in KINDS}
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        for kind in KINDS:
            deviation, at, amount = planted(goals.robot, kind, seed)
            named = signatures.diagnose(answers(goals, deviation)).named
            found = "none" if named is None else named.cause
            place = None if named is None else named.at
            right = found == kind and (at is None or place == at)
            row = rows[kind]
            row[0] += right
            row[1] += found == kind and not right
            row[2] += found == "none" and kind != "none"
            row[3] += found not in (kind, "none")
            if not right:
                console.print(
                    f"seed {seed}: {kind} at {at}, {amount:.2f}: named {found} at {place}"
                )
    table = Table("planted", "named", "another place", "not named", "another cause", box=None)
    for kind, row in rows.items():
        table.add_row(kind, *(f"{count} of {given.seeds}" for count in row))
    console.print(table)


if __name__ == "__main__":
    main()
