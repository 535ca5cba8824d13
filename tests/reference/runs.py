"""Joint commands and wire bytes of thirteen runs, as hashes."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import snakewalk
from snakewalk.config.camera import MappingConfig
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.pose import TrackerConfig
from snakewalk.config.schedule import ScheduleConfig
from snakewalk.controller.rehearsal.rehearsal import (
    LATE_S,
    SimulatedPort,
    generator,
    moved,
)
from snakewalk.controller.repertoire.prepare_schedule import prepare_schedule
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record
from snakewalk.controller.run.deviation import Deviation
from snakewalk.controller.run.external.served_robot import ServedRobot, Serving, place_of
from snakewalk.controller.run.factory import changed, prepare_job, prepare_playback
from snakewalk.controller.runlog.record import RunRecord
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


@dataclass(frozen=True, slots=True)
class ReferenceRun:
    """A run whose commands and bytes are compared."""

    prepare: Callable[[], Any]
    shadow: bool = False
    is_rehearsed: bool = False
    """Whether a simulated robot is served on its port, with errors and a tracker."""

    def record(self, folder: Path) -> tuple[RunRecord, list[WireHash]]:
        """Run it; return its log and the bytes of its lines, without those of its preparation."""
        prepared = self.prepare()
        with ExitStack() as stack:
            lines = stack.enter_context(hashed_wires())
            port = stack.enter_context(_served(prepared, folder)) if self.is_rehearsed else None
            done = snakewalk.run_robot(
                snakewalk.RunRequest(prepared, folder, port, shadow=self.shadow, stoppable=False)
            )
        return done.record, lines


@contextmanager
def _served(prepared: Any, folder: Path) -> Iterator[SimulatedPort]:
    rng = generator(1)
    place = moved(place_of(prepared), rng)
    tracker = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
    serving = Serving(tracker, Deviation.drawn(prepared.robot, rng), LATE_S, 1)
    truth = folder.parent / f"{folder.name}.jsonl"
    with ServedRobot(prepared.robot, prepared.world, place, serving, truth) as served:
        yield SimulatedPort(served)


def _mapped() -> Any:
    prepared = prepare_job(
        "random-10", robot="alternating16-stereo", motion="serpenoid", seed=1, time_limit_s=2.5
    )
    often = MappingConfig(replan_bodies=0.3)
    return changed(prepared, run=prepared.run.model_copy(update={"mapping": often}))


def runs(folder: Path) -> dict[str, ReferenceRun]:
    """Return the runs by name; the repertoire is recorded in ``folder``."""
    job, gait = prepare_job, snakewalk.prepare_gait
    camera = partial(job, "flat-square", pose="camera", motion="serpenoid")
    tracked = partial(job, "flat-square", pose="udp:9870")
    plain = {
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
        "map": _mapped,
    }
    return {name: ReferenceRun(prepare) for name, prepare in plain.items()} | {
        "rehearsal": ReferenceRun(lambda: _limited(tracked, 5.0), is_rehearsed=True),
        "shadow": ReferenceRun(lambda: gait("lateral-undulation", seconds=3.0), shadow=True),
    }


def hashes_of(run: ReferenceRun, folder: Path) -> Hashes:
    """Run one of them; hashes of its joint commands and wire bytes, and their counts."""
    record, lines = run.record(folder)
    sent_rad = record.cycle.sent_rad
    return {
        "cycles": len(sent_rad),
        "goals": hashlib.sha256(sent_rad.tobytes()).hexdigest()[:16],
        "bytes": sum(line.count for line in lines),
        "wire": "+".join(line.digest.hexdigest()[:16] for line in lines),
    }
