"""``python -m benchmarks.head_windows FOLDER [--only WORD]``: is the head of real films right?

Cuts windows of 20, 40 and 60 frames out of the films of a folder that have a known head
(``benchmarks/films``), and captures each as a film of its own. An animal with marks is cut out of
the picture with a margin. No constant was chosen on these films (``benchmarks.head_signs``).
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from benchmarks.films.described_film import DescribedFilm, films_of
from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import load_capture
from snakewalk.controller.capture.capturing import capture_recording
from snakewalk.controller.images.video import in_8_bits, open_footage
from tests.helpers.film_options import film_options

LENGTHS = (20, 40, 60)
_MARGIN_PX = 60
_BINS = (0.5, 0.7, 0.8, 0.9, 1.01)


def heads_of(film: DescribedFilm) -> Iterator[tuple[str, dict[int, Floats], slice | None]]:
    """Each animal: its name, the (2, 2) places of head and tail by frame, and if it is cut out."""
    if film.lines_px:
        yield "", {k: line[[0, -1]] for k, line in film.lines_px.items()}, None
    for marks in film.animals:
        yield marks.name, marks.ends_px, slice(0)


def windows(count: int) -> Iterator[tuple[int, int]]:
    """First and last frame, plus one; the last window of a length ends with the film."""
    for length in LENGTHS:
        starts = [*range(0, count - length + 1, length)]
        if starts and starts[-1] + length < count:
            starts.append(count - length)
        for start in starts:
            yield start, start + length


def main() -> int:
    """Print a row for each window, and the calibration."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", metavar="WORD")
    given = parser.parse_args()
    judged: list[tuple[float, bool]] = []
    for film in films_of(given.folder.resolve()):
        if given.only not in str(film.path):
            continue
        frames = [in_8_bits(frame) for frame in open_footage(film.path).read()]
        for name, ends_px, is_cut in heads_of(film):
            corner = np.zeros(2)
            images = frames
            if is_cut is not None:
                places = np.concatenate([*ends_px.values()])
                corner = np.maximum(places.min(axis=0) - _MARGIN_PX, 0.0).astype(int)
                x, y = np.ceil(places.max(axis=0) + _MARGIN_PX).astype(int)
                images = [frame[corner[1] : y, corner[0] : x] for frame in frames]
            for start, stop in windows(len(frames)):
                said = _judged(images[start:stop], start, ends_px, corner, film)
                if not isinstance(said, str):
                    judged.append(said)
                    said = f"{said[0]:.3f} {said[1]}"
                print(f"{film.path.name} {name} {start}-{stop - 1}: {said}", flush=True)
    print(calibration(judged))
    return 0


def calibration(judged: Sequence[tuple[float, bool]]) -> str:
    """Right heads against those that the probabilities promise: by range, and below 0.9."""
    lines = ["| probability | windows | expected right | right |", "| --- | --- | --- | --- |"]
    for low, high in [*pairwise(_BINS), (0.5, 0.9), (0.5, 1.01)]:
        some = [(sure, right) for sure, right in judged if low <= sure < high]
        expected = sum(sure for sure, _ in some)
        right = sum(right for _, right in some)
        lines.append(f"| {low} to {min(high, 1)} | {len(some)} | {expected:.1f} | {right} |")
    return "\n".join(lines)


def _judged(
    images: list[Image],
    start: int,
    ends_px: dict[int, Floats],
    corner: Floats,
    film: DescribedFilm,
) -> tuple[float, bool] | str:
    """Probability of the head and whether it is right, or why there is no track."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch, "frames")
        folder.mkdir()
        for number, image in enumerate(images):
            cv2.imwrite(str(folder / f"{number:04d}.png"), image)
        options = film_options(
            folder, Path(scratch, "t.npz"), rate_hz=30.0, cropped="--cropped" in film.options
        )
        try:
            capture_recording(options)
        except InputError as error:
            return f"no track ({str(error).rpartition(': ')[2]})"
        seen = load_capture(options.output).captured
    right = []
    for number in np.flatnonzero(seen.used).tolist():
        if start + number not in ends_px:
            continue
        head, tail = ends_px[start + number] - corner
        first = seen.points_px[number, 0]
        right.append(np.hypot(*(first - head)) < np.hypot(*(first - tail)))
    return seen.head_probability, bool(np.mean(right) > 0.5)


if __name__ == "__main__":
    sys.exit(main())
