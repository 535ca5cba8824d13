"""How much gaits change if each step of the compiled simulator is rounded as in single precision.

``python -m benchmarks.rounded_bodies`` runs gaits twice on the compiled simulator, once with a
random relative error of ``ERROR`` in each coordinate and velocity after each step. This is a few
roundings of a single-precision number (6e-8). With ``--write`` it replaces a table of
``docs/how-to/simulate-many-robots.md``.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from benchmarks.provenance import provenance, write_tables
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from tests.helpers.gait_links import links_of, prepared_gaits
from tests.oracles.compiled_bodies import CompiledBodies

ERROR: Final = 1e-6
GAITS: Final = {
    "quadruped": ("trot", "anguilliform", "carangiform", "lateral-walk", "erect-trot"),
    "yaw16": ("carangiform", "thunniform", "lateral-undulation"),
    "alternating16": ("carangiform", "thunniform", "sidewinding"),
}
"""Those that exceed 0.5 % on MuJoCo-Warp, and others that do not."""


class RoundedBodies(CompiledBodies):
    """Bodies whose state gets a relative error after each step."""

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        count: int,
        step_s: float | None = None,
        *,
        seed: int,
    ) -> None:
        super().__init__(robot, world, count, step_s)
        self._rng = np.random.default_rng(seed)

    def run(self, steps: int) -> None:
        for _ in range(steps):
            super().run(1)
            for plant in self._plants:
                for state in (plant.mechanics.data.qpos, plant.mechanics.data.qvel):
                    state[:] *= 1.0 + ERROR * self._rng.standard_normal(state.shape)


def main() -> None:
    """Measure, show, and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.rounded_bodies", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=5, help="of the errors")
    parser.add_argument("--write", action="store_true", help="replace the table of the page")
    given = parser.parse_args()
    lines = ["| robot | gait | least | median | most |", "| --- | --- | ---: | ---: | ---: |"]
    for robot, gaits in GAITS.items():
        for name, found in zip(gaits, deviations(robot, gaits, given.seeds), strict=True):
            shown = (f"{each:.3%}".replace("%", " %") for each in found)
            lines.append(f"| `{robot}` | {name} | {' | '.join(shown)} |")
    command = f"python -m benchmarks.rounded_bodies {' '.join(sys.argv[1:])}".strip()
    text = "\n".join([f"{provenance(command)} n = {given.seeds} seeds.", "", *lines])
    print(text)
    if given.write:
        write_tables("how-to/simulate-many-robots", "rounded", text)


def deviations(robot: str, gaits: tuple[str, ...], seeds: int) -> list[tuple[float, float, float]]:
    """Return least, median and largest deviation of each gait, as shares of the distance."""
    prepared = prepared_gaits(robot, gaits)
    with TemporaryDirectory() as folder:
        exact = links_of(prepared, CompiledBodies, Path(folder) / "exact")
        rounded = [
            links_of(prepared, partial(RoundedBodies, seed=seed), Path(folder) / f"{seed}")
            for seed in range(seeds)
        ]
    found = []
    for number, links_m in enumerate(exact):
        way_m = np.linalg.norm(links_m[1] - links_m[0], axis=1).mean()
        off_m = [np.linalg.norm(each[number][1] - links_m[1], axis=1).mean() for each in rounded]
        shares = np.array(off_m) / way_m
        found.append((float(shares.min()), float(np.median(shares)), float(shares.max())))
    return found


if __name__ == "__main__":
    main()
