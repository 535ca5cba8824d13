"""``python -m benchmarks.films FOLDER [--rendered] [--seed N] [--only WORD]``: capture all films.

A TOML file beside a film, or in this package, states source, licence and truth
(``described_film.py``). Prints a Markdown table: frames used, good, above twice the expected error,
exchanges, distances of marked heads and tails, CPU time.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.films.described_film import films_of
from benchmarks.films.judged_film import JudgedFilm, judge
from benchmarks.films.rendered import write_rendered

HEADS = (
    "film", "used", "good", "good above twice", "error px (expected)", "head right", "exchanges",
    "eyes off px", "tail off px", "wrong length", "head by", "CPU s / MP", "exit",
)  # fmt: skip


def main() -> int:
    """Run the films, print a row for each as it is done, and the totals."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.films", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, nargs="?", help="folder of films")
    parser.add_argument("--rendered", action="store_true", help="also run rendered films")
    parser.add_argument("--seed", type=int, default=0, help="other rendered films, above 0")
    parser.add_argument("--only", default="", metavar="WORD", help="only films with this word")
    given = parser.parse_args()
    if given.folder is None and not given.rendered:
        parser.error("give a FOLDER of films, or --rendered")
    if given.folder is not None and not given.folder.is_dir():
        parser.error(f"{given.folder}: is no folder; give a folder of films")
    print("| " + " | ".join(HEADS) + " |")
    print("| --- |" + " --- |" * (len(HEADS) - 1))
    done = []
    with tempfile.TemporaryDirectory() as scratch:
        folders = [] if given.folder is None else [given.folder.resolve()]
        if given.rendered:
            folders.append(Path(scratch, "rendered"))
            write_rendered(folders[-1], given.seed)
        for film in (one for folder in folders for one in films_of(folder)):
            if given.only in str(film.path):
                done.append(judge(film, Path(scratch)))
                print(row_of(done[-1]), flush=True)
    print(summary(done))
    return 0


def row_of(one: JudgedFilm) -> str:
    """One film as a line of the table."""
    known = bool(one.true_px)
    error = f"{np.median(one.true_px):.2f} ({np.median(one.expected_px):.2f})" if known else "-"
    heads = f"{sum(one.heads)} of {len(one.heads)}" if known else "-"
    cells = (
        one.name,
        f"{one.used} of {one.frames}",
        str(one.good),
        f"{one.above_twice} of {sum(one.are_good)}" if known else "-",
        error,
        heads,
        str(one.exchanges) if known else "-",
        _distances(one.head_px),
        _distances(one.tail_px),
        str(one.wrong_length),
        f"{one.head_by} {one.head_sure:.2f}",
        f"{one.cpu_s_per_megapixel:.2f}",
        str(one.exit_code),
    )
    return "| " + " | ".join(cells) + " |"


def _distances(px: list[float]) -> str:
    """Median and largest distance over all marks; a mark without a line counts as infinite."""
    if not px:
        return "-"
    every = np.nan_to_num(px, nan=np.inf)
    return f"{np.median(every):.1f} (most {every.max():.1f})"


def summary(done: list[JudgedFilm]) -> str:
    """The calibration of the expected error and of the head's certainty over all films."""
    good = [
        (true, expected, 2 * k < len(one.true_px))
        for one in done
        for k, (true, expected) in enumerate(zip(one.true_px, one.expected_px, strict=True))
        if one.are_good[k]
    ]
    lines = []
    if good:
        true, expected, is_first = np.array(good).T
        halves = {"": np.ones(len(true), bool), "First half of each film: ": is_first > 0.0}
        halves["Second half: "] = is_first == 0.0
        for words, part in halves.items():
            above = int((true > 2.0 * expected)[part].sum())
            count = int(part.sum())
            ratio = float(np.median(expected[part]) / np.median(true[part])) if count else np.nan
            lines.append(
                f"{words}{above} of {count} good frames with truth ({above / max(count, 1):.1%}) "
                "are above twice their expected error; median expected over median true error "
                f"{ratio:.2f}."
            )
        lines[0] = f"\n{lines[0]}"
        for quarter in np.array_split(np.argsort(expected), min(4, len(good))):
            share = float((true[quarter] > 2.0 * expected[quarter]).mean())
            low, high = expected[quarter[[0, -1]]]
            lines.append(
                f"Expected {low:.2f} to {high:.2f} px: {len(quarter)} frames, median true error "
                f"{np.median(true[quarter]):.2f} px, above twice {share:.1%}."
            )
    judged = [(0.5 + 0.5 * one.head_sure, np.mean(one.heads) > 0.5) for one in done if one.heads]
    if judged:
        for low, high in ((0.5, 0.8), (0.8, 0.9), (0.9, 0.97), (0.97, 1.01)):
            here = [right for sure, right in judged if low <= sure < high]
            if here:
                lines.append(
                    f"Probability of the head {low:g} to {min(high, 1.0):g}: right in {sum(here)} "
                    f"of {len(here)} films."
                )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
