"""Rehearsals on steep ground, with the second body of a port and without it.

Planes, and crops of the elevation model as `benchmarks.drawn_walks` draws them. A row also states
how long the second body needed for a piece, in CPU time of this machine.

python -m benchmarks.steep_rehearsals --ramp 16 --ramp 18 --crop 21003 --seeds 6 -o steep.jsonl

The command continues its file. With --table it prints the table only.
"""

import argparse
import json
import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.drawn_walks import draw
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.rehearsal.rehearsal import RehearsalCase, rehearse
from snakewalk.controller.run.external.twin_worker import TwinTrial
from snakewalk.controller.walk.twin_answers import TwinAnswer, TwinQuestion

TRACKER = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
RAMP, CROPPED = "ramp-15-up", "jacksboro-steep"


@dataclass(frozen=True)
class Ground:
    """A run on steep ground."""

    name: str
    run: str
    keys: dict[str, Any]
    changes: dict[str, Any]


def ramp(slope_deg: float) -> Ground:
    """Return a run straight up a plane."""
    keys = {"world.ground.slope_rad": math.radians(slope_deg)}
    return Ground(f"plane of {slope_deg:g} degrees", RAMP, keys, {})


def crop(seed: int) -> Ground:
    """Return a walk over a crop that is drawn from a seed."""
    case, changes, _ = draw(CROPPED, {}, seed)
    return Ground(f"crop {seed}", CROPPED, dict(case.keys), changes)


@contextmanager
def timed_pieces() -> Iterator[list[float]]:
    """Collect the CPU time of each piece that a second body tries."""
    took_s, answers = list[float](), TwinTrial.answers

    def timed(trial: TwinTrial, question: TwinQuestion) -> Iterator[TwinAnswer]:
        trial.prepare()  # a worker does this before it listens
        pieces = answers(trial, question)
        while True:
            start_s = time.process_time()
            answer = next(pieces, None)
            if answer is None:
                return
            took_s.append(time.process_time() - start_s)
            yield answer

    TwinTrial.answers = timed  # type: ignore[method-assign, assignment]
    try:
        yield took_s
    finally:
        TwinTrial.answers = answers  # type: ignore[method-assign]


def rehearsed(ground: Ground, seed: int, tries: int | None) -> dict[str, Any]:
    """Rehearse, and return a row of the file."""
    keys = ground.keys if tries is None else {**ground.keys, "run.walk.tries": tries}
    with timed_pieces() as took_s:
        case = RehearsalCase(ground.run, seed, False, TRACKER)
        row = rehearse(case, {"keys": keys, **ground.changes})
    return {**row, "ground": ground.name, "tries": tries, "piece_s": np.round(took_s, 4).tolist()}


def table(rows: Sequence[dict[str, Any]]) -> None:
    """Print a row for each ground with and without the second body."""
    print(
        "| ground | second body | truly there | missed waypoints | duration, s | "
        "pieces | CPU time of a piece, s: median, 95 % |"
    )
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    kinds = dict.fromkeys((row["ground"], row["tries"]) for row in rows)
    for name, tries in kinds:
        of = [row for row in rows if (row["ground"], row["tries"]) == (name, tries)]
        judged = [row for row in of if "error" not in row]
        there = sum(row["has_arrived"] for row in judged)
        pieces = [each for row in of for each in row["piece_s"]]
        times = "-"
        if pieces:
            times = f"{np.median(pieces):.3f}, {np.quantile(pieces, 0.95):.3f}"
        cells = [
            *(name, "no" if tries == 0 else "yes", f"{there} of {len(of)}"),
            str(sum(row["missed"] for row in judged)),
            ", ".join(f"{row['duration_s']:.0f}" for row in judged),
            *(str(len(pieces)), times),
        ]
        print(f"| {' | '.join(cells)} |")


def main() -> None:
    """Rehearse what the file lacks, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--ramp", type=float, action="append", default=[], help="slope, degrees")
    parser.add_argument("--crop", type=int, action="append", default=[], help="seed of a crop")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("-o", "--out", type=Path, default=Path("steep.jsonl"))
    parser.add_argument("--table", action="store_true", help="rehearse nothing")
    given = parser.parse_args()
    known = given.out.read_text("utf-8").splitlines() if given.out.exists() else []
    rows = [json.loads(line) for line in known]
    done = {(row["ground"], row["seed"], row["tries"]) for row in rows}
    grounds = [] if given.table else [*map(ramp, given.ramp), *map(crop, given.crop)]
    with given.out.open("a", encoding="utf-8") as file:
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            for ground in grounds:
                for tries in (None, 0):
                    if (ground.name, seed, tries) not in done:
                        rows.append(rehearsed(ground, seed, tries))
                        file.write(json.dumps(rows[-1]) + "\n")
                        file.flush()
    table(rows)


if __name__ == "__main__":
    main()
