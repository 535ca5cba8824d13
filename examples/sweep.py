"""Measure gaits over their parameters on the simulated robot, on two processes.

python examples/sweep.py
python examples/sweep.py --gait rolling --gait sidewinding --points 20 --seconds 12
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import snakewalk as sw


def main() -> None:
    """Print a line for each point."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument(
        "--gait", action="append", choices=sorted(sw.GAITS), help="default: rolling"
    )
    options.add_argument("--robot", default="alternating16")
    options.add_argument("--points", type=int, default=2, help="of each gait; the first: defaults")
    options.add_argument("--seconds", type=float, default=4.0, help="of each run")
    given = options.parse_args()

    planned = sw.plan_sweep(
        given.gait or ["rolling"], [given.robot], given.points, seed=0, seconds=given.seconds
    )
    for line in planned.left_out:
        print("left out:", line)
    # fresh interpreters: a fork would copy the threads of the physics in whatever state they are
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for point, row in zip(planned.points, pool.map(sw.measure, planned.points), strict=True):
            values = ", ".join(f"{name} {value}" for name, value in point.parameters.items())
            print(f"{point.gait}: {row.speed_m_s} m/s, {row.ended} ({values or 'defaults'})")


if __name__ == "__main__":
    main()
