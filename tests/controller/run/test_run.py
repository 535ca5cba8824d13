"""The main job over real packet bytes: simulated servos, MuJoCo body, log and summary."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.console.options import DEFAULT_RUN
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log


def short(**changes: object) -> WalkRun:
    near = {"waypoints_m": ((1.2, 0.3),), "time_limit_s": 30.0}
    return prepare_walk("flat-slalom", **near | changes)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory):
    return run_robot(RunRequest(short(seed=4), tmp_path_factory.mktemp("run")))


def test_the_waypoint_is_reached_without_a_trip_or_a_missed_deadline(finished) -> None:
    assert finished.outcome.complete
    numbers = finished.summary
    assert numbers.missed_deadlines == 0
    assert numbers.failed_reads == 0
    assert numbers.vetoes == 0
    assert numbers.wire_use_max < 1.0


def test_joints_follow_within_the_honest_lag_of_the_servos(finished) -> None:
    record = read_log(finished.log)
    lead = np.abs(record.cycle.asked_rad - record.cycle.measured_rad)
    assert lead.max() < 0.25
    assert np.abs(record.cycle.current_a).max() < 2.3 * 0.5  # half of the stall current


@contextmanager
def on_core(core: int) -> Iterator[None]:
    """This process alone on one of its cores, where the system lets it choose."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@pytest.mark.slow
def test_same_seed_and_configuration_give_byte_identical_logs_on_every_core(
    finished, tmp_path: Path
) -> None:
    cores = sorted(os.sched_getaffinity(0))[:2] if hasattr(os, "sched_getaffinity") else [0, 1]
    for core in cores:
        with on_core(core):
            again = run_robot(RunRequest(short(seed=4), tmp_path / f"core{core}"))
        assert again.log.read_bytes() == finished.log.read_bytes()


@pytest.mark.slow
def test_another_seed_gives_other_commands(finished, tmp_path: Path) -> None:
    other = run_robot(RunRequest(short(seed=5), tmp_path / "other"))
    sent = [read_log(f.log).cycle.sent_rad[200:500] for f in (finished, other)]
    assert not np.array_equal(*sent)


@pytest.mark.slow
def test_isotropic_ground_sounds_the_alarm_for_missing_advance(tmp_path: Path) -> None:
    prepared = short(motion="serpenoid", time_limit_s=15.0)
    same = FrictionConfig(along=0.4, across=0.4)

    class Slippery(WalkRun):
        """Believes in the configured friction; the ground has another."""

        def __init__(self, like: WalkRun) -> None:
            super().__init__(like.run, like.robot, like.world.model_copy(update={"friction": same}))
            self.__dict__["gain"] = like.gain

    finished = run_robot(RunRequest(Slippery(prepared), tmp_path))
    assert finished.outcome.reached == 0
    assert finished.outcome.alarms > 0
    kinds = [event.kind for event in read_log(finished.log).events]
    assert "alarm" in kinds


def test_a_port_that_is_not_there_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="/dev/nosuch"):
        run_robot(RunRequest(short(motion="serpenoid"), tmp_path / "run", port="/dev/nosuch"))
    assert not (tmp_path / "run").exists()


@pytest.mark.costs("a whole run")
def test_the_default_job_starts_over_the_hills(tmp_path: Path) -> None:
    prepared = prepare_walk(DEFAULT_RUN, time_limit_s=4.0)
    assert prepared.ground is not None
    finished = run_robot(RunRequest(prepared, tmp_path))
    assert finished.outcome.tripped is None
    record = read_log(finished.log)
    pitch = list(prepared.robot.pitch_joints)
    assert np.abs(record.cycle.asked_rad[:, pitch]).max() > 0.02, "the ground step drives them"
    assert (record.pose.rotation[:, 2, 2] > 0.9).all(), "the head stays upright"
    way = record.pose.centre_m[-1] - record.pose.centre_m[0]
    assert np.hypot(way[0], way[1]) > 0.2
    above = record.pose.links_m[:, :, 2] - prepared.ground.elevation_m(
        record.pose.links_m[:, :, 0], record.pose.links_m[:, :, 1]
    )
    assert 0.02 < above.min() < above.max() < 0.12
