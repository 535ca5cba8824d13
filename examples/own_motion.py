"""Move the body by a motion source of your own: over the physics, or on servos.

python examples/own_motion.py --amplitude 0.3
python examples/own_motion.py --port /dev/ttyUSB0 --out runs/own
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import snakewalk as sw


class Wave:
    """A wave that travels along the body, faster and faster in the first second."""

    needs, done = sw.Needs(yaw=True, wheels=True), False

    def __init__(self, robot: sw.RobotConfig, amplitude_rad: float, rate_rad_s: float) -> None:
        self._phase_rad = -2.0 * np.pi * np.arange(robot.joint_count) / robot.joint_count
        self._amplitude, self._rate_max, self._rate = amplitude_rad, rate_rad_s, 0.0

    def goal_rad(self) -> np.ndarray:
        return np.asarray(self._amplitude * np.sin(self._phase_rad))

    def velocity_rad_s(self) -> np.ndarray:
        return np.asarray(self._amplitude * self._rate * np.cos(self._phase_rad))

    def pace(self) -> sw.Pace:
        fastest = np.full(len(self._phase_rad), self._amplitude * self._rate_max)
        return sw.Pace(fastest, fastest * (self._rate_max + 1.0))

    def step(self, dt_s: float, view: sw.BodyView) -> np.ndarray:
        self._rate = min(self._rate + self._rate_max * dt_s, self._rate_max)
        self._phase_rad = self._phase_rad + self._rate * dt_s
        return self.goal_rad()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--amplitude", type=float, default=0.4, help="rad")
    options.add_argument("--port", help="of the servos; without it, the simulator")
    options.add_argument("--out", type=Path, help="folder of the log; without it, a temporary one")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            prepared = sw.prepare_source(lambda robot: Wave(robot, given.amplitude, 3.0), seconds=8)
            finished = sw.run_robot(sw.RunRequest(prepared, given.out or Path(folder), given.port))
        except sw.InputError as error:  # nothing has moved yet
            raise SystemExit(str(error)) from None
    print(f"the body went {finished.summary.travelled_m:.2f} m in {finished.summary.cycles} cycles")
    if given.out:
        print(f"snakewalk log report {finished.log}")


if __name__ == "__main__":
    main()
