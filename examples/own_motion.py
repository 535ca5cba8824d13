"""Move the joints by a motion source of your own, on simulated servos.

python examples/own_motion.py --angle 0.8
"""

import argparse

import numpy as np

import snakewalk as sw


class Nod:
    """Bends the middle joint and straightens it again; implements ``MotionSource``."""

    needs, done = sw.Needs(yaw=True), False

    def __init__(self, robot: sw.RobotConfig, angle_rad: float) -> None:
        self._bend_rad: np.ndarray = np.eye(robot.joint_count)[7] * angle_rad
        self._rate = robot.joint_speed_limit_rad_s / abs(angle_rad)  # half of the limit is used
        self._time_s = 0.0

    def goal_rad(self) -> np.ndarray:
        return np.asarray(self._bend_rad * 0.5 * (1.0 - np.cos(self._rate * self._time_s)))

    def velocity_rad_s(self) -> np.ndarray:
        return np.asarray(self._bend_rad * 0.5 * self._rate * np.sin(self._rate * self._time_s))

    def pace(self) -> sw.Pace:
        fastest = 0.5 * np.abs(self._bend_rad) * self._rate
        return sw.Pace(fastest, fastest * self._rate)

    def step(self, dt_s: float, view: sw.BodyView) -> np.ndarray:
        self._time_s = min(self._time_s + dt_s, 2.0 * np.pi / self._rate)
        self.done = self._rate * self._time_s >= 2.0 * np.pi
        return self.goal_rad()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--angle", type=float, default=0.6, help="rad")
    angle_rad = options.parse_args().angle
    robot, bus = sw.load_robot("yaw16"), sw.ServoBus("1-16")
    chain = sw.ServoChain(sw.DynamixelBus(bus.line), robot)
    source: sw.MotionSource = Nod(robot, angle_rad)
    head = sw.BodyPose(0.0, np.zeros(3), np.eye(3))  # on a bench nothing measures it
    limits = sw.SafetyLimits.from_config(robot, sw.SafetyConfig())
    with sw.SafeLink(chain, limits, chain.clock) as link:
        link.enable()
        for _ in sw.ticks(chain.clock, period_s=0.02, until_s=60.0):
            view = sw.body_in_world(robot, head, link.read().position_rad)
            link.write(sw.JointCommand(chain.clock.now_s(), source.step(0.02, view)))
            if source.done:
                break
    print(f"joint 8 bent by {angle_rad} rad and back, {chain.clock.now_s():.2f} s in simulation")


if __name__ == "__main__":
    main()
