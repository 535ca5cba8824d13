"""Read a run's log: what was asked, sent and measured, and the numbers of the run.

python examples/read_log.py                        # makes a short run first
python examples/read_log.py runs/flat-slalom-walk-seed0/log.mcap
"""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import snakewalk as sw


def show(log: Path) -> None:
    """Print how each joint followed its goals, and what happened."""
    record = sw.read_log(log)
    cycle = record.cycle
    lag_rad = np.abs(cycle.sent_rad - cycle.measured_rad).max(axis=0)
    print(f"{record.header.run.name}: {len(cycle.time_s)} cycles on {record.header.backend}")
    for joint, (lag, current) in enumerate(
        zip(lag_rad, np.abs(cycle.current_a).max(axis=0), strict=True), start=1
    ):
        print(f"joint {joint:2}: lag at most {lag:.3f} rad, current {current:.2f} A")
    for event in record.events:
        print(f"{event.time_s:6.2f} s  {event.kind}: {event.text}")
    numbers = sw.summary(record)
    print(f"outcome: {numbers.outcome}; speed {numbers.speed_m_s} m/s")


def main() -> None:
    """Show a log, or that of a short run."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("log", nargs="?", type=Path, help="log.mcap of a run")
    given = options.parse_args()
    if given.log is not None:
        return show(given.log)
    with TemporaryDirectory() as folder:
        prepared = sw.prepare_gait("lateral-undulation", seconds=2.0)
        return show(sw.run_robot(sw.RunRequest(prepared, Path(folder))).log)


if __name__ == "__main__":
    main()
