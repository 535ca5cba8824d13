"""Run a gait on the simulated robot's joints and change its parameters while it runs.

python examples/live_gait.py
python examples/live_gait.py --gait sidewinding --robot alternating16 --to frequency_hz=0.3
"""

import argparse

import numpy as np

import snakewalk as sw


def main() -> None:
    """Run, change a parameter halfway, stop, and print the speed of the joints in each phase."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--gait", default="lateral-undulation", choices=sorted(sw.GAITS))
    options.add_argument("--robot", default="yaw16")
    options.add_argument("--seconds", type=float, default=4.0, help="before and after the change")
    options.add_argument("--to", default="frequency_hz=0.8", metavar="NAME=VALUE")
    given = options.parse_args()

    robot = sw.load_robot(given.robot)
    motion = sw.GaitMotion(sw.make_gait(given.gait), robot)
    head = sw.BodyPose(0.0, np.zeros(3), np.eye(3))

    def run(seconds: float) -> float:
        """Step the gait and return the largest speed of a joint, rad/s."""
        fastest = 0.0
        for _ in range(round(seconds * 50)):
            view = sw.body_in_world(robot, head, motion.goal_rad())
            motion.step(0.02, view)
            fastest = max(fastest, float(np.abs(motion.velocity_rad_s()).max()))
        return fastest

    print(f"{motion.frequency_hz:.2f} Hz: {run(given.seconds):.2f} rad/s")
    name, _, value = given.to.partition("=")
    joined_s = motion.change(**{name: float(value)})
    print(f"{given.to} in force after {joined_s:.2f} s")
    during = run(joined_s)
    print(f"meanwhile {during:.2f} rad/s, limit {robot.joint_speed_limit_rad_s:.2f}")
    print(f"{motion.frequency_hz:.2f} Hz: {run(given.seconds):.2f} rad/s")
    motion.stop()
    run(2.0)
    print("at rest" if motion.done else "still moving")


if __name__ == "__main__":
    main()
