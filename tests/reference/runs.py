"""Joint commands and wire bytes of ten runs, as hashes."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import snakewalk
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.playback import ScheduleConfig
from snakewalk.controller.repertoire.prepare_schedule import prepare_schedule
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record
from snakewalk.controller.run.factory import prepare_job, prepare_playback
from snakewalk.sim.line import wire

Hashes = dict[str, str | int]


class WireHash:
    """Hash of all bytes on a line, in both directions."""

    def __init__(self) -> None:
        self.digest, self.count = hashlib.sha256(), 0

    def tap(self, _end_s: float, is_sent: bool, data: bytes) -> None:
        """Take in a packet."""
        self.digest.update(b"%d" % is_sent + bytes(data))
        self.count += len(data)


@contextmanager
def hashed_wires() -> Iterator[list[WireHash]]:
    """Hash the bytes of every line that is made in the context."""
    hashes: list[WireHash] = []
    original = wire.Wire.__init__

    def init(line: Any, *args: Any, **options: Any) -> None:
        original(line, *args, **options)
        hashes.append(WireHash())
        line.taps.append(hashes[-1].tap)

    wire.Wire.__init__ = init  # type: ignore[method-assign]
    try:
        yield hashes
    finally:
        wire.Wire.__init__ = original  # type: ignore[method-assign]


def _limited(prepare: Callable[[], Any], limit_s: float) -> Any:
    prepared = prepare()
    run = prepared.run.model_copy(update={"time_limit_s": limit_s})
    return replace(prepared, run=run)


def _repertoire(folder: Path) -> Any:
    quick = tuple(action for action in ACTIONS if action.frequency_hz > 0.4)
    file = folder / "repertoire.npz"
    record(load_robot("yaw16"), load_world("flat"), quick).save(file)
    return prepare_schedule(file, ScheduleConfig(speed_m_s=0.5, duration_s=4.0))


def runs(folder: Path) -> dict[str, Callable[[], Any]]:
    """Return what prepares each run, by name; the repertoire is recorded in ``folder``."""
    job, gait = prepare_job, snakewalk.prepare_gait
    camera = partial(job, "flat-square", pose="camera", motion="serpenoid")
    return {
        "flat-walk": lambda: _limited(partial(job, "flat-square"), 8.0),
        "traverse": lambda: _limited(partial(job, "jacksboro-traverse"), 8.0),
        "ramp": lambda: _limited(partial(job, "ramp-10-up"), 6.0),
        "sidewinding": lambda: gait("sidewinding", seconds=4.0),
        "lateral-undulation": lambda: gait("lateral-undulation", seconds=4.0),
        "playback": lambda: _limited(partial(prepare_playback, "worm-like"), 8.0),
        "repertoire": lambda: _repertoire(folder),
        "camera": lambda: _limited(camera, 5.0),
        "swimming": lambda: gait("subcarangiform", seconds=4.0),
        "salamander": lambda: _limited(partial(job, "salamander-square"), 6.0),
    }


def hashes_of(prepare: Callable[[], Any], folder: Path) -> Hashes:
    """Run one of them; hashes of its joint commands and wire bytes, and their counts."""
    prepared = prepare()  # the recording of a repertoire has lines of its own
    with hashed_wires() as lines:
        sent_rad = snakewalk.execute(prepared, folder, stoppable=False).record.cycle.sent_rad
    return {
        "cycles": len(sent_rad),
        "goals": hashlib.sha256(sent_rad.tobytes()).hexdigest()[:16],
        "bytes": sum(line.count for line in lines),
        "wire": "+".join(line.digest.hexdigest()[:16] for line in lines),
    }
