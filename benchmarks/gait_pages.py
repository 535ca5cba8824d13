"""Tables of motion and cost of the gaits, from the command of a user.

``python -m benchmarks.gait_pages`` runs each gait once in the simulator and prints the tables of
motion, swimming and climbing. With ``--write`` it replaces the tables of these pages. A run is
deterministic, so n = 1.
"""

import argparse
import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from scipy.special import j0

from benchmarks.command_facts import markdown, snakewalk
from benchmarks.provenance import provenance, write_tables
from snakewalk.config.loader import load_robot
from snakewalk.controller.run.kinds.gait_factory import gait_by_name

Facts = Mapping[str, Any]
COMMAND: Final = "python -m benchmarks.gait_pages --write"
ON_LAND: Final = {
    "lateral-undulation": "yaw",
    "sidewinding": "yaw, pitch",
    "rolling": "yaw, pitch",
    "turn-in-place": "yaw, pitch",
    "rectilinear": "pitch",
    "concertina-yaw16": "yaw",
    "compound-serpenoid": "yaw, pitch",
}
"""Gaits of the first table, and the joints that they move."""
IN_WATER: Final = (
    *("anguilliform", "subcarangiform", "carangiform"),
    *("thunniform", "thunniform-dolphin"),
)
CLIMBING: Final = ("helix-pole", "helix-pipe")
NO_COST_BELOW: Final = 0.05
"""Body lengths a cycle below which a gait turns on the spot and has no cost of transport."""


def measured(name: str, seconds: float) -> Facts:
    """Return the facts that ``snakewalk gait run`` prints.

    Raises:
        SystemExit: the command failed.

    """
    with TemporaryDirectory() as folder:
        options = ("--no-film", "--quiet", "--out", str(Path(folder) / "run"))
        facts: Facts = snakewalk("gait", "run", name, "--seconds", f"{seconds:g}", *options)
    return facts


def motion_table(rows: Mapping[str, Facts]) -> str:
    """Motion and cost of the gaits on land."""
    head = (
        *("gait", "joints", "robot, world", "Hz", "forward, body lengths", "to the left"),
        *("turn, rad", "m/s", "cost", "mechanical"),
    )
    lines = []
    for name, facts in rows.items():
        ahead, left = facts["forward_body_lengths_cycle"], facts["left_body_lengths_cycle"]
        moves = np.hypot(ahead, left) >= NO_COST_BELOW or abs(facts["turn_rad_cycle"]) < 1.0
        costs = ("electrical_cost_of_transport", "mechanical_cost_of_transport")
        cells = [
            *(name, ON_LAND[name], f"{facts['robot']}, {facts['world']}"),
            f"{facts['frequency_hz']:.2f}",
            *(f"{each:.3f}" for each in (ahead, left, facts["turn_rad_cycle"])),
            f"{facts['speed_m_s']:.3f}",
            *(f"{facts[key]:.2f}" if moves else "" for key in costs),
        ]
        lines.append(cells)
    return markdown(head, lines)


def slip_table(rows: Mapping[str, Facts]) -> str:
    """Compare two gaits with the distance that geometry allows without slip."""
    undulation, rolling = rows["lateral-undulation"], rows["rolling"]
    given = _parameters("lateral-undulation")
    body = load_robot(rolling["robot"])
    radius_m, length_m = body.body_radius_m, body.length_m
    without = {
        "lateral undulation, winding {winding_rad} rad, {waves} waves".format(**given): (
            undulation,
            undulation["forward_body_lengths_cycle"],
            j0(given["winding_rad"]) / given["waves"],
        ),
        f"rolling, radius {100 * radius_m:g} cm": (
            rolling,
            abs(rolling["left_body_lengths_cycle"]),
            2.0 * np.pi * radius_m / length_m,
        ),
    }
    lines = []
    for text, (facts, done, most) in without.items():
        where = f"{text}, {facts['robot']} on `{facts['world']}`"
        lines.append([where, f"{done:.3f}", f"{most:.3f}", f"{done / most:.2f}"])
    return markdown(("gait", "body lengths a cycle", "without slip", "share"), lines)


def swimming_table(rows: Mapping[str, Facts]) -> str:
    """Motion of the swimming gaits and their largest current."""
    head = (
        *("mode", "Omega, alpha, omega", "robot", "at", "body lengths a cycle"),
        *("m/s", "peak current"),
    )
    lines = []
    for name, facts in rows.items():
        given = _parameters(name)
        ends = [f"{given[key]:g}" for key in ("nose", "tail")]
        cells = [
            f"`{name}`",
            f"{' to '.join(dict.fromkeys(ends))}, {given['waves']:g}, {given['frequency_hz']:g} Hz",
            f"`{facts['robot']}`",
            f"{facts['frequency_hz']:.2f} Hz",
            f"{facts['forward_body_lengths_cycle']:.3f}",
            f"{facts['speed_m_s']:.2f}",
            f"{facts['peak_current_a']:.2f} A",
        ]
        lines.append(cells)
    return markdown(head, lines)


def climbing_table(rows: Mapping[str, Facts]) -> str:
    """Climb in a cycle, and that of a body that rolls without slip (``gaits/helix.py``)."""
    head = (
        *("gait", "up, m a cycle", "rolling without slip", "turn about the axis, rad a cycle"),
        *("without slip", "slowed to", "peak current"),
    )
    lines = []
    for name, facts in rows.items():
        given = _parameters(name)
        around_m, rise_rad = 2.0 * math.pi * given["body_radius_m"], given["rise_rad"]
        turns = ["", ""]
        if "pole_radius_m" in given:
            free_rad = around_m * math.sin(rise_rad) / given["pole_radius_m"]
            turns = [f"{abs(facts['turn_rad_cycle']):.3f}", f"{free_rad:.3f}"]
        up_m = facts["up_body_lengths_cycle"] * load_robot(facts["robot"]).length_m
        cells = [
            *(f"`{name}`", f"{up_m:.3f}", f"{around_m * math.cos(rise_rad):.3f}", *turns),
            *(f"{facts['lowest_rate']:.0%}", f"{facts['peak_current_a']:.2f} A"),
        ]
        lines.append(cells)
    return markdown(head, lines)


def _parameters(name: str) -> dict[str, Any]:
    """Parameters of a gait by default."""
    given: dict[str, Any] = gait_by_name(name, None)[0].params.model_dump()
    return given


def _all(names: Iterable[str], seconds: float) -> dict[str, Facts]:
    found = {}
    for name in names:
        print(name, file=sys.stderr)
        found[name] = measured(name, seconds)
    return found


def main() -> None:
    """Print the tables, or write them into their pages."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="replace the tables of the pages")
    write = parser.parse_args().write
    land = _all(ON_LAND, 20.0)
    tables = {
        ("gaits", "motion"): motion_table(land),
        ("gaits", "slip"): slip_table(land),
        ("swimming", "swimming"): swimming_table(_all(IN_WATER, 16.0)),
        ("climbing", "climbing"): climbing_table(_all(CLIMBING, 16.0)),
    }
    origin = provenance(COMMAND)
    for (page, name), table in tables.items():
        text = f"{table}\n\n{origin}"
        print(f"{page}\n\n{text}\n")
        if write:
            write_tables(page, name, text)


if __name__ == "__main__":
    main()
