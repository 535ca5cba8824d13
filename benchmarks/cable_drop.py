"""``python -m benchmarks.cable_drop``: cables of a simulated chain, found by the doctor's wiggle.

Each seed lays cables of 0.015 to 0.06 ohm, each by up to 20 % off, feeds the chain at its head, its
tail, both ends or its middle, and bends the body; every second one has a bad plug of 0.3 to 0.8 ohm
in one place. Judged are the mean of the good cables, the bad one, and cables that are called bad
and are not.
"""

import argparse

import numpy as np
from rich.console import Console
from rich.table import Table

from snakewalk.config.loader import load_robot, load_world, with_keys
from snakewalk.config.robot import PowerConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.bench import cable_drop, supply_check
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import Mounting
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.protection import SupplyAndAmbient
from snakewalk.sim.servo.supply import Cabling

FED = ((1,), (16,), (1, 16), (8,))


def main() -> None:
    """Print one row of counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="alternating16", help="of 16 servos with IDs 1 to 16")
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--seeds", type=int, default=40)
    asked = parser.parse_args()
    counts = np.array(
        [
            tried(asked.robot, seed)
            for seed in range(asked.first_seed, asked.first_seed + asked.seeds)
        ]
    ).sum(axis=0)
    names = ("chains", "mean inside", "bad plugs", "named", "its ohm inside", "wrongly named")
    table = Table(*names, box=None)
    table.add_row(*map(str, counts))
    Console().print(table)


def tried(name: str, seed: int) -> tuple[int, int, int, int, int, int]:
    """One chain: 1, and 1 or 0 for each count."""
    rng = np.random.default_rng(seed)
    cable_ohm = rng.uniform(0.015, 0.06) * rng.uniform(0.8, 1.2, 15)
    bad = int(rng.integers(15)) if seed % 2 else None
    usual_ohm = float(cable_ohm.mean() if bad is None else np.delete(cable_ohm, bad).mean())
    if bad is not None:
        cable_ohm[bad] = rng.uniform(0.3, 0.8)
    power = PowerConfig(cables_ohm=tuple(cable_ohm), inject_ids=FED[seed // 2 % len(FED)])
    robot = with_keys(load_robot(name), {"power": power.model_dump()}, "benchmark")
    plant = MujocoPlant(robot, load_world("flat"))
    plant.reset((0.0, 0.0), 0.0, rng.uniform(-0.4, 0.4, 16))
    bank = ServoBank(robot.servo_ids, robot.servo_records, robot.servo.baud)
    supply = SupplyAndAmbient.of(robot)
    line = SimLine(bank, plant, mounting=Mounting.of(robot), supply_and_ambient=supply)
    bus = DynamixelBus(line, robot.models_by_id)
    wiggled = supply_check.wiggle(bus, robot, SafetyConfig())
    leads = Cabling.of(robot, PowerConfig(inject_ids=power.inject_ids))
    found = cable_drop.estimate_cables(wiggled.voltage_v, wiggled.drawn_a, leads)
    named = bad in found.bad
    inside = bad is not None and found.low_ohm[bad] <= cable_ohm[bad] <= found.high_ohm[bad]
    return (
        1,
        int(found.usual_low_ohm <= usual_ohm <= found.usual_high_ohm),
        int(bad is not None),
        int(named),
        int(inside),
        len(set(found.bad) - {bad}),
    )


if __name__ == "__main__":
    main()
