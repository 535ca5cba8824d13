"""Scripted calibrations on a busy machine: how many answers of the user are lost.

Three simulated servos; replies and requests get lost, replies are damaged and late, the program
stands still eight times, one servo is silent for a while. Deterministic: the seed of each
calibration is its number.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from benchmarks.rows import Row
from snakewalk.config.errors import InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.controller.bench.calibration.chain_calibration import CalibrationSettings, calibrate
from snakewalk.controller.bench.calibration.progress import SeenBend
from snakewalk.drivers.errors import DriverError
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import Mounting
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

TITLE = "Calibrations on a busy machine"

LIKE = RobotConfig(name="trio", joint_axes="ypy")
TRUTH = LIKE.model_copy(
    update={
        "joints": (
            JointConfig(id=9, zero_rad=0.2),
            JointConfig(id=30, sign=-1, zero_rad=-0.3),
            JointConfig(id=4, sign=-1),
        )
    }
)
SEEDS = range(20)
SWEPT_S, ASKED_S = 40.0, 14.0
"""Duration of a calibration with and without the sweep, in which the program stands still."""


@dataclass
class Script:
    """An observer that gives the right answers, and keeps the questions."""

    asked: list[int] = field(default_factory=list)

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> SeenBend:
        """Answer from the truth."""
        wiggle()
        self.asked.append(servo_id)
        joint = TRUTH.servo_ids.index(servo_id)
        return SeenBend(joint=joint, direction=TRUTH.signs[joint])

    def straighten(self) -> None:
        """Leave the body as it is."""


@dataclass(frozen=True)
class BusyCalibration:
    """Result of one calibration."""

    lost: int
    """Answers that were given and are not in a robot file, or were asked for twice."""
    is_right: bool
    """Whether it ended with the right IDs, signs and limits."""
    repeated: int
    """Motions that were repeated because the line lost replies."""


def faults(seed: int, last_s: float) -> FaultPlan:
    """Losses, damage, delays and stalls of a busy machine."""
    rng = random.Random(seed)
    tables: list[dict[str, object]] = [
        {"kind": "drop", "chance": 0.03, "of": "both"},
        {"kind": "corrupt", "chance": 0.02},
        {"kind": "delay", "chance": 0.05, "by_s": 0.03},
    ]
    tables += [{"kind": "stall", "at_s": rng.uniform(1, last_s), "for_s": 0.6} for _ in range(8)]
    tables.append({"kind": "mute", "ids": [9], "at_s": rng.uniform(2, last_s / 2), "for_s": 0.8})
    return FaultPlan.model_validate({"seed": seed, "fault": tables})


def calibrated(seed: int, *, sweep: bool = True) -> BusyCalibration:
    """Calibrate once."""
    bank = ServoBank(TRUTH.servo_ids, TRUTH.servo_models)
    line = SimLine(bank, BenchPlant(3), mounting=Mounting.of(TRUTH))
    FaultPlayer(line, faults(seed, SWEPT_S if sweep else ASKED_S))
    script, lines = Script(), list[str]()
    try:
        found = calibrate(
            line,
            LIKE,
            script,
            name="trio",
            settings=CalibrationSettings(latency_s=0.02, sweep=sweep),
            on_progress=lines.append,
        ).robot
    except (DriverError, InputError):
        return BusyCalibration(len(script.asked), False, 0)
    is_right = (found.servo_ids, found.signs) == (TRUTH.servo_ids, TRUTH.signs)
    is_right &= found.limit_rad == TRUTH.limit_rad
    repeated = sum("repeated" in line for line in lines)
    return BusyCalibration(len(script.asked) - len(set(script.asked)), is_right, repeated)


def run() -> list[Row]:
    """Measure."""
    results = [calibrated(seed) for seed in SEEDS]
    lost = sum(each.lost for each in results)
    wrong = sum(not each.is_right for each in results)
    return [
        Row("answers lost", lost, "", ratio=lost, target=0.0),
        Row("wrong or broken off", wrong, "", ratio=wrong, target=0.0),
        Row("motions repeated", sum(each.repeated for each in results), ""),
    ]
