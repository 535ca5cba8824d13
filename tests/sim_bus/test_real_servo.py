"""The servo model against recordings of a real XL330 that swings a pendulum (Rhoban, bam)."""

import json
from pathlib import Path

import numpy as np
import pytest

from sim.bus.bench import BenchPlant
from sim.bus.motor import MOTORS, PWM_FULL, make_drive, p_gain_per_rad

XL330 = MOTORS["XL330-M288"]
MASS_KG, ARM_M = 0.49, 0.10


def recording(folder: Path, name: str) -> tuple[int, dict[str, np.ndarray]]:
    log = json.loads((folder / "xl330-logs" / f"{name}.json").read_text())
    keys = (
        "timestamp",
        "goal_position",
        "position",
        "speed",
        "load",
        "input_volts",
        "torque_enable",
    )
    columns = {key: np.array([entry[key] for entry in log["entries"]], float) for key in keys}
    columns["load"][columns["load"] > 32_767] -= 65_536
    return int(log["kp"]), columns


@pytest.mark.parametrize(
    "name", ["kp200_lift_and_drop", "kp400_lift_and_drop", "kp800_up_and_down"]
)
def test_output_register_follows_the_error_at_the_models_gain(shared_data: Path, name: str) -> None:
    gain, log = recording(shared_data, name)
    error_rad = log["goal_position"] - log["position"]
    fit = (log["torque_enable"] > 0) & (np.abs(log["load"]) < 800)
    slope = (error_rad[fit] @ log["load"][fit]) / (error_rad[fit] @ error_rad[fit])
    assert slope == pytest.approx(p_gain_per_rad(gain, XL330) * PWM_FULL, rel=0.02)
    assert np.abs(log["load"]).max() <= PWM_FULL


@pytest.mark.parametrize(
    ("name", "rms_rad"), [("kp200_lift_and_drop", 0.10), ("kp200_sin_sin", 0.12)]
)
def test_bench_follows_the_recorded_pendulum(shared_data: Path, name: str, rms_rad: float) -> None:
    gain, log = recording(shared_data, name)
    plant = BenchPlant(
        1,
        inertia_kg_m2=MASS_KG * ARM_M**2 + 1.8e-3,
        load_n_m=lambda q: -MASS_KG * 9.81 * ARM_M * np.sin(q),
        start_rad=log["position"][0],
    )
    drive = make_drive([XL330], 7.4)
    drive.p_gain_per_rad[:] = p_gain_per_rad(gain, XL330)
    time_s = log["timestamp"] - log["timestamp"][0]
    simulated = np.empty_like(time_s)
    for k, until_s in enumerate(np.append(time_s[1:], time_s[-1])):
        simulated[k] = plant.position_rad[0]
        drive.torque_on[:] = log["torque_enable"][k]
        drive.goal_rad[:] = log["goal_position"][k]
        drive.supply_v[:] = log["input_volts"][k]
        plant.advance(until_s, drive)
    driven = log["torque_enable"] > 0
    off = (simulated - log["position"])[driven]
    lag = (log["goal_position"] - log["position"])[driven]
    assert np.sqrt(np.mean(off**2)) < rms_rad < 0.25 * np.sqrt(np.mean(lag**2))
