"""A simulated walk finds the friction that its ground has, and not its file."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord


def walked(folder: Path, run: str, **told: object) -> tuple[RunRecord, RunSummary]:
    """Its first seconds."""
    keys = {"run.time_limit_s": 12.0} | {f"run.{key}": value for key, value in told.items()}
    finished = run_robot(RunRequest(prepare_job(run, keys=keys), folder, stoppable=False))
    return finished.record, finished.summary


PLANTED = {"deviation.friction_along": 1.5, "deviation.friction_across": 0.8}


@pytest.fixture(scope="module")
def slalom(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunRecord, RunSummary]:
    """Walk on a floor with other friction than its file states."""
    return walked(tmp_path_factory.mktemp("slalom"), "flat-slalom", **PLANTED)


@pytest.mark.fast_cases(1)
@pytest.mark.costs("a walk until the friction is known")
@pytest.mark.parametrize("run", ["flat-slalom", "jacksboro-traverse"])
def test_what_was_planted_is_found_told_and_summarised(
    run: str, slalom: tuple[RunRecord, RunSummary], tmp_path: Path
) -> None:
    on_floor = run == "flat-slalom"
    record, summary = slalom if on_floor else walked(tmp_path / "run", run, **PLANTED)
    found = summary.friction_found
    assert found is not None
    assert found.along_95[0] < 0.15 < found.along_95[1]
    assert found.across_95[0] < 0.56 < found.across_95[1]
    assert found.across / found.along == pytest.approx(0.56 / 0.15, rel=0.12)
    assert (found.along_file, found.across_file) == (0.1, 0.7)
    told = [event.text for event in record.events if event.kind == "friction"]
    assert told[0].startswith("found 0.1")


@pytest.mark.nightly("two whole walks: 6 s of CPU")
def test_a_body_as_its_files_say_walks_as_if_nothing_looked(tmp_path: Path) -> None:
    """Heavier or weaker by a fifth is no other friction."""
    looked, summary = walked(tmp_path / "looked", "flat-slalom")
    plain, _ = walked(tmp_path / "plain", "flat-slalom", **{"walk.finds_friction": False})
    np.testing.assert_array_equal(looked.cycle.sent_rad, plain.cycle.sent_rad)
    found = summary.friction_found
    assert found is not None
    assert found.along_95[0] < 0.1 < found.along_95[1]
    assert len(plain.friction.time_s) == 0
    for name, kind in (("heavy", "mass"), ("weak", "torque")):
        other, _ = walked(
            tmp_path / name, "flat-slalom", **{f"deviation.{kind}": 1.2 if kind == "mass" else 0.8}
        )
        assert not [event for event in other.events if event.kind == "friction"]


@pytest.mark.slow
def test_the_same_run_finds_the_same(slalom: tuple[RunRecord, RunSummary], tmp_path: Path) -> None:
    one, _ = slalom
    two, _ = walked(tmp_path / "two", "flat-slalom", **PLANTED)
    np.testing.assert_array_equal(one.friction.along, two.friction.along)
    np.testing.assert_array_equal(one.cycle.sent_rad, two.cycle.sent_rad)


@pytest.mark.nightly("a further walk: 2 s of CPU")
def test_a_pose_by_the_joints_tells_nothing_of_friction(tmp_path: Path) -> None:
    """It takes the friction as known."""
    _, summary = walked(tmp_path / "run", "flat-slalom", pose="joints")
    assert summary.friction_found is None


@pytest.mark.nightly("a camera's picture in every cycle of a walk: 13 s of CPU")
def test_a_camera_measures_it_on_paper(tmp_path: Path) -> None:
    _, summary = walked(tmp_path / "run", "flat-square", pose="camera", **PLANTED)
    found = summary.friction_found
    assert found is not None
    assert found.across / found.along == pytest.approx(0.56 / 0.15, rel=0.3)
