"""Whether [PT]'s speed law holds for a recorded run of the robot, beside speed over pulse speed.

Run: .venv/bin/snakewalk run flat-square --no-film --out runs/law
     .venv/bin/python benchmarks/speed_law.py runs/law/log.mcap
"""

import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.controller.mechanics.speed_law import identify
from snakewalk.controller.runlog.reader import read_log

SMOOTH_S, START_S, END_S, EVERY_S = 1.0, 4.0, 3.0, 0.5


def main(log: Path) -> None:
    pose = read_log(log).pose
    dt = float(np.median(np.diff(pose.time_s)))

    def smooth(values: np.ndarray) -> np.ndarray:
        return gaussian_filter1d(values, SMOOTH_S / dt)

    step = pose.links_m[:, :-1, :2] - pose.links_m[:, 1:, :2]
    angles = np.unwrap(np.arctan2(step[..., 1], step[..., 0]), axis=1)
    heading = np.unwrap(angles.mean(axis=1))
    used = slice(int(START_S / dt), -int(END_S / dt), max(1, int(EVERY_S / dt)))
    bend = smooth(angles.std(axis=1))[used]
    turn = np.gradient(smooth(heading), pose.time_s)[used]
    speed, pulse = smooth(pose.speed_m_s)[used], smooth(pose.pulse_m_s)[used]

    found = identify(bend, turn, speed)
    gain = float(pulse @ speed / (pulse @ pulse))
    print(f"{len(speed)} samples: speed {speed.mean():.3f} m/s, spread {speed.std():.3f}")
    print(f"K {bend.mean():.2f} rad, pulse {pulse.mean():.3f} m/s")
    print(f"speed law: {found.law}")
    print(f"  explains {found.explained:.2f} of the variance, rms {found.rms_m_s2:.3f} m/s")
    print(f"v = {gain:.2f} u: rms {np.sqrt(np.mean((speed - gain * pulse) ** 2)):.3f} m/s")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
