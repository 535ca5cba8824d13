"""Small files of other programs, written by a few lines each."""

from pathlib import Path

import numpy as np

from snakewalk.config.loader import load_robot

NAMES = load_robot("yaw16").joint_names
TIME_S = np.arange(100) / 50.0
ANGLES = 0.3 * np.sin(2.0 * np.pi * (0.5 * TIME_S[:, None] - np.arange(len(NAMES)) / 10.0))
"""(T, J) joint angles, rad."""


def joint_csv(
    file: Path, unit: str = "deg", time: str = "time_s", time_factor: float = 1.0
) -> Path:
    """Write joint angles in degrees, whatever unit the names of the columns state."""
    names = [f"{name}_{unit}" if unit else name for name in NAMES]
    rows = [[time, *names]]
    for moment, row in zip(TIME_S, np.degrees(ANGLES), strict=True):
        rows.append([f"{time_factor * moment:.5f}", *(f"{angle:.5f}" for angle in row)])
    file.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return file


def midlines(
    file: Path, columns: tuple[str, str] = ("x_m", "y_m"), factor: float = 1.0,
    time_factor: float = 1.0, rate_hz: float = 30.0,
) -> Path:  # fmt: skip
    """Write the midlines of a body of about 1 m with a wave of 1 Hz that runs to its tail."""
    rows = [",".join(["t", "frame", "point", *columns])]
    for frame in range(90):
        time_s = frame / rate_hz
        x = np.linspace(0.0, -1.0, 12)
        y = 0.1 * np.sin(2.0 * np.pi * (time_s + 1.5 * x))
        rows += [
            f"{time_factor * time_s:.6f},{frame},{k + 1},{factor * x[k]:.6f},{factor * y[k]:.6f}"
            for k in range(12)
        ]
    file.write_text("\n".join(rows) + "\n")
    return file


def points(file: Path) -> Path:
    """Write a ground of 20 by 20 in the file's unit."""
    rows = [f"{x} {y} {0.1 * x * y / 20:.4f}" for x in range(21) for y in range(21)]
    file.write_text("\n".join(rows) + "\n")
    return file


def massless_urdf(file: Path) -> Path:
    """Write a chain of three links that state no mass."""
    shape = '<visual><origin xyz="0.05 0 0" rpy="0 1.5707963267948966 0"/>'
    shape += '<geometry><cylinder radius="0.02" length="0.1"/></geometry></visual>'
    links = "".join(f'<link name="l{k}">{shape}</link>' for k in range(3))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0.1 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" '
        f'velocity="3"/></joint>'
        for k in range(2)
    )
    file.write_text(f'<robot name="snake">{links}{joints}</robot>')
    return file
