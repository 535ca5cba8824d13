"""Points of a sweep that MuJoCo-Warp simulates together; needs the extra ``warp``."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from snakewalk.config.errors import InputError
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.metrics.summary import summary
from snakewalk.controller.metrics.travel import travel
from snakewalk.controller.run.external.gait_batch import run_together
from snakewalk.controller.run.external.robot_batch import batch_fault
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.studies.sweep_measure import (
    Measurement,
    measure,
    measurement,
    prepared_point,
)
from snakewalk.controller.studies.sweep_points import Point
from snakewalk.sim.batch.warp_bodies import WarpBodies, device_name

BATCH = 256
"""Most robots of a batch: each has its log open (ours)."""
Result = tuple[Point, Measurement]


def measure_together(points: Sequence[Point], device: str | None) -> Iterator[Result]:
    """Yield the points of each batch, then those of the compiled simulator."""
    groups: dict[tuple[object, ...], list[tuple[Point, GaitRun]]] = {}
    others: list[Point] = []
    reasons: dict[str, None] = {}
    for point in points:
        try:
            prepared = prepared_point(point)
            prepared.check_plan()
        except InputError as error:
            yield point, Measurement(f"refused: {error.faults[0]}")
            continue
        fault = batch_fault(prepared.run, prepared.robot, prepared.world)
        if fault is not None:
            others.append(point)
            reasons[fault] = None
            continue
        body = point.robot, point.keys, point.seconds
        groups.setdefault(body, []).append((point, prepared))
    for group in groups.values():
        for first in range(0, len(group), BATCH):
            yield from _run_together(group[first : first + BATCH], device)
    if others:
        LOGGER.warning(
            "%d of %d points run on the compiled simulator: %s",
            len(others),
            len(points),
            "; ".join(reasons),
        )
    for point in others:
        yield point, measure(point)


def _run_together(part: Sequence[tuple[Point, GaitRun]], device: str | None) -> Iterator[Result]:
    with TemporaryDirectory() as folder:
        logs = [Path(folder) / f"{number}.mcap" for number in range(len(part))]
        outcomes = run_together(
            [prepared for _, prepared in part], logs, partial(WarpBodies, device=device)
        )
        for (point, _), log, outcome in zip(part, logs, outcomes, strict=True):
            record = read_log(log)
            moved = travel(record)
            yield (
                point,
                measurement(
                    record,
                    summary(record, moved),
                    moved,
                    tripped=outcome.tripped,
                    least_rate=outcome.least_rate,
                    backend=f"warp:{device_name(device)}",
                ),
            )
