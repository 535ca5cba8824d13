"""Energy of the motors, integrated and sampled, and what smoother goals would save.

    python -m benchmarks.energy --write

Each motion runs three times: with a goal held from cycle to cycle at 50 Hz and at 100 Hz, and with
the servos' own time-based profile, which runs to each goal in the 20 ms until the next one. Printed
are the electrical cost of transport, integrated in every physics step; the same from the current
and speed that each cycle reads, over the integrated one; the highest current of a joint, as read
and of all physics steps; and the lag of the joints.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from benchmarks.command_facts import markdown
from benchmarks.provenance import provenance, write_tables
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.metrics.effort import energy_track, sampled_energy
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.chain.start_up import ServoSettings, configure
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive

RUN_S = 12.0
PROFILE_MS = 20
HEAD = (
    *("motion", "cost", "by samples", "peak A, read", "true", "lag, ms"),
    *("100 Hz: cost", "lag", "profile of 20 ms: cost", "lag"),
)
TIME_BASED = 0x04
"""Drive Mode(10), bit 2."""


def main() -> None:
    """Run all gaits, and walk and serpenoid on the square; print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="replace the table of the page")
    write = parser.parse_args().write
    rows = []
    for name, prepared in jobs():
        with currents() as peak_a:
            held = finish(prepared)
        often = finish(at_rate(prepared, 100.0))
        with profiles():
            smooth = finish(prepared)
        share = (
            sampled_energy(held.record).electrical_j[-1]
            / energy_track(held.record).between(0.0, held.record.end_s)[0]
        )
        cells = [name, cost(held), f"{share:.2f}"]
        cells += [f"{held.summary.peak_current_a:.2f}", f"{peak_a[0]:.2f}", lag_ms(held)]
        cells += [cost(often), lag_ms(often), cost(smooth), lag_ms(smooth)]
        rows.append(cells)
        print(*cells, sep=" | ", flush=True)
    if write:
        source = provenance("python -m benchmarks.energy --write")
        write_tables("gaits", "energy", f"{markdown(HEAD, rows)}\n\n{source}")


def jobs() -> Iterator[tuple[str, PreparedRun]]:
    """Names and runs."""
    for name in GAITS:
        yield name, prepare_gait(name, seconds=RUN_S)
    for motion in ("walk", "serpenoid"):
        yield f"flat-square, {motion}", prepare_walk("flat-square", motion=motion)


def at_rate(prepared: PreparedRun, hz: float) -> PreparedRun:
    """The same run with another rate of its control loop."""
    run = prepared.run.model_copy(update={"cycle_hz": hz})
    return replace(prepared, run=run)  # type: ignore[type-var]


def finish(prepared: PreparedRun) -> RunResult:
    """Run it; its log is not kept."""
    with TemporaryDirectory() as folder:
        return run_robot(RunRequest(prepared, Path(folder)))


@contextmanager
def currents() -> Iterator[list[float]]:
    """Highest currents of the plants that run meanwhile, of all their steps."""
    advance = MujocoPlant.advance
    peak_a = [0.0]

    def stepwise(plant: MujocoPlant, until_s: float, drive: ServoDrive) -> None:
        while plant.time_s + plant.step_s <= until_s + 1e-9:
            advance(plant, plant.time_s + plant.step_s, drive)
            peak_a[0] = max(peak_a[0], float(np.abs(drive.current_a).max()))

    with patch.object(MujocoPlant, "advance", stepwise):
        yield peak_a


@contextmanager
def profiles() -> Iterator[None]:
    """Servos that run to each goal along a rectangular profile of 20 ms."""

    def with_profile(
        bus: DynamixelBus,
        robot: RobotConfig,
        units: JointUnits,
        joints: Iterable[int] | None = None,
        on_event: Callable[[str], None] = lambda line: None,
    ) -> dict[int, ServoSettings]:
        some = list(range(robot.joint_count) if joints is None else joints)
        values = configure(bus, robot, units, some, on_event)
        for joint in some:
            bus.write_verified(robot.servo_ids[joint], "Drive Mode", TIME_BASED)
            bus.write_verified(robot.servo_ids[joint], "Profile Velocity", PROFILE_MS)
        profile, mode = {"Profile Velocity": PROFILE_MS}, {"Drive Mode": TIME_BASED}
        return {
            joint: ServoSettings({**each.ram, **profile}, {**each.fingerprint, **mode})
            for joint, each in values.items()
        }

    with patch("snakewalk.drivers.chain.servo_chain.configure", with_profile):
        yield


def cost(finished: RunResult) -> str:
    """Electrical cost of transport."""
    value = finished.summary.electrical_cost_of_transport
    return "" if value is None else f"{value:.3g}"


def lag_ms(finished: RunResult) -> str:
    """Lag of the measured behind the sent angles."""
    value = finished.summary.lag_s
    return "" if value is None else f"{1e3 * value:.0f}"


if __name__ == "__main__":
    main()
