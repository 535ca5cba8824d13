"""The simulated XL330 against recordings of a real one with a pendulum; each term's share.

    python benchmarks/pendulum.py ../shared/data/xl330-logs

Prints the RMS of position while torque is on (and off), rad, for the plain data-sheet motor, for
the shipped constants, and for these with one term of friction left out at a time.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import GEARBOXES, MOTORS, Gearbox, make_drive, p_gain_per_rad

Floats = NDArray[np.float64]
MASS_KG, ARM_M = 0.49, 0.10  # SOURCE.txt of the recordings
GEAR = GEARBOXES["XL330-M288"]
KEYS = ("timestamp", "goal_position", "position", "input_volts", "torque_enable")


def recording(path: Path) -> tuple[int, dict[str, Floats]]:
    """P gain, and columns by name."""
    log = json.loads(path.read_text())
    return int(log["kp"]), {
        key: np.array([entry[key] for entry in log["entries"]], float) for key in KEYS
    }


def simulate(gain: int, log: dict[str, Floats], gear: Gearbox | None) -> Floats:
    """Position at the recording's times, under its goals and its supply."""
    motor = MOTORS["XL330-M288"]
    plant = BenchPlant(
        1,
        inertia_kg_m2=MASS_KG * ARM_M**2,
        dry_n_m=0.0,
        load_n_m=lambda q: -MASS_KG * GRAVITY_M_S2 * ARM_M * np.sin(q),
        start_rad=log["position"][0],
        gear=gear,
    )
    drive = make_drive([motor], 7.4)
    drive.p_gain_per_rad[:] = p_gain_per_rad(gain, motor)
    time_s = log["timestamp"] - log["timestamp"][0]
    simulated = np.empty_like(time_s)
    for k, until_s in enumerate(np.append(time_s[1:], time_s[-1])):
        simulated[k] = plant.position_rad[0]
        drive.torque_on[:] = log["torque_enable"][k]
        drive.goal_rad[:] = log["goal_position"][k]
        drive.supply_v[:] = log["input_volts"][k]
        plant.advance(until_s, drive)
    return np.asarray(simulated)


def errors(path: Path, gear: Gearbox | None) -> tuple[float, float]:
    """RMS with torque on and with torque off (NaN: never off), rad."""
    gain, log = recording(path)
    off = (simulate(gain, log, gear) - log["position"]) ** 2
    on = log["torque_enable"] > 0
    free = float(np.sqrt(off[~on].mean())) if (~on).any() else float("nan")
    return float(np.sqrt(off[on].mean())), free


VARIANTS: dict[str, Gearbox | None] = {
    "plain P and back-EMF": None,
    "shipped": GEAR,
    "without rotor inertia": replace(GEAR, armature_kg_m2=0.0),
    "without dry friction": replace(GEAR, dry_n_m=0.0),
    "without viscous friction": replace(GEAR, viscous_n_m_s=0.0),
    "without Stribeck friction": replace(GEAR, stribeck_n_m=0.0),
    "without friction by motor torque": replace(GEAR, by_motor=0.0),
    "without friction by load torque": replace(GEAR, by_load=0.0, by_load_slow=0.0),
    "the same, of a slow shaft only": replace(GEAR, by_load_slow=0.0),
}


def main() -> None:
    paths = sorted(Path(sys.argv[1]).glob("kp*.json"))
    print(f"{'':34}" + "".join(f"{path.stem[2:]:>22}" for path in paths) + "   mean on")
    for name, gear in VARIANTS.items():
        found = [errors(path, gear) for path in paths]
        shown = "".join(f"{on:13.3f} ({free:5.3f})  " for on, free in found)
        print(f"{name:34}{shown}{np.mean([on for on, _ in found]):8.3f}")


if __name__ == "__main__":
    main()
