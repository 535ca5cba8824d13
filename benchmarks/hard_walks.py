"""``python -m benchmarks.hard_walks``: hard walks with sound servos, and with planted faults.

A walk is drawn from a seed: steep ground, soft joints, walls that are too narrow, a body on its
back, slippery ground, or weak servos at their current limit. A trip of a sound walk is false unless
it names a load that the servos truly have. ``--planted`` adds one fault of a servo to each walk; it
is found if a trip or an event names its joint afterwards. One line a walk is kept in a file.
"""

import argparse
import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import mujoco
import numpy as np

from snakewalk.config.faults import FaultPlan
from snakewalk.controller.console.pool import each
from snakewalk.controller.run.external import simulated_backend
from snakewalk.controller.run.external.served_robot import simulated_line
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.errors import DriverError, notes_of
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.physics.plant import MujocoPlant

KINDS: Final = ("steep", "soft", "stuck", "rolled", "slipping", "at limit")
SECONDS: Final = 15.0
LIFTS: Final = 10
"""Steps by which a turned body is lifted out of rough ground."""
LAWS: Final = ("ellipse", "scales", "wheels")
LOADS: Final = (" A for too long", "winding at about", "the chain draws about")
"""Words of trips that protect servos and supply from a load that they truly have."""
BLOCKED: Final = re.compile(r"with (-?\d+\.\d+) A: it does not follow")
PUSHES_A: Final = 2.0
"""Current of a joint off its goal which shows that its servo is overloaded: 2 A that last at rest
are a load, too."""
FAULTS: Final[dict[str, dict[str, Any]]] = {
    "no output": {"kind": "no_output"},
    "jammed": {"kind": "stuck"},
    "no reply": {"kind": "mute"},
    "no supply": {"kind": "brown_out"},
    "dead current sensor": {"kind": "reading", "register": "Present Current", "value": 0},
    "constant current": {"kind": "reading", "register": "Present Current", "value": 30},
    "constant position": {"kind": "reading", "register": "Present Position"},
    "hot": {"kind": "heat", "celsius": 75.0},
    "overload": {"kind": "overload"},
    "P gain": {"kind": "write", "register": "Position P Gain", "value": 50},
    "exchange": {"kind": "exchange"},
}
_RESET: Final = MujocoPlant.reset


def drawn(seed: int) -> tuple[str, str, dict[str, Any]]:
    """Return the kind of a walk, its run, and replaced keys; kinds come in turn."""
    chance = np.random.default_rng([seed, 64])
    kind = KINDS[seed % len(KINDS)]
    run = str(chance.choice(["ramp-15-up", "random-20", "jacksboro-steep", "gaps-8cm"]))
    if kind == "stuck":
        run = str(chance.choice(["narrow", "pegs"]))
    keys: dict[str, Any] = {
        "run.time_limit_s": SECONDS,
        "run.walk.tries": 0,
        "run.seed": seed,
        "run.deviation.friction_along": chance.uniform(0.6, 1.4),
        "run.deviation.friction_across": chance.uniform(0.6, 1.4),
        "run.deviation.friction_law": str(chance.choice(LAWS)),
        "run.deviation.mass": chance.uniform(0.8, 1.25),
    }
    if run == "ramp-15-up":
        keys["world.ground.slope_rad"] = np.radians(chance.uniform(8.0, 17.0))
    if run == "random-20":
        keys["world.ground.seed"] = int(chance.integers(1000))
    match kind:
        case "soft":
            keys["run.walk.pitch.p_gain"] = int(chance.integers(100, 900))
            keys["run.walk.pitch.current_limit_a"] = chance.uniform(0.06, 0.2)
        case "slipping":
            keys["run.deviation.friction_along"] = chance.uniform(0.2, 0.5)
            keys["run.deviation.friction_across"] = chance.uniform(0.2, 0.5)
        case "at limit":
            keys["run.deviation.torque"] = chance.uniform(0.2, 0.6)
            keys["run.deviation.mass"] = chance.uniform(1.0, 1.8)
    return kind, run, keys


def prepared(seed: int) -> tuple[str, WalkRun]:
    """Return the kind of a drawn walk, and the walk."""
    kind, run, keys = drawn(seed)
    if run not in ("narrow", "pegs"):
        return kind, prepare_walk(run, keys=keys)
    chance = np.random.default_rng([seed, 65])
    world = "corridor" if run == "narrow" else "pegs"
    if run == "narrow":
        keys["world.obstacle.width_m"] = chance.uniform(0.1, 0.2)
        keys["world.obstacle.at_m"] = (5.0, 0.0)
    walk = prepare_walk(
        "flat-slalom", robot="alternating16", world=world, keys=keys, waypoints_m=((5.0, 0.0),)
    )
    return kind, walk


@contextmanager
def on_its_back(angle_rad: float) -> Iterator[None]:
    """Turn simulated bodies about the head's axis when they are laid down, above rough ground."""
    turn = np.array([np.cos(0.5 * angle_rad), np.sin(0.5 * angle_rad), 0.0, 0.0])

    def reset(plant: MujocoPlant, *place: Any) -> None:
        _RESET(plant, *place)
        model, data = plant.mechanics.model, plant.mechanics.data
        mujoco.mju_mulQuat(data.qpos[3:7], data.qpos[3:7].copy(), turn)
        mujoco.mj_forward(model, data)
        for _ in range(LIFTS):
            data.qpos[2] -= data.contact.dist.min(initial=0.0)
            mujoco.mj_forward(model, data)

    with patch.object(MujocoPlant, "reset", reset):
        yield


