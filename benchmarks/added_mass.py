"""``python -m benchmarks.added_mass``: what added mass would change for the measured swimmers.

An independent planar model plays the rows of swimming measurements: links with prescribed angles,
sliced; drag as in ``sim.physics.water``. Two models of added mass, ``rho pi r^2`` per metre across
the body (a round section): Kirchhoff's (the water next to each link has momentum), and Lighthill's
large-amplitude elongated-body theory (Proc. R. Soc. B 179, 1971), which also sheds the momentum of
the tail's end: a force ``1/2 m w^2`` forward and ``-m u w`` across the tail.
"""

from dataclasses import dataclass
from statistics import median

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.validation.benches import SineWave
from snakewalk.controller.validation.measurement import Conditions, WaveMotion, load_measurement

FILES = ("fishsim-swimming", "amphibot-swimming", "lamprey", "prickleback")
DENSITY_KG_M3 = 1000.0
SLICES = 6
STEP_S = 0.01


@dataclass(frozen=True)
class WaterModel:
    """Coefficients of drag, and the momentum of water that is counted."""

    name: str
    along: float = 0.03
    across: float = 2.0
    added: float = 0.0
    """Share of a round section's added mass."""
    shed: float = 0.0
    """Share of the tail's momentum that is shed."""


MODELS = (
    WaterModel("drag alone"),
    WaterModel("Kirchhoff", added=1.0),
    WaterModel("Lighthill", added=1.0, shed=1.0),
    WaterModel("smooth plate", along=0.005),
)


class Swimmer:
    """A chain whose angles are prescribed: its state is place, heading, and three momenta."""

    def __init__(self, conditions: Conditions, water: WaterModel) -> None:
        robot = conditions.robot
        self._water = water
        self._length_m = np.array(robot.link_lengths_m)
        self._mass_kg = np.array(robot.link_masses_kg)
        self._radius_m = np.array(robot.link_radii_m)
        square = 3.0 * self._radius_m**2 + self._length_m**2
        self._spin_kg_m2 = self._mass_kg * square / 12.0
        self._offsets = (np.arange(SLICES) + 0.5) / SLICES - 0.5

    def change(self, state: Floats, angle_rad: Floats, rate_rad_s: Floats) -> Floats:
        """Return the slope of the state (6,): x, y, heading, and momenta of the centre."""
        heading = state[2] - np.concatenate([[0.0], np.cumsum(angle_rad)])
        turn = -np.concatenate([[0.0], np.cumsum(rate_rad_s)])
        axis = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        left = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        half = 0.5 * self._length_m[:, None]
        place, move = (self._chained(half * part) for part in (axis, turn[:, None] * left))
        reach = (self._length_m[:, None] * self._offsets)[..., None]
        at = (place[:, None] + reach * axis[:, None]).reshape(-1, 2)
        own = (move[:, None] + reach * (turn[:, None] * left)[:, None]).reshape(-1, 2)
        axes, lefts = (np.repeat(part, SLICES, axis=0) for part in (axis, left))
        radius = np.repeat(self._radius_m, SLICES)
        piece = np.repeat(self._length_m, SLICES) / SLICES
        water = np.pi * DENSITY_KG_M3 * self._water.added * radius**2 * piece
        # speed across a slice: rows . (V, turning) + own
        rows = np.column_stack([lefts, at[:, 0] * lefts[:, 1] - at[:, 1] * lefts[:, 0]])
        inertia = (rows.T * water) @ rows
        inertia[:2, :2] += self._mass_kg.sum() * np.eye(2)
        inertia[2, 2] += (self._mass_kg * (place**2).sum(axis=1) + self._spin_kg_m2).sum()
        offset = rows.T @ (water * (own * lefts).sum(axis=1))
        spun = place[:, 0] * move[:, 1] - place[:, 1] * move[:, 0]
        offset[2] += (self._mass_kg * spun + self._spin_kg_m2 * turn).sum()
        speed = np.linalg.solve(inertia, state[3:] - offset)
        flow = speed[:2] + own + speed[2] * np.stack([-at[:, 1], at[:, 0]], axis=1)
        along, across = (flow * axes).sum(axis=1), (flow * lefts).sum(axis=1)
        drag = 0.5 * DENSITY_KG_M3 * radius * piece
        force = (
            -(self._water.along * np.pi * drag * np.abs(along) * along)[:, None] * axes
            - (self._water.across * 2.0 * drag * np.abs(across) * across)[:, None] * lefts
        )
        shed = self._water.shed * water[-1] / piece[-1]
        # slices run forward in a link: the tail's end is the first one of the last link
        last = -SLICES
        tail = 0.5 * across[last] * axes[last] - along[last] * lefts[last]
        force[last] += shed * across[last] * tail
        torque = (at[:, 0] * force[:, 1] - at[:, 1] * force[:, 0]).sum()
        drift = speed[0] * state[4] - speed[1] * state[3]
        return np.array([*speed, *force.sum(axis=0), torque - drift])

    def _chained(self, half: Floats) -> Floats:
        """Return the sums of half links from the head (L, 2), about the centre of mass."""
        step = np.cumsum(half[:-1] + half[1:], axis=0)
        placed = -np.concatenate([np.zeros((1, 2)), step])
        return np.asarray(placed - self._mass_kg @ placed / self._mass_kg.sum())


def speed_m_s(conditions: Conditions, water: WaterModel) -> float:
    """Return the speed of the centre from ``after_s`` on, by least squares."""
    motion = conditions.motion
    assert isinstance(motion, WaveMotion)
    wave, swimmer, state = SineWave(motion), Swimmer(conditions, water), np.zeros(6)
    angles, rates = [wave.goal_rad()], [wave.velocity_rad_s()]
    for _ in range(2 * round(motion.seconds / STEP_S)):
        wave.step(0.5 * STEP_S, None)  # type: ignore[arg-type]  # it needs no body
        angles.append(wave.goal_rad())
        rates.append(wave.velocity_rad_s())
    places = []
    for k in range(0, len(angles) - 2, 2):
        a = swimmer.change(state, angles[k], rates[k])
        b = swimmer.change(state + 0.5 * STEP_S * a, angles[k + 1], rates[k + 1])
        c = swimmer.change(state + 0.5 * STEP_S * b, angles[k + 1], rates[k + 1])
        d = swimmer.change(state + STEP_S * c, angles[k + 2], rates[k + 2])
        state = state + STEP_S / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        places.append(state[:2])
    time_s = STEP_S * np.arange(1, len(places) + 1)
    late = time_s >= motion.after_s
    return float(np.hypot(*np.polyfit(time_s[late], np.array(places)[late], 1)[0]))


def main() -> None:
    """Print the median and the range of the ratios of each file."""
    print("| rows |", " | ".join(model.name for model in MODELS), "|")
    print("| --- |", " | ".join("---:" for _ in MODELS), "|")
    for name in FILES:
        _, measurement = load_measurement(name)
        rows = [row for row in measurement.rows if row.kind == "measured" and row.over is None]
        cells = []
        for model in MODELS:
            ratios = []
            for row in rows:
                conditions = measurement.conditions(row, name)
                motion = conditions.motion
                assert isinstance(motion, WaveMotion)
                unit = motion.frequency_hz * conditions.robot.length_m
                unit = unit if row.quantity == "lengths_per_cycle" else 1.0
                ratios.append(speed_m_s(conditions, model) / unit / row.value)
            few = len(ratios) == 1
            span = "" if few else f" ({min(ratios):.2f} to {max(ratios):.2f})"
            cells.append(f"{median(ratios):.2f}{span}")
        print(f"| `{name}`, {len(rows)} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
