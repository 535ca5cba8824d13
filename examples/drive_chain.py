"""Drive a chain of servos through the safety layer, simulated or on a serial port.

python examples/drive_chain.py --seconds 4
python examples/drive_chain.py --robot my-robot.toml --port /dev/ttyUSB0
"""

import argparse

import numpy as np

import snakewalk as sw


def main() -> None:
    """Swing all joints as a wave and print how far the measured angles are behind."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--robot", default="yaw16", help="name of a shipped robot, or a TOML file")
    options.add_argument("--port", help="serial device; without it the servos are simulated")
    options.add_argument("--seconds", type=float, default=2.0)
    options.add_argument("--amplitude", type=float, default=0.3, help="rad")
    given = options.parse_args()

    robot = sw.load_robot(given.robot)
    budget = sw.wire_budget(robot.joint_count, robot.servo.baud, fast=True)
    print(f"{robot.joint_count} servos: at most {budget.limit_hz:.0f} cycles a second")
    ids = ",".join(str(each) for each in robot.servo_ids)
    port: sw.BytePort = (
        sw.SerialPort(given.port, robot.servo.baud)
        if given.port
        else sw.ServoBus(f"{ids}:{robot.servo.model}", baud=robot.servo.baud).line
    )
    chain = sw.ServoChain(sw.DynamixelBus(port, robot.servo.model), robot)
    limits = sw.SafetyLimits.from_config(robot, sw.SafetyConfig())
    lag_rad = 0.0
    # leaving the context switches torque off, whatever happens
    with sw.SafeLink(chain, limits, chain.clock) as link:
        start = link.enable()
        begin_s = chain.clock.now_s()
        for tick in sw.ticks(chain.clock, period_s=0.02, until_s=begin_s + given.seconds):
            state = link.read()
            time_s = tick.deadline_s - begin_s
            wave = np.sin(np.pi * time_s - 0.6 * np.arange(robot.joint_count))
            goal = start.position_rad + given.amplitude * min(time_s, 1.0) * wave
            link.write(sw.JointCommand(chain.clock.now_s(), goal))
            lag_rad = max(lag_rad, float(np.abs(goal - state.position_rad).max()))
        print(f"largest lag {lag_rad:.3f} rad; {'tripped' if link.tripped else 'no trip'}")


if __name__ == "__main__":
    main()
