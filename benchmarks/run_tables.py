"""Tables of pages that come from commands of a user.

``python -m benchmarks.run_tables synthesis robots recordings policies`` runs the commands of four
pages with ``--json``, one process at a time, and prints their tables as Markdown.
``synthesis.share`` is one table of a page. With ``--write`` a table replaces the old one on its
page. ``recordings`` needs ``--data DIR`` with the published recordings (``docs/recordings.md``
lists their sources).
"""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from benchmarks.command_facts import markdown, snakewalk
from benchmarks.provenance import provenance, write_tables
from snakewalk.config.arrays import Floats
from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.metrics.path_error import distance_m
from snakewalk.controller.run.factory import prepare_walk

Facts = Mapping[str, Any]
"""An object of a command's JSON."""

RUNS: Final = ("flat-slalom", "jacksboro-traverse")
FIRST_SEED: Final = 1000
GAIN_EVERY: Final = 10
"""The gain is computed at every tenth frame: shapes change little between frames."""
ROBOTS: Final = ("horcrux14", "printed12")
RECORDINGS: Final = {
    "worm-like": ("worm-like",),
    "lamprey-like": ("lamprey-like",),
    "lampreydata": ("lamprey/lampreydata.csv",),
    "prickleback": ("prickleback/XMUC02_Trial1_sleap-1.csv", "--rate", "60"),
    "omega turn": ("worm-joint-angles/kymogram_omega-turn.npy", "--rate", "32"),
    "delta turn": ("worm-joint-angles/kymogram_delta-turn.npy", "--rate", "32"),
    "skeletons": ("worm-images/skeletons.npz",),
}
"""Recording, and the rate that its source states, by its name on the page."""
MOTIONS: Final = ("wave-cma", "wave-ppo", "undulation-fast", "lateral-undulation")
TUNED: Final = "undulation-fast"
"""The gait with which the policies are compared."""


@dataclass(frozen=True)
class Wanted:
    """Options of the command line."""

    seeds: int | None
    """Number of seeds; None: as many as the table has."""
    data: Path | None
    """Folder of the published recordings."""

    def of(self, seeds: int) -> int:
        """Return the number of seeds of a table whose own number is ``seeds``."""
        return seeds if self.seeds is None else self.seeds


@dataclass(frozen=True)
class Synthesised:
    """Facts of a synthesised motion, and quantities computed from its file."""

    facts: Facts
    off_path_m: Floats
    """(frames,) distance of the mass centre from the planned path."""
    states_in_250: float
    """Number of states in 250 frames."""
    gain: float
    """Median of the predicted gain."""
    corner_rad: float
    """Largest change of bend from point to point."""

    @property
    def is_complete(self) -> bool:
        """Whether all waypoints were reached."""
        return bool(self.facts["waypoints_reached"] == self.facts["waypoints"])


