"""One film captured by the command and compared with its truth."""

import json
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.films.described_film import DescribedFilm, Marks
from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.capture import Capture, load_capture
from snakewalk.controller.images.video import open_footage
from tests.oracles.skeleton_accuracy import covered_error, point_error, swapped

_HEAD_PART = 20  # of 101 points: the point between the eyes lies next to these
_TWICE = 2.0
_COMMAND = "from snakewalk.controller.cli.main import main; raise SystemExit(main())"
_LENGTH = 0.06  # of the known length: a used line that is off by more is wrong


@dataclass(slots=True)
class JudgedFilm:
    """Counts over all frames, and over all animals, of a film."""

    name: str
    frames: int = 0
    used: int = 0
    good: int = 0
    exit_code: int = 0
    cpu_s_per_megapixel: float = float("nan")
    head_by: str = "-"
    head_sure: float = float("nan")
    heads: list[bool] = field(default_factory=list)
    """Of the used frames with truth: whether the head is right."""
    head_px: list[float] = field(default_factory=list)
    """Distance of the mark at the head from the line; NaN for a frame without a line."""
    tail_px: list[float] = field(default_factory=list)
    true_px: list[float] = field(default_factory=list)
    """Of the used frames with truth: error of a point."""
    expected_px: list[float] = field(default_factory=list)
    are_good: list[bool] = field(default_factory=list)
    wrong_length: int = 0
    exchanges: int = 0
    """Identities or ends that change between two frames with truth."""
    message: str = ""

    @property
    def above_twice(self) -> int:
        """Good frames whose error is above twice the expected one."""
        return sum(
            good and true > _TWICE * expected
            for good, true, expected in zip(
                self.are_good, self.true_px, self.expected_px, strict=True
            )
        )


def judge(film: DescribedFilm, folder: Path) -> JudgedFilm:
    """Capture a film into a folder by the command, and compare."""
    out = JudgedFilm("/".join(film.path.parts[-2:]))
    track = folder / "track.npz"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [
            sys.executable, "-c", _COMMAND, "capture", str(film.path),
            "-o", str(track), "--force", "--json", *film.options,
        ],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    out.exit_code = done.returncode
    out.message = done.stderr.strip()
    spent_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    footage = open_footage(film.path)
    first = next(iter(footage.read()))
    megapixels = footage.count * first.shape[0] * first.shape[1] / 1e6
    out.cpu_s_per_megapixel = spent_s / megapixels
    captures = [load_capture(path).captured for path in _tracks(done.stdout)]
    animals = max(len(captures), len(film.animals), 1)
    out.frames = footage.count * animals
    for captured in captures:
        out.used += int(captured.used.sum())
        out.good += int(captured.good.sum())
        out.head_by, out.head_sure = captured.head_by, captured.head_sure
        if film.length_px is not None:
            off = np.abs(captured.length_px / film.length_px - 1.0)
            out.wrong_length += int((off > _LENGTH).sum())
        if film.lines_px:
            error = covered_error if film.lines_end_early else point_error
            compare_lines(out, captured, film.lines_px, error)
    if film.animals:
        compare_marks(out, captures, film.animals)
    return out


def _tracks(answer: str) -> list[Path]:
    """Tracks that an answer of the command names; they exist if it has not failed."""
    if not answer.strip():
        return []
    facts = json.loads(answer)
    every = [one["capture"] for one in facts["animals"]] if "animals" in facts else [facts]
    return [Path(one["track"]) for one in every if one is not None and "track" in one]


def compare_lines(
    out: JudgedFilm,
    captured: Capture,
    lines_px: dict[int, Floats],
    error: Callable[[Floats, Floats], float] = point_error,
) -> None:
    """Compare each line with the true one; a reversed line is not an error of its points."""
    right = []
    for k, true in lines_px.items():
        if k >= len(captured.status) or not captured.used[k]:
            continue
        found = captured.points_px[k]
        right.append(not swapped(found, true))
        _add(out, captured, k, error(found if right[-1] else found[::-1], true))
    out.heads.extend(right)
    out.exchanges += int(np.count_nonzero(np.diff(np.array(right, dtype=int))))


def compare_marks(out: JudgedFilm, captures: list[Capture], animals: tuple[Marks, ...]) -> None:
    """Compare each mark with the nearest line; a track that changes its animal is exchanged."""
    chosen: dict[str, list[int]] = {}
    for marks in animals:
        for k, ends in marks.ends_px.items():
            lines = [(number, one) for number, one in enumerate(captures) if one.used[k]]
            if not lines:
                out.head_px.append(float("nan"))
                out.tail_px.append(float("nan"))
                continue
            number, one = min(lines, key=lambda pair: _off(pair[1].points_px[k], ends[0]))
            line = one.points_px[k]
            if _off(line, ends[0]) > one.length_px[k]:  # a line of another animal
                out.head_px.append(float("nan"))
                out.tail_px.append(float("nan"))
                continue
            chosen.setdefault(marks.name, []).append(number)
            out.heads.append(bool(_off(line[:1], ends[0]) < _off(line[-1:], ends[0])))
            out.head_px.append(_off(line[:_HEAD_PART], ends[0]))
            out.tail_px.append(_off(line[-1:], ends[1]))
            _add(out, one, k, min(_ends_off(way, ends) for way in (line, line[::-1])))
    for numbers in chosen.values():
        out.exchanges += int(np.count_nonzero(np.diff(numbers)))


def _add(out: JudgedFilm, captured: Capture, frame: int, error_px: float) -> None:
    out.true_px.append(error_px)
    out.expected_px.append(float(captured.expected_px[frame]))
    out.are_good.append(bool(captured.good[frame]))


def _ends_off(line: Floats, ends: Floats) -> float:
    """Mean distance of the marks of both ends: the error of a point if it changes evenly."""
    return 0.5 * (_off(line[:_HEAD_PART], ends[0]) + _off(line[-1:], ends[1]))


def _off(points: Floats, place: Floats) -> float:
    return float(np.hypot(*(points - place).T).min())
