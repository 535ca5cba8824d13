"""``python -m benchmarks.head_signs [--films N] [--first N] [--write]``: the signs of the head.

Renders films of drawn animals that mostly move forward, captures each, and measures the signs of
its true head. Prints the mean of each sign, twice its deviation between films, and how often the
signs of a group repeat each other: the constants of ``controller/capture/stages/head.py``.
``--write`` adds the measured signs to ``benchmarks/head_signs.csv``. No real film is used.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.staged_film import StagedFilm, arrays_of
from snakewalk.controller.capture.stages.head import GROUPS, contrast_along, head_signs
from snakewalk.controller.capture.stages.outlier_frames import Compare
from snakewalk.controller.images.body_detector import make_detector
from tests.oracles.rendered_snake import SnakeScene, film, true_midlines
from tests.oracles.skeleton_accuracy import swapped

TABLE = Path(__file__).with_suffix(".csv")
SIGNS = [name for group in GROUPS for name in group.signs]
WIDENED = 2.0  # times the learnt deviations are in use: real animals vary more than drawn ones
_SEED = 67
_BACKWARDS = 0.4  # of a film: longest retreat of an animal that mostly moves forward


def drawn(number: int) -> SnakeScene:
    """An animal: worms with even ends, snakes, and larvae with wide heads and faint tails."""
    rng = np.random.default_rng([_SEED, number])
    return SnakeScene(
        rows=130,
        columns=170,
        frames=int(rng.integers(20, 41)),
        rate_hz=15.0,
        length_px=float(rng.uniform(45.0, 70.0)),
        slender=float(rng.uniform(10.0, 18.0)),
        waves=float(rng.uniform(0.7, 1.8)),
        wave_hz=float(rng.uniform(0.4, 2.0)),
        bend_rad=float(rng.uniform(0.3, 1.0)),
        taper=float(rng.uniform(0.1, 0.7)),
        tip=float(rng.uniform(0.05, 0.8)),
        head=float(rng.uniform(0.8, 1.8)),
        faint=float(rng.uniform(0.5, 1.2)),
        noise=float(rng.uniform(1.0, 5.0)),
        blur_px=float(rng.uniform(0.6, 1.5)),
        seed=int(rng.integers(1_000_000)),
    )


def midlines_of(scene: SnakeScene, number: int) -> Floats:
    """(T, 101, 2) midlines; in two films of three, the animal retreats at the end."""
    backwards = float(np.random.default_rng([_SEED, number, 1]).uniform(-0.5, 1.0)) * _BACKWARDS
    lines = true_midlines(scene)
    ahead = len(lines) - round(len(lines) * max(0.0, backwards))
    return np.concatenate([lines[:ahead], lines[2 * ahead - len(lines) : ahead][::-1]])


def measured(scene: SnakeScene, midlines_px: Floats) -> dict[str, tuple[float, float]]:
    """Value and error of each sign of the true head; empty if too few frames are captured."""
    frames = list(film(scene, midlines_px))
    detector = make_detector(frames[::2])
    detections = Detections()
    for frame in frames:
        detections.add(frame, detector.detect(frame))
    unknown = np.full(len(frames), np.nan)
    seen = Compare().run(
        StagedFilm(
            detections,
            tuple(detections.skeletons),
            unknown,
            unknown > 0.0,
            scene.rate_hz,
            True,
            None,
        )
    )
    used = [k for k, skeleton in enumerate(seen.skeletons) if skeleton.status.has_points]
    if len(used) < len(frames) // 2:
        return {}
    shown = arrays_of(seen.skeletons)
    wrong = swapped(shown["points_px"][used[0]], midlines_px[used[0]])
    turn = slice(None, None, -1 if wrong else 1)
    contrast = contrast_along(seen.skeletons, detections.store)
    return head_signs(
        shown["points_px"][:, turn],
        shown["radius_px"][:, turn],
        contrast[:, turn],
        scene.rate_hz,
        fixed=True,
    )


def stored() -> dict[str, Floats]:
    """By sign: (F, 2) value and error in each film of the table."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {
        name: np.array([[float(row[name]), float(row[f"{name} error"])] for row in rows])
        for name in SIGNS
    }


def learnt(signs: dict[str, Floats]) -> dict[str, tuple[float, float]]:
    """Mean of each sign, and its deviation between films without the error within a film."""
    return {
        name: (
            float(values[:, 0].mean()),
            float(np.sqrt(max(values[:, 0].var() - (values[:, 1] ** 2).mean(), 0.0))),
        )
        for name, values in signs.items()
    }


def repetition(signs: dict[str, Floats], names: list[str]) -> float:
    """How often the same information occurs among signs, by their mean correlation."""
    values = np.corrcoef([signs[name][:, 0] for name in names])
    count = len(names)
    return 1.0 + float(values.sum() - count) / count


def main() -> int:
    """Measure films, then print what the table teaches."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--films", type=int, default=0, help="number of films to render")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--write", action="store_true", help="add them to the table")
    given = parser.parse_args()
    columns: list[object] = [
        "film",
        *(column for name in SIGNS for column in (name, f"{name} error")),
    ]
    rows: list[list[object]] = []
    for number in range(given.first, given.first + given.films):
        signs = measured(drawn(number), midlines_of(drawn(number), number))
        if not signs.keys() >= set(SIGNS):
            continue
        pairs = {name: signs[name] for name in SIGNS}
        rows.append([number, *(f"{one:.4f}" for pair in pairs.values() for one in pair)])
        print(*rows[-1], flush=True)
    if given.write:
        is_new = not TABLE.exists()
        with TABLE.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([columns] * is_new + rows)
    table = stored()
    print(f"{len(next(iter(table.values())))} films")
    constants = learnt(table)
    for group in GROUPS:
        for name, sign in group.signs.items():
            mean, deviation = constants[name]
            widened = WIDENED * deviation
            print(f"{name}: {mean:.2f} {widened:.2f} (in use {sign.mean} {sign.deviation})")
        names = [*group.signs]
        print(f"repeated {repetition(table, names):.2f} (in use {group.repeated})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
