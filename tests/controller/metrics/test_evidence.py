"""A number that needs a measured pose appears only where the pose was measured."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.runlog.evidence import SIMULATED, Kind, PoseEvidence
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord
from tests.helpers.command import snakewalk
from tests.helpers.short_run import SHORT_RUN

OF_THE_POSE = {
    field.name.removeprefix("dead_reckoned_")
    for field in dataclasses.fields(RunSummary)
    if field.name.startswith("dead_reckoned_")
}
RECKONED = (
    PoseEvidence(Kind.DEAD_RECKONED, "joints"),
    PoseEvidence(Kind.DEAD_RECKONED, "imu"),
)
MEASURED = (
    SIMULATED,
    PoseEvidence(Kind.MEASURED, "camera", 0.01, 0.05),
    PoseEvidence(Kind.ESTIMATED, "tags"),
)


def with_evidence(record: RunRecord, evidence: PoseEvidence) -> RunRecord:
    header = dataclasses.replace(record.header, pose_evidence=evidence)
    return dataclasses.replace(record, header=header)


def test_the_numbers_of_the_pose_are_those_that_issue_from_it() -> None:
    assert {
        "waypoints_reached",
        "waypoints_counted",
        "waypoint_times_s",
        "travelled_m",
        "path_error_mean_m",
        "path_error_max_m",
        "speed_m_s",
        "eta",
        "electrical_cost_of_transport",
        "mechanical_cost_of_transport",
    } == OF_THE_POSE


@pytest.mark.parametrize("evidence", RECKONED, ids=lambda e: e.source)
def test_dead_reckoning_gives_null_and_a_counterpart(
    record: RunRecord, evidence: PoseEvidence
) -> None:
    known = summary(with_evidence(record, SIMULATED)).to_dict()
    n = summary(with_evidence(record, evidence)).to_dict()
    assert n["pose_evidence"] == "dead-reckoned"
    assert n["pose_source"] == evidence.source
    for key in OF_THE_POSE:
        assert n[key] is None, key
        assert n[f"dead_reckoned_{key}"] == known[key], key
    assert n["outcome"] == "believes it reached 3 of 4 (dead reckoning)"


def test_an_unconfirmed_pose_measures_nothing(record: RunRecord) -> None:
    n = summary(with_evidence(record, PoseEvidence(Kind.UNCONFIRMED, "udp")))
    assert n.waypoints_reached is None
    assert n.outcome == "believes it reached 3 of 4 (unconfirmed pose)"


@pytest.mark.parametrize("evidence", MEASURED, ids=lambda e: e.source)
def test_a_measured_pose_gives_the_numbers(record: RunRecord, evidence: PoseEvidence) -> None:
    n = summary(with_evidence(record, evidence)).to_dict()
    assert n["pose_source"] == evidence.source
    assert n["waypoints_reached"] == 3
    assert [key for key in OF_THE_POSE if n[f"dead_reckoned_{key}"] is not None] == []


def test_an_uncertainty_that_the_source_measured_is_that_of_the_run(record: RunRecord) -> None:
    """A source without a stated accuracy has the largest of its poses; others keep theirs.

    Poses before the source agreed with the joints do not count.
    """
    measured = dataclasses.replace(
        record.pose_source,
        position_sd_m=np.array([np.nan, 0.2, 0.003, 0.1]),
        heading_sd_rad=np.array([np.nan, 0.01, 0.02, 0.03]),
        is_confirmed=np.array([True, False, True, True]),
    )
    for source, expected in (("tags", (0.1, 0.02)), ("camera", (0.01, 0.05))):
        (evidence,) = (each for each in MEASURED if each.source == source)
        n = summary(dataclasses.replace(with_evidence(record, evidence), pose_source=measured))
        assert (n.pose_position_sd_m, n.pose_heading_sd_rad) == expected


def test_the_other_assumptions_are_listed_with_their_source(record: RunRecord) -> None:
    header, assumed = record.header, summary(record).assumptions
    assert set(assumed) == {
        "friction_along",
        "friction_across",
        "friction_law",
        "mass_kg",
        "supply_v",
    }
    assert {each["kind"] for each in assumed.values()} == {"assumed"}
    assert assumed["friction_along"]["value"] == header.world.friction.along
    assert assumed["supply_v"]["source"] == f"robot {header.robot.name}"


def test_a_world_without_a_law_is_reported_as_the_assumed_ellipse(record: RunRecord) -> None:
    world = record.header.world
    friction = world.friction.model_copy(update={"law": None})
    header = dataclasses.replace(
        record.header, world=world.model_copy(update={"friction": friction})
    )
    law = summary(dataclasses.replace(record, header=header)).assumptions["friction_law"]
    assert (law["value"], law["source"]) == ("ellipse", f"default: {world.name} has no law")
    assert friction.law_text == "ellipse (assumed)"


@pytest.mark.slow_cases(1, "2 cases of 1.5 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("words", "code", "source"),
    [
        ((), 0, "simulator"),
        (("--pose", "joints"), 3, "joints"),
        (("--pose", "joints", "--accept-dead-reckoning"), 0, "joints"),
    ],
)
def test_a_run_states_its_evidence(
    words: tuple[str, ...], code: int, source: str, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    file, folder = tmp_path / "short.toml", tmp_path / "out"
    file.write_text(SHORT_RUN, encoding="utf-8")
    done = snakewalk("run", str(file), *words, "--no-film", "--json", "--out", str(folder))
    assert done.returncode == code, done.stderr
    said, numbers = json.loads(done.stdout), json.loads((folder / "summary.json").read_text())
    believed = source != "simulator"
    assert said["pose_source"] == numbers["pose_source"] == source
    assert said["waypoints_reached"] == (None if believed else 1)
    assert ("pose: dead-reckoned from joints" in done.stderr) == believed
    assert numbers["port_is_pseudo_terminal"] is None
    for key in OF_THE_POSE:
        assert (numbers[key] is None) == believed, key
    if believed:
        assert said["dead_reckoned_waypoints_reached"] == 1
        assert numbers["outcome"] == "believes it reached 1 of 1 (dead reckoning)"
        page = (folder / "report.html").read_text(encoding="utf-8")
        assert "fair outcome" in page
        assert "by dead reckoning" in page
        assert "exit code 3: the arrival is dead-reckoned" in page
    record = read_log(folder / "log.mcap")
    assert record.header.pose_evidence.source == source
    claims = [event.text for event in record.events if event.kind in ("waypoint", "stop")]
    assert len(claims) == 2
    for claim in claims:
        assert claim.endswith("(dead reckoning)") == believed, claim
