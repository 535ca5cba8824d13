"""``python -m benchmarks.wrong_poses [KIND ...]``: rehearsals with poses that are wrong.

A served robot is rehearsed with a tracker of 1 cm, 3 degrees and 100 ms of error, whose poses are
changed as KIND says before they arrive. A claim is false if the true body did not come to a claimed
waypoint within its radius and twice the accuracy that the run states. Blind are the waves that the
body makes in a row without a pose that is confirmed and new. ``good`` changes nothing.
``--write FILE`` keeps rows as lines of JSON; cases in it are not repeated.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.pose_errors import KINDS, Change, changes, source_of
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError
from snakewalk.controller.pose.udp_feed import SimulatedDatagrams
from snakewalk.controller.rehearsal import judgement, rehearsal
from snakewalk.controller.runlog.record import RunRecord

TRACKER: Final = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
MOST_BLIND: Final = 2.0
"""Waves that a body may make without a pose."""
OLD_S: Final = 0.5
"""Age of a pose that dead reckoning bridges (``pose.max_age_s``)."""


class WrongSource:
    """Changes the poses of a simulated tracker."""

    def __init__(self, change: Change) -> None:
        self._change = change
        self._first: PoseSample | None = None

    def __call__(self, arrived: ArrivedPose) -> list[ArrivedPose]:
        """Return the messages that arrive instead."""
        sample = arrived.sample
        if not isinstance(sample, PoseSample):
            return [arrived]
        self._first = self._first or sample
        try:
            sent = self._change(sample, self._first, sample.time_s - self._first.time_s)
        except UnusablePoseError as fault:
            return [replace(arrived, sample=fault)]
        samples = [sent] if isinstance(sent, PoseSample) else sent
        return [replace(arrived, sample=each) for each in samples]


def blind_waves(record: RunRecord) -> float:
    """Return the waves of the longest part of a run without a confirmed, new pose.

    A joint that goes up and down through its whole range makes one wave.
    """
    source = record.pose_source
    sent_rad = np.nan_to_num(record.cycle.sent_rad)
    range_rad = np.ptp(sent_rad, axis=0)
    moves = range_rad > 0.1
    if len(source.time_s) < 2 or not moves.any():
        return 0.0
    steps = np.abs(np.diff(sent_rad[:, moves], axis=0, prepend=sent_rad[:1, moves]))
    waves = np.cumsum((steps / (2.0 * range_rad[moves])).mean(axis=1))
    made = np.interp(source.time_s, record.cycle.time_s, waves)
    is_blind = (source.is_confirmed == 0) | ~(source.age_s <= OLD_S)
    most = 0.0
    begun: float | None = None
    for blind, total in zip(is_blind, made, strict=True):
        begun = (total if begun is None else begun) if blind else None
        most = max(most, 0.0 if begun is None else float(total - begun))
    return most


def rehearsed(kind: str, run: str, seed: int, has_errors: bool) -> dict[str, Any]:
    """Rehearse a run with a kind of wrong poses."""
    source = WrongSource(changes()[kind]())
    true = SimulatedDatagrams.arrived
    blind: list[float] = []

    def arrived(self: SimulatedDatagrams, now_s: float) -> Sequence[ArrivedPose]:
        return [sent for each in true(self, now_s) for sent in source(each)]

    def judged(truth: Any, record: RunRecord, numbers: Any) -> Any:
        blind.append(blind_waves(record))
        return judgement.judge(truth, record, numbers)

    with (
        patch.object(SimulatedDatagrams, "arrived", arrived),
        patch.object(rehearsal, "judge", judged),
    ):
        row = rehearsal.rehearse(rehearsal.RehearsalCase(run, seed, has_errors, TRACKER))
    return row | {"kind": kind, "blind_waves": round(max(blind, default=0.0), 2)}


def line_of(row: dict[str, Any]) -> dict[str, Any]:
    """Return the short row of a rehearsal."""
    counts = {key: row.get(key, 0) for key in ("claimed", "reached_as_stated", "truly_reached")}
    more = {key: row.get(key) for key in ("blind_waves", "position_sd_m", "duration_s")}
    end = row.get("error") or row["verdict"]
    return (
        {key: row[key] for key in ("kind", "run", "seed", "has_errors")}
        | counts
        | more
        | {"end": end}
    )


def shown(rows: list[dict[str, Any]]) -> Table:
    """Return the table of rows."""
    columns = ("pose", "seed", "claimed", "as stated", "true", "s.d. m", "blind waves", "end")
    table = Table(*columns)
    keys = ("kind", "seed", "claimed", "reached_as_stated", "truly_reached", "position_sd_m")
    for row in rows:
        table.add_row(*(str(row[key]) for key in (*keys, "blind_waves", "end")))
    return table


def markdown(rows: list[dict[str, Any]]) -> str:
    """Return a table for a page: one line for each kind."""
    lines = ["| pose | claimed | true | stated, m | blind waves | end |", "| --- |" + " --- |" * 5]
    by_kind = {kind.name: kind for kind in KINDS}
    for name in dict.fromkeys(row["kind"] for row in rows):
        mine = [row for row in rows if row["kind"] == name]
        text = f"[{name}]({source_of(by_kind[name])})" if name in by_kind else name
        claimed, true = (
            ", ".join(str(row[key]) for row in mine) for key in ("claimed", "truly_reached")
        )
        stated = ", ".join(
            "-" if row["position_sd_m"] is None else f"{row['position_sd_m']:.2f}" for row in mine
        )
        blind = ", ".join(f"{row['blind_waves']:.1f}" for row in mine)
        end = mine[0]["end"].split(";")[0].replace("|", "/")
        lines.append(f"| {text} | {claimed} | {true} | {stated} | {blind} | {end} |")
    return "\n".join(lines)


def main() -> int:
    """Rehearse and print a table; 1 if a claim is false, or a body is blind for too long."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wrong_poses", description=__doc__)
    parser.add_argument(
        "kinds", nargs="*", metavar="KIND", help=", ".join(changes()).replace("%", "%%")
    )
    parser.add_argument("--run", default="flat-slalom")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--errors", action="store_true", help="robot and ground have errors, too")
    parser.add_argument("--write", type=Path, help="file of rows")
    parser.add_argument("--most", type=int, default=10_000, help="largest number of new rehearsals")
    parser.add_argument("--markdown", action="store_true", help="print a table for a page")
    given = parser.parse_args()
    kept = given.write
    lines = kept.read_text().splitlines() if kept is not None and kept.exists() else []
    rows = [json.loads(line) for line in lines]
    done = {(row["kind"], row["run"], row["seed"], row["has_errors"]) for row in rows}
    new = 0
    for seed in range(given.first_seed, given.first_seed + given.seeds):
        for kind in given.kinds or changes():
            key = (kind, given.run, seed, given.errors)
            if key in done or new >= given.most:
                continue
            new += 1
            rows.append(line_of(rehearsed(*key)))
            if kept is not None:
                with kept.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
    order = list(changes())
    rows.sort(key=lambda row: (order.index(row["kind"]), row["seed"]))
    if given.markdown:
        print(markdown(rows))
    else:
        Console(width=170).print(shown(rows))
    false = sum(row["claimed"] > row["reached_as_stated"] for row in rows)
    blind = sum(row["blind_waves"] > MOST_BLIND for row in rows)
    print(f"{len(rows)} rehearsals; false claims: {false}; blind for more than 2 waves: {blind}")
    return int(false + blind > 0)


if __name__ == "__main__":
    raise SystemExit(main())