@contextmanager
def planted(plan: FaultPlan) -> Iterator[None]:
    """Let simulated lines play faults."""

    def line(*given: Any, **keys: Any) -> Any:
        made = simulated_line(*given, **keys)
        FaultPlayer(made, plan)
        return made

    with patch(f"{simulated_backend.__name__}.simulated_line", line):
        yield


def fault_of(seed: int, joints: int) -> tuple[str, int, float, FaultPlan]:
    """Return the name of a fault, its joint, its time, and its plan."""
    chance = np.random.default_rng([seed, 66])
    name = list(FAULTS)[int(chance.integers(len(FAULTS)))]
    joint = int(chance.integers(1, joints))
    at_s = float(chance.uniform(4.0, 7.0))
    where = {"ids": [joint + 1]}
    if name == "exchange":
        where = {"id": joint + 1, "takes": joint}  # type: ignore[dict-item]
    fault = {**FAULTS[name], **where, "at_s": at_s}
    return name, joint, at_s, FaultPlan.model_validate({"seed": seed, "fault": [fault]})


def walked(seed: int, *, is_planted: bool = False) -> dict[str, Any]:
    """Walk; return what happened, ready for JSON."""
    kind, walk = prepared(seed)
    row: dict[str, Any] = {"seed": seed, "kind": kind, "world": walk.world.name}
    chance = np.random.default_rng([seed, 67])
    name, joint, at_s, plan = fault_of(seed, walk.robot.joint_count)
    if not is_planted:
        plan = FaultPlan()
    roll_rad = chance.uniform(1.6, 4.7) if kind == "rolled" else 0.0
    try:
        with on_its_back(roll_rad), planted(plan):
            result = run_robot(RunRequest(walk, stoppable=False))
    except DriverError as error:
        # before torque, a body that rolls while it is limp; afterwards a silent servo
        text = " ".join([str(error), *notes_of(error)])
        row |= {"trip": None, "duration_s": 0.0, "refused": text}
        if is_planted:
            label = walk.robot.joint_label(joint)
            row |= {"fault": name, "joint": joint, "at_s": at_s, "found": label in text}
        return row
    row |= {"trip": result.outcome.tripped, "duration_s": round(result.outcome.duration_s, 2)}
    if is_planted and result.record.end_s > at_s:  # others ended before their fault
        label = walk.robot.joint_label(joint)
        row |= {"fault": name, "joint": joint, "at_s": at_s}
        row["found"] = _is_found(result, label, at_s)
    return row


def _is_found(result: RunResult, label: str, at_s: float) -> bool:
    lines = [event.text for event in result.record.events if event.time_s > at_s]
    return any(label in line for line in (*lines, result.outcome.tripped or ""))


def is_false(row: dict[str, Any]) -> bool:
    """Whether a sound walk ended by a trip that names no true load."""
    trip = row["trip"]
    if trip is None or any(words in trip for words in LOADS):
        return False
    blocked = BLOCKED.search(trip)
    return blocked is None or abs(float(blocked[1])) < PUSHES_A


def table(rows: list[dict[str, Any]]) -> str:
    """Return a line for each kind, or for each fault of planted walks."""
    if any("fault" in row for row in rows):
        lines = ["| fault | walks | found |", "| --- | ---: | ---: |"]
        for name in FAULTS:
            of = [row for row in rows if row.get("fault") == name]
            lines.append(f"| {name} | {len(of)} | {sum(row['found'] for row in of)} |")
        return "\n".join(lines)
    lines = ["| walks | n | s of motion | stopped by a load | false trips |"]
    lines += ["| --- | ---: | ---: | ---: | ---: |"]
    for kind in KINDS:
        of = [row for row in rows if row["kind"] == kind and "refused" not in row]
        false = sum(map(is_false, of))
        loads = sum(row["trip"] is not None for row in of) - false
        seconds = sum(row["duration_s"] for row in of)
        lines.append(f"| {kind} | {len(of)} | {seconds:.0f} | {loads} | {false} |")
    return "\n".join(lines)


def kept_rows(
    work: Callable[[int], dict[str, Any]], seeds: range, out: Path, workers: int
) -> list[dict[str, Any]]:
    """Return the rows of a file, after those of the seeds that it lacked were added."""
    known = out.read_text("utf-8").splitlines() if out.exists() else []
    rows = [json.loads(line) for line in known]
    done = {row["seed"] for row in rows}
    with out.open("a", encoding="utf-8") as file:
        left = [seed for seed in seeds if seed not in done]
        for _, row in each(work, left, workers=workers):
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    return rows


def main() -> None:
    """Walk what the file lacks, print the table; 1 after a false trip or a missed fault."""
    about = __doc__.split("\n\n")[0]
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hard_walks", description=about)
    parser.add_argument("--walks", type=int, default=1000)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--planted", action="store_true")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("walks.jsonl"))
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.walks)
    work = partial(walked, is_planted=given.planted)
    rows = kept_rows(work, seeds, given.out, given.workers)
    print(table(rows))
    print(Counter(row["trip"] for row in rows if row["trip"]).most_common(40))
    bad = [row for row in rows if (not row.get("found", True) if given.planted else is_false(row))]
    for row in bad:
        print(row)
    raise SystemExit(int(bool(bad)))


if __name__ == "__main__":
    main()