def main() -> None:
    """Run the commands of the tables that were named, and show or write the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.run_tables", description=__doc__)
    parser.add_argument("names", nargs="+", metavar="PAGE[.TABLE]", help=", ".join(TABLES))
    parser.add_argument("--seeds", type=int, help="number of seeds; default: that of the table")
    parser.add_argument("--data", type=Path, help="folder of the published recordings")
    parser.add_argument("--write", action="store_true", help="replace the tables of the pages")
    given = parser.parse_args()
    chosen = [name for name in TABLES if name in given.names or name.split(".")[0] in given.names]
    known = {part for name in TABLES for part in (name, name.split(".")[0])}
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"no table {', '.join(unknown)}; there are {', '.join(TABLES)}")
    for name in chosen:
        page, mark = name.split(".")
        words = f"python -m benchmarks.run_tables {name}"
        words += " --data DIR" if page == "recordings" else ""
        words += "" if given.seeds is None else f" --seeds {given.seeds}"
        source = provenance(words)
        text = f"{source}\n\n{TABLES[name](Wanted(given.seeds, given.data))}"
        print(text, flush=True)
        if given.write:
            write_tables(page, mark, text)


def waypoints(wanted: Wanted) -> str:
    """Return the table of motions until the last waypoint."""
    return _waypoint_table((), wanted)


def printed(wanted: Wanted) -> str:
    """Return the same table for motions that are aimed as [PT] prints it."""
    return _waypoint_table(("--motion", "walk-printed"), wanted)


def _waypoint_table(options: Sequence[str], wanted: Wanted) -> str:
    head = (
        "run",
        "all waypoints",
        "passed by",
        "time, median (longest), s",
        "off the path, mean (worst), m",
        "states, median",
        "states that came again",
    )
    seeds = range(FIRST_SEED, FIRST_SEED + wanted.of(20))
    options = *options, "--set", "run.time_limit_s=300"
    rows = [waypoint_row(run, [_synthesised(run, seed, options) for seed in seeds]) for run in RUNS]
    return markdown(head, rows)


def waypoint_row(run: str, made: Sequence[Synthesised]) -> list[str]:
    """Return the row of a run."""
    seconds = [one.facts["seconds"] for one in made]
    mean_m = np.mean([one.off_path_m.mean() for one in made])
    worst_m = max(one.off_path_m.max() for one in made)
    again = sum(one.facts["states_taken"] - one.facts["states_distinct"] for one in made)
    return [
        f"`{run}`",
        f"{sum(one.is_complete for one in made)} of {len(made)}",
        str(sum(one.facts["passed_by"] for one in made)),
        f"{np.median(seconds):.1f} ({max(seconds):.1f})",
        f"{mean_m:.2f} ({worst_m:.2f})",
        f"{np.median([one.facts['states_taken'] for one in made]):g}",
        str(again),
    ]


def share(wanted: Wanted) -> str:
    """Return the table of the share of a state that is walked; means over the seeds."""
    head = (
        "`sliding`",
        "`state_share`",
        "states in 250 frames",
        "waypoints reached of 5",
        "off the path, mean, m",
        "bends K, rad",
        "predicted gain",
        "largest change of bend from point to point, rad",
    )
    rows = []
    for sliding in ("0", "0.4"):
        for part in ("1", "0.5", "0.25", "0.1"):
            keys = {"synthesis.sliding": sliding, "synthesis.state_share": part}
            keys["time_limit_s"] = "120"
            options = [w for key, value in keys.items() for w in ("--set", f"run.{key}={value}")]
            made = [_synthesised(RUNS[0], seed, options) for seed in range(wanted.of(4))]
            rows.append([sliding, part, *share_cells(made)])
    return markdown(head, rows)


def share_cells(made: Sequence[Synthesised]) -> list[str]:
    """Return the means over the seeds of a row."""
    return [
        f"{np.mean([one.states_in_250 for one in made]):.1f}",
        f"{np.mean([one.facts['waypoints_reached'] for one in made]):.3g}",
        f"{np.mean([one.off_path_m.mean() for one in made]):.2f}",
        f"{np.mean([one.facts['bend_k_rad'] for one in made]):.2f}",
        f"{np.mean([one.gain for one in made]):.2f}",
        f"{np.mean([one.corner_rad for one in made]):.2f}",
    ]


def shipped_robots(wanted: Wanted) -> str:
    """Return the table of walks of shipped robots around the square."""
    rows = []
    for robot in ROBOTS:
        found = snakewalk(
            "trials", "run", "flat-square", "--motion", "walk", "--robot", robot, "--workers", "1",
            "--first-seed", str(FIRST_SEED), "--seeds", str(wanted.of(3)), "--start-spread", "0.02",
        )  # fmt: skip
        rows.append([f"`{robot}`", *trial_cells(found)])
    return markdown(("robot", "complete", "time, s", "path error, mean, m"), rows)


def trial_cells(found: Facts) -> list[str]:
    """Return completion, times and path error of one row of ``snakewalk trials run``."""
    (row,) = found["table"]
    seconds = [trial["duration_s"] for trial in found["trials"]]
    return [row["complete"], f"{min(seconds):.0f} to {max(seconds):.0f}", str(row["path_error_m"])]


def slowing(wanted: Wanted) -> str:
    """Return the table of the recordings, and how much slower the robot moves."""
    head = (
        "recording",
        "frames (left out)",
        "waves, Hz",
        "towards the head",
        "K median (most)",
        "in 7 coefficients",
        "joint speed, own pace, rad/s",
        "slowed throughout",
        "only where needed",
    )
    return markdown(head, [[name, *slowing_cells(_track(name, wanted))] for name in RECORDINGS])


def walks(wanted: Wanted) -> str:
    """Return the table of walks around the square, of the shapes of each recording."""
    head = (
        "recording",
        "states kept, refused",
        "all waypoints",
        "passed by",
        "path error, mean, m",
        "eta",
        "time, s",
    )
    rows = []
    for name in RECORDINGS:
        found = snakewalk(
            "trials", "run", "flat-square", "--motion", "walk", "--seeds", str(wanted.of(3)),
            "--workers", "1", "--track", _recording(name, wanted)[0],
        )  # fmt: skip
        rows.append([name, states_cell(_track(name, wanted)), *walk_cells(found)])
    return markdown(head, rows)


def states_cell(facts: Facts) -> str:
    """Return the number of states that a robot can use, and why others were refused."""
    refused = facts["states_refused"]
    reasons = ", ".join(f"{count} {reason}" for reason, count in refused.items() if count)
    cell = f"{facts['states_kept']} of {facts['states_kept'] + sum(refused.values())}"
    return f"{cell}; {reasons}" if reasons else cell


def walk_cells(found: Facts) -> list[str]:
    """Return the cells of one row of ``snakewalk trials run`` on a recording."""
    complete, seconds, error_m = trial_cells(found)
    (row,) = found["table"]
    return [complete, str(row["passed_by"]), error_m, str(row["eta"]), seconds]


def _track(name: str, wanted: Wanted) -> Facts:
    (facts,) = snakewalk("animal", "track", *_recording(name, wanted))
    return dict(facts)


def _recording(name: str, wanted: Wanted) -> tuple[str, ...]:
    """Return the file and the options of a recording.

    Raises:
        SystemExit: no folder of recordings was named.

    """
    if wanted.data is None:
        raise SystemExit("recordings: no folder of recordings; add --data DIR")
    file, *options = RECORDINGS[name]
    return (file if file == name else str(wanted.data / file)), *options


def slowing_cells(facts: Facts) -> list[str]:
    """Return the cells of a recording."""
    return [
        f"{facts['frames']} ({facts['frames_left_out']})",
        f"{facts['waves_on_body']:.2f}, {facts['wave_hz']:.2f}",
        f"{facts['time_towards_head']:.0%}".replace("%", " %"),
        f"{facts['bend_k_rad']:.2f} ({facts['bend_k_most_rad']:.2f})",
        f"{100.0 * facts['energy_kept']:.1f} %",
        f"{facts['joint_speed_rad_s']:.1f}",
        f"{facts['slowed_by']:.2f}",
        f"{facts['longer_if_slowed_where_needed']:.2f}",
    ]


def policies_on_flat(wanted: Wanted) -> str:
    """Return the table of policies and gaits on the ground where the policies learnt."""
    return _policies("flat", wanted)


def policies_on_grip(wanted: Wanted) -> str:
    """Return the table of policies and gaits on a ground where none has learnt."""
    return _policies("flat-friction-3", wanted)


def _policies(world: str, wanted: Wanted) -> str:
    seeds = str(wanted.of(10))
    words = "trials", "policy", *MOTIONS, "--world", world, "--first-seed", str(FIRST_SEED)
    found = snakewalk(*words, "--seeds", seeds, "--workers", "1")
    return policy_table(found, world)


def policy_table(found: Facts, world: str) -> str:
    """Return the table of one ground."""
    head = (f"motion, on `{world}`", "m/s", "sd", "body lengths a cycle", "J/m", "course, rad")
    speed = {(trial["motion"], trial["seed"]): trial["speed_m_s"] for trial in found["trials"]}
    cells = []
    for row in found["table"]:
        pairs = [
            (value, speed[TUNED, seed]) for (name, seed), value in speed.items()
            if name == row["motion"]
        ]  # fmt: skip
        faster = sum(own > tuned for own, tuned in pairs)
        cells.append(
            [
                f"`{row['motion']}`",
                _number(row["speed_m_s"], ".3f"),
                _number(row["speed_sd_m_s"], ".3f"),
                _number(row["body_lengths_cycle"], ".3f"),
                _number(row["energy_j_m"], ".1f"),
                _number(row["course_rad"], ".3f"),
                "" if row["motion"] == TUNED else f"{faster} of {len(pairs)}",
                f"{row['trips']} of {len(pairs)}",
            ]
        )
    return markdown((*head, f"seeds faster than `{TUNED}`", "trips"), cells)


def _number(value: float | None, form: str) -> str:
    return "unknown" if value is None else format(value, form)


def _synthesised(run: str, seed: int, options: Sequence[str]) -> Synthesised:
    """Synthesise a motion, and measure its file."""
    with TemporaryDirectory() as folder:
        name = Path(folder) / "motion"
        words = "animal", "synthesise", run, "--seed", str(seed), "--output", str(name), *options
        facts = snakewalk(*words)
        with np.load(name.with_suffix(".npz")) as file:
            points_m, state = file["points"], file["state"]
    walk = prepare_walk(run, on_paper=True)
    path_m = walk.path.piece_m(0.0, walk.path.length_m)
    centre_m = (0.5 * (points_m[:, 1:] + points_m[:, :-1])).mean(axis=1)
    step_m = points_m[:, :-1] - points_m[:, 1:]
    angle_rad = np.unwrap(np.arctan2(step_m[..., 1], step_m[..., 0]), axis=1)
    gain = quasi_static_gain(angle_rad[::GAIN_EVERY], walk.world.friction)
    return Synthesised(
        facts,
        distance_m(centre_m, path_m, np.full(len(centre_m), np.nan)),
        250.0 / len(state) * facts["states_taken"],
        float(np.median(gain)),
        float(np.abs(np.diff(angle_rad, n=2, axis=1)).max()),
    )


TABLES: Final[Mapping[str, Callable[[Wanted], str]]] = {
    "synthesis.waypoints": waypoints,
    "synthesis.share": share,
    "robots.robots": shipped_robots,
    "recordings.slowing": slowing,
    "recordings.walks": walks,
    "policies.flat": policies_on_flat,
    "policies.grip": policies_on_grip,
    "synthesis.printed": printed,
}
"""Function of each table, by page and mark; the longest are last."""


if __name__ == "__main__":
    main()
