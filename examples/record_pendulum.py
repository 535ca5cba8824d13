"""Record a servo that swings a weight on an arm, for ``snakewalk robot identify``.

The weight (kg) hangs still on its arm (length in m) at the start. Torque is off in the last 2 s.
python examples/record_pendulum.py --port /dev/ttyUSB0 --id 1 --kp 400 --out kp400.json
"""

import argparse
import json
import math

import snakewalk as sw

RAD = math.tau / 4096  # of a position
OPTIONS = {"model": "XL330-M288", "id": 1, "mass": 0.49, "length": 0.10, "kp": 400, "out": ""}
BEFORE = {"Torque Enable": 0, "Operating Mode": 3, "Position I Gain": 0, "Position D Gain": 0}
PROFILE = {"Profile Acceleration": 0, "Profile Velocity": 0, "Bus Watchdog": 0}


def record(bus: sw.DynamixelBus, servo_id: int, kp: int, seconds: float) -> list[dict[str, float]]:
    """Swing by 1.2 rad around the angle at which the weight hangs; return the entries."""
    zero = goal = bus.read(servo_id, "Present Position")
    start = {"Position P Gain": kp, "Goal Position": zero, "Bus Watchdog": 25, "Torque Enable": 1}
    clock, entries, torque = bus.port.clock, [], 1
    try:
        for name, value in (*BEFORE.items(), *PROFILE.items(), *start.items()):
            bus.write(servo_id, name, value)
        begin_s = clock.now_s()
        for _ in sw.ticks(clock, 0.01, begin_s + seconds):
            shown = bus.read_each(servo_id, ("Present Position", "Present Input Voltage"))
            time_s = clock.now_s() - begin_s
            if time_s > 0.75 * seconds and torque:
                torque = 0
                bus.write(servo_id, "Torque Enable", 0)
            elif torque:  # the last second before torque goes off holds the arm up
                wave = math.sin(2.0 * time_s) * math.cos(5.1 * time_s)
                goal = zero + round(1.2 * (1 if time_s > 0.75 * seconds - 1 else wave) / RAD)
                bus.write(servo_id, "Goal Position", goal)
            entry = {"timestamp": time_s, "goal_position": (goal - zero) * RAD}
            entry |= {"position": (shown["Present Position"] - zero) * RAD, "torque_enable": torque}
            entries.append(entry | {"input_volts": shown["Present Input Voltage"] / 10.0})
    finally:
        bus.write(servo_id, "Torque Enable", 0)
        bus.write(servo_id, "Bus Watchdog", 0)
    return entries


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--port", help="serial device; without it the servo is simulated")
    for name, value in OPTIONS.items():
        options.add_argument(f"--{name}", type=type(value), default=value, help=f"{value or '-'}")
    use = options.parse_args()
    line = sw.SerialPort(use.port) if use.port else sw.ServoBus(f"{use.id}:{use.model}").line
    log = {"motor": use.model, "mass": use.mass, "length": use.length, "kp": use.kp}
    log["entries"] = record(sw.DynamixelBus(line, use.model), use.id, use.kp, 8.0)
    if use.out:
        with open(use.out, "w", encoding="utf-8") as file:
            json.dump(log, file)
    print(f"{len(log['entries'])} entries; file: {use.out or 'none, see --out'}")
