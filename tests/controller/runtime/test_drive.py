"""The drive of a run: what holds up its cycles."""

import gc
from itertools import count
from pathlib import Path

import pytest

from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runtime import drive
from tests.helpers.frozen import unfrozen


def test_a_garbage_collection_in_motion_goes_over_what_the_run_itself_has_made(
    tmp_path: Path,
) -> None:
    prepared = prepare_walk("flat-slalom", motion="serpenoid", time_limit_s=0.5)
    met: list[int] = []
    with unfrozen():
        before = len(gc.get_objects())
        run_robot(
            RunRequest(
                prepared, tmp_path, on_progress=lambda progress: met.append(len(gc.get_objects()))
            )
        )
        assert len(met) > 20
        assert max(met) < before / 4
        assert gc.get_freeze_count() == 0


@pytest.mark.slow
def test_a_process_of_many_runs_does_not_grow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run leaves 1,000 objects in cycles, which Python alone does not collect."""
    prepared = prepare_walk("flat-slalom", motion="serpenoid", time_limit_s=0.2)
    monkeypatch.setattr(drive, "RUNS_PER_COLLECTION", 2)
    monkeypatch.setattr(drive, "_ended_runs", count(1))
    objects = []
    with unfrozen():
        for number in range(6):
            run_robot(RunRequest(prepared, tmp_path / str(number)))
            objects.append(len(gc.get_objects()))
    assert objects[2] > objects[1] + 300
    assert objects[5] < objects[1] + 300
