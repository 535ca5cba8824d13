"""Steepest plane on which a wave climbs, by the balance of friction and gravity, for each law.

Serpenoid waves of 16 links travel tailwards along a body whose mean line points uphill. At each
phase the links' friction balances the pull of the slope. The bound is the steepest slope at which
some amplitude and number of waves still advance by a twentieth of the pulse. Mass, torque and roll
of a real body are left out, so the bound is an upper one.

python -m benchmarks.slope_bound
"""

import math
from typing import Final

import numpy as np

from snakewalk.config.friction_law import LAWS, LawName
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import NoBalanceError, rigid_velocity

LINKS: Final = 16
PHASES: Final = 12
AMPLITUDES_RAD: Final = (0.5, 0.7, 0.9, 1.1, 1.3, 1.5)
WAVES: Final = (1.0, 1.5, 2.0)
ALONG: Final = 0.1
ACROSS: Final = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
LEAST: Final = 0.05
HALVINGS: Final = 7


def advance(
    slope_rad: float, amplitude_rad: float, waves: float, friction: FrictionConfig, aim_rad: float
) -> float:
    """Mean speed along the aim over the speed of the pulse; the aim is 0 straight uphill."""
    tangential = np.tile([-math.sin(slope_rad), 0.0], (LINKS, 1))
    normal = np.full(LINKS, math.cos(slope_rad))
    station = (np.arange(LINKS) + 0.5) / LINKS
    total = 0.0
    for phase in 2.0 * np.pi * np.arange(PHASES) / PHASES:
        angle = 2.0 * np.pi * waves * station - phase
        heading = amplitude_rad * np.sin(angle)
        heading += aim_rad - heading.mean()
        turning = -amplitude_rad * 2.0 * np.pi * waves * np.cos(angle)
        turning -= turning.mean()
        along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        across = np.stack([-np.sin(heading), np.cos(heading)], axis=-1) * turning[:, None]
        place = -(np.cumsum(along, axis=0) - 0.5 * along) / LINKS
        change = -(np.cumsum(across, axis=0) - 0.5 * across) / LINKS
        place -= place.mean(axis=0)
        change -= change.mean(axis=0)
        velocity = rigid_velocity(
            place, heading, change, friction, tangential=tangential, normal=normal
        )
        total += float(velocity[0] * math.cos(aim_rad) + velocity[1] * math.sin(aim_rad))
    return total / PHASES


def climbs(
    slope_rad: float, friction: FrictionConfig, aim_rad: float
) -> tuple[float, float] | None:
    """Amplitude and number of waves of the fastest wave that climbs, or None."""
    best, which = LEAST, None
    for amplitude_rad in AMPLITUDES_RAD:
        for waves in WAVES:
            try:
                speed = advance(slope_rad, amplitude_rad, waves, friction, aim_rad)
            except NoBalanceError:
                continue
            if speed > best:
                best, which = speed, (amplitude_rad, waves)
    return which


def bound(
    law: LawName, across: float, aim_rad: float = 0.0
) -> tuple[float, tuple[float, float] | None]:
    """Steepest slope in radians, and the wave that climbs it."""
    friction = FrictionConfig(along=ALONG, across=across, law=law)
    low, high, which = 0.0, math.radians(50.0), None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        wave = climbs(middle, friction, aim_rad)
        if wave is None:
            high = middle
        else:
            low, which = middle, wave
    return low, which


def main() -> None:
    """Print a table for each law."""
    print("| across over along | " + " | ".join(LAWS) + " |")
    print("| ---: |" + " ---: |" * len(LAWS))
    for across in ACROSS:
        cells = []
        for law in LAWS:
            slope_rad, wave = bound(law, across)
            shown = "" if wave is None else f" ({wave[0]:g} rad, {wave[1]:g} waves)"
            cells.append(f"{math.degrees(slope_rad):.0f}{shown}")
        print(f"| {across / ALONG:g} | " + " | ".join(cells) + " |", flush=True)
    for aim_deg in (30.0, 60.0):
        cells = [f"{math.degrees(bound(law, 0.7, math.radians(aim_deg))[0]):.0f}" for law in LAWS]
        print(f"diagonal of {aim_deg:g} degrees, 7: " + ", ".join(cells), flush=True)


if __name__ == "__main__":
    main()
