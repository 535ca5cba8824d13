"""Coils: films whose body lies on itself, solved by the film's own body, beside the truth.

python -m benchmarks.coils --seeds 20                  # rendered bodies, as a Markdown table
python -m benchmarks.coils --only slow --first-seed 5  # one row, other seeds
python -m benchmarks.coils --worm DATA                 # a real worm's skin on real worms' turns
python -m benchmarks.coils --picture coils.jpg         # some solved frames

``DATA`` holds ``worm-images`` (``frames/*.png``, ``skeletons.npz``) and ``worm-joint-angles``
(``kymogram_omega-turn.npy``, ``kymogram_delta-turn.npy``): docs/recordings.md names their sources.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.capture.capture import Capture
from snakewalk.controller.capture.coil_fit import COILS
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.resample import body_points, equal_arc_length
from tests.helpers.captured import capture
from tests.oracles.rendered_snake import SnakeScene, coiled_midlines, film
from tests.oracles.skeleton_accuracy import point_error

PLAIN = SnakeScene(
    rows=280, columns=350, length_px=140.0, frames=60, rate_hz=15.0, wave_hz=0.5, waves=1.2,
    bend_rad=0.8,
)  # fmt: skip
FILMS: dict[str, dict[str, Any]] = {
    "plain, 140 px": {},
    "small: 70 px": {"length_px": 70.0},
    "noise 6, blur 1.2 px, light, shadow, texture": {
        "noise": 6.0,
        "blur_px": 1.2,
        "light": 0.3,
        "texture": 5.0,
        "shadow": 0.25,
    },
    "fat: 9 times as long as wide": {"slender": 9.0},
    "slow camera: 6 frames a second": {"frames": 24, "rate_hz": 6.0},
    "stains, white ground, JPEG 40": {
        "ground": 250.0,
        "body": 15.0,
        "gain": 1.1,
        "noise": 2.0,
        "jpeg": 40,
        "stains": 40.0,
    },
}
_TRUE = 2.0  # times the expected error
_UNSOLVED = {*COILS, FrameStatus.COIL_ALONE, FrameStatus.COIL_TWO_WAYS, FrameStatus.COIL_UNLIKE}
_STRIP = 9.0  # px beside the worm's midline that are its skin
_TIP_PX = 2.0  # by which the published midlines end too early
_WORM_RATE_HZ = 32.0


@dataclass(slots=True)
class Tally:
    """What became of the frames of some films."""

    solved: int = 0
    coils: int = 0
    off: list[float] = field(default_factory=list)
    """Of the solved ones, of the length."""
    expected: list[float] = field(default_factory=list)
    good: int = 0
    false_good: int = 0
    swapped: int = 0

    def add(self, seen: Capture, truth: Floats) -> None:
        """Count one film."""
        ways = []
        for k, status in enumerate(seen.status):
            self.coils += status is FrameStatus.COIL or status in _UNSOLVED
            if not status.has_points:
                continue
            both = [point_error(seen.points_px[k][::way], truth[k]) for way in (1, -1)]
            ways.append(both[0] < both[1])
            if status is FrameStatus.COIL:
                length = float(np.hypot(*np.diff(truth[k], axis=0).T).sum())
                self.solved += 1
                self.off.append(min(both) / length)
                self.expected.append(float(seen.expected_px[k]) / length)
            elif status is FrameStatus.GOOD:
                self.good += 1
                self.false_good += min(both) > _TRUE * seen.expected_px[k]
        self.swapped += min(sum(ways), len(ways) - sum(ways))

    def row(self, name: str) -> str:
        """One line of the table."""
        off, said = np.array(self.off or [np.nan]), np.array(self.expected or [np.nan])
        false = int(np.count_nonzero(off > _TRUE * said))
        return (
            f"| {name} | {self.solved} of {self.coils} | {100 * np.median(off):.2f} "
            f"({100 * np.median(said):.2f}) | {100 * off.max():.2f} | {false} "
            f"| {self.false_good} of {self.good} | {self.swapped} |"
        )


def rendered(change: dict[str, Any], seed: int) -> tuple[list[Image], Floats, float]:
    """Frames, midlines and rate of one film."""
    scene = replace(PLAIN, seed=seed, **change)
    truth = coiled_midlines(scene)
    return list(film(scene, truth)), truth, scene.rate_hz


def worm_films(data: Path) -> Iterator[tuple[str, list[Image], Floats, float]]:
    """Real turns of worms (joint angles), drawn with the skin of a real worm; cropped frames."""
    with np.load(data / "worm-images" / "skeletons.npz") as held:
        lines = held["skeletons"].astype(float)
    images = [
        np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        for path in sorted((data / "worm-images" / "frames").glob("*.png"))
    ]
    across = np.linspace(-_STRIP, _STRIP, int(4 * _STRIP) + 1)
    skins = [_skin(images[k], lines[k], across) for k in range(0, len(images), 6)]
    length = 2.0 * _TIP_PX + float(
        np.median(np.hypot(*np.diff(lines, axis=1).transpose(2, 0, 1)).sum(axis=1))
    )
    ground = float(np.median(np.concatenate([one[[0, -1]].ravel() for one in images])))
    noise = float(
        np.median([1.05 * np.median(np.abs(np.diff(one[0].astype(float)))) for one in images])
    )
    rng = np.random.default_rng(0)
    for name in ("omega", "delta"):
        angles = np.load(data / "worm-joint-angles" / f"kymogram_{name}-turn.npy")
        for every in (1, 2):
            pictures, truth = [], []
            for n, bends in enumerate(angles[::every]):
                tangent = np.cumsum(np.concatenate([[0.0], bends]))
                line = equal_arc_length(body_points(tangent - tangent.mean(), length))
                picture, line = _worm(line, skins[(n // 8) % len(skins)], across, ground, rng)
                picture = picture + rng.normal(0.0, noise, picture.shape)
                pictures.append(np.asarray(np.clip(np.rint(picture), 0, 255), dtype=np.uint8))
                truth.append(line)
            rate = _WORM_RATE_HZ / every
            yield f"{name} turn, {rate:g} frames a second", pictures, np.array(truth), rate


def _skin(image: Image, line: Floats, across: Floats) -> Floats:
    """(101, A) grey values along and across a body, from tip to tip."""
    first, last = line[0] - line[3], line[-1] - line[-4]
    longer = np.vstack(
        [
            line[0] + _TIP_PX * first / np.hypot(*first),
            line,
            line[-1] + _TIP_PX * last / np.hypot(*last),
        ]
    )
    whole = equal_arc_length(longer)
    along = np.gradient(whole, axis=0)
    side = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    at = (whole[:, None] + across[None, :, None] * side[:, None]).astype(np.float32)
    seen = cv2.remap(
        image, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(seen, dtype=float)


def _worm(
    line: Floats, skin: Floats, across: Floats, ground: float, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """A picture cropped to a worm, which is as dark as the darker of two strands, and its line."""
    low = np.floor(line.min(axis=0) - 8.0 - rng.integers(2, 12))
    wide, high = (np.ceil(line.max(axis=0) + 8.0 - low) + rng.integers(2, 12)).astype(int)
    line = line - low
    out = np.full((high, wide), ground)
    y, x = np.mgrid[:high, :wide]
    along = np.gradient(line, axis=0)
    along /= np.hypot(*along.T)[:, None]
    for place, ahead, grey in zip(line, along, skin, strict=True):
        off_x, off_y = x - place[0], y - place[1]
        near = np.abs(off_x * ahead[0] + off_y * ahead[1]) < 0.75
        beside = off_y * ahead[0] - off_x * ahead[1]
        near &= np.abs(beside) < across[-1]
        out[near] = np.minimum(out[near], np.interp(beside[near], across, grey))
    return out, line


def picture(path: Path) -> None:
    """Some solved frames: each as it is, and with its midline."""
    tiles = []
    for seed, name in ((1002, "plain, 140 px"), (1004, "plain, 140 px"), (1011, "plain, 140 px")):
        images, _, rate = rendered(FILMS[name], seed)
        seen = capture(images, make_detector(images[::3]), rate, fixed=False)
        coils = [k for k, status in enumerate(seen.status) if status is FrameStatus.COIL]
        for k in coils[:: max(1, len(coils) // 3)][:4]:
            middle = np.rint(seen.points_px[k].mean(axis=0)).astype(int)
            left, top = np.clip(middle - 55, 0, np.array(images[k].shape[::-1]) - 110)
            part = images[k][top : top + 110, left : left + 110]
            large = cv2.cvtColor(
                cv2.resize(part, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC),
                cv2.COLOR_GRAY2BGR,
            )
            drawn = large.copy()
            line = np.rint((seen.points_px[k] - [left, top] + 0.5) * 2.0 * 16.0).astype(np.int32)
            cv2.polylines(drawn, [line], False, (60, 200, 255), 2, cv2.LINE_AA, 4)
            head = (int(line[0, 0]), int(line[0, 1]))
            cv2.circle(drawn, head, 5 * 16, (80, 255, 80), -1, cv2.LINE_AA, 4)
            tiles.append(np.vstack([large, drawn]))
    rows = [np.hstack(tiles[k : k + 6]) for k in range(0, len(tiles) // 6 * 6, 6)]
    cv2.imwrite(str(path), np.vstack(rows))


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--only", default="", help="part of a film's name")
    parser.add_argument("--worm", type=Path)
    parser.add_argument("--picture", type=Path)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    if given.picture is not None:
        picture(given.picture)
        return
    print("| film | coils solved | off (expected) % | worst % | off > 2 x expected | good, so "
          "far off | head and tail swapped |")  # fmt: skip
    print("| --- | --- | --- | --- | --- | --- | --- |")
    start = time.process_time()
    if given.worm is not None:
        for name, images, truth, rate in worm_films(given.worm):
            tally = Tally()
            detector = make_detector(images[:: len(images) // 25], cropped=True)
            tally.add(capture(images, detector, rate, fixed=False), truth)
            print(tally.row(name), flush=True)
        return
    for name, change in FILMS.items():
        if given.only not in name:
            continue
        tally = Tally()
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            images, truth, rate = rendered(change, seed)
            tally.add(capture(images, make_detector(images[::3]), rate, fixed=False), truth)
        print(tally.row(name), flush=True)
    print(f"\n{time.process_time() - start:.0f} s of CPU time")


if __name__ == "__main__":
    main()
