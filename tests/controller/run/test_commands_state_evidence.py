"""All commands that run something, with all kinds of pose sources: no number without its source."""

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from snakewalk.controller.metrics.summary import RunSummary, summary
from snakewalk.controller.metrics.travel import travel
from snakewalk.controller.run import results, run_for_user
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.results import Artifacts
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.evidence import SIMULATED, Kind, PoseEvidence
from snakewalk.controller.studies import sweep_measure, trials
from snakewalk.controller.studies.run_comparison import compared_run
from snakewalk.controller.studies.sweep_points import Point
from tests.helpers.command import snakewalk
from tests.helpers.short_run import SHORT_RUN

pytest.importorskip("mujoco")

EVIDENCE = (
    SIMULATED,
    PoseEvidence(Kind.MEASURED, "udp", 0.01, 0.05),
    PoseEvidence(Kind.ESTIMATED, "tags"),
    PoseEvidence(Kind.DEAD_RECKONED, "joints"),
    PoseEvidence(Kind.DEAD_RECKONED, "imu"),
)
GAIT = ("gait", "run", "lateral-undulation", "--seconds", "5")
COMMANDS = {
    "run": ("run", "short.toml"),
    "gait run": GAIT,
    "gait run --then": (*GAIT[:-1], "2", "--then", "lateral-undulation@1"),
    "play": ("play", "still.csv"),
    "gait policy run": ("gait", "policy", "run", "wave-cma", "--seconds", "2"),
}
OF_THE_POSE = {
    field.name.removeprefix("dead_reckoned_")
    for field in dataclasses.fields(RunSummary)
    if field.name.startswith("dead_reckoned_")
} | {
    *("forward_body_lengths_cycle", "left_body_lengths_cycle", "up_body_lengths_cycle"),
    *("turn_rad_cycle", "forward_bl_cycle", "left_bl_cycle", "climb_m_s", "cost_of_transport"),
    *("mechanical_cost", "slip", "path_error_m", "path_error_max_m"),
}
Run = Callable[[PoseEvidence], Mapping[str, Any]]


def check(numbers: Mapping[str, Any], evidence: PoseEvidence) -> None:
    """Check the numbers that a command gives of one run."""
    known = [key for key, value in numbers.items() if value is not None and value == value]
    measured = [key for key in known if key in OF_THE_POSE]
    believed = [key for key in known if key.startswith("dead_reckoned_")]
    assert (measured if evidence.is_measured else believed) or "peak_current_a" in numbers
    assert not (believed if evidence.is_measured else measured)
    assert numbers["pose_evidence"] == str(evidence.kind)
    assert numbers["pose_source"] == evidence.source


def known_by(finished: RunResult, evidence: PoseEvidence) -> RunResult:
    """Return what a run leaves if its pose is known in this way."""
    header = dataclasses.replace(finished.record.header, pose_evidence=evidence)
    record = dataclasses.replace(finished.record, header=header)
    return dataclasses.replace(
        finished, record=record, summary=summary(record), travel=travel(record)
    )


@pytest.fixture(scope="module")
def patched() -> Iterator[pytest.MonkeyPatch]:
    with pytest.MonkeyPatch.context() as patch:
        none = Artifacts(None, None, ())
        patch.setattr(results, "write_artifacts", lambda *args, **options: none)
        yield patch


@pytest.fixture(scope="module", params=COMMANDS)
def command(
    request: pytest.FixtureRequest,
    patched: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
) -> Run:
    """Run a command once, and return what it prints for each kind of evidence."""
    folder = tmp_path_factory.mktemp("command")
    (folder / "short.toml").write_text(SHORT_RUN, encoding="utf-8")
    points = [f"{0.2 * k},{k},{p},{-0.05 * p},0" for k in range(8) for p in range(21)]
    text = "\n".join(["t,frame,point,x_m,y_m", *points])
    (folder / "still.csv").write_text(text, encoding="utf-8")
    kept: list[RunResult] = []
    words = [str(folder / w) if (folder / w).exists() else w for w in COMMANDS[request.param]]

    def once(request: RunRequest) -> RunResult:
        if not kept:
            kept.append(run_robot(request))
        return known_by(kept[0], given[0])

    given: list[PoseEvidence] = [SIMULATED]
    patched.setattr(run_for_user, "run_robot", once)

    def said(evidence: PoseEvidence) -> Mapping[str, Any]:
        given[0] = evidence
        done = snakewalk(*words, "--no-film", "--json", "--force", "--out", str(folder / "out"))
        is_run = request.param == "run"
        assert done.returncode == (0 if evidence.is_measured or not is_run else 3), done.stderr
        numbers: Mapping[str, Any] = json.loads(done.stdout)
        return numbers

    return said


@pytest.mark.slow_cases(8, "23 cases of 0.3 s of CPU")
@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("evidence", EVIDENCE, ids=lambda evidence: evidence.source)
def test_a_command_states_the_evidence_of_its_numbers(command: Run, evidence: PoseEvidence) -> None:
    check(command(evidence), evidence)


@pytest.fixture(scope="module")
def gait_run(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    prepared = trials.prepare_case(
        trials.Case("lateral-undulation", "gait"), 0, 0.0, {"seconds": 5.0}
    )
    return run_robot(RunRequest(prepared, tmp_path_factory.mktemp("gait"), stoppable=False))


@pytest.mark.parametrize("evidence", EVIDENCE, ids=lambda evidence: evidence.source)
def test_a_study_states_the_evidence_of_its_numbers(
    gait_run: RunResult, evidence: PoseEvidence, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    finished = known_by(gait_run, evidence)
    for module in (sweep_measure, trials):
        monkeypatch.setattr(module, "run_robot", lambda request: finished)
    trial = trials.run_trial(trials.Case("lateral-undulation", "gait"), 0, 0.0, {"seconds": 5.0})
    assert trial.cause == ""
    check({**dataclasses.asdict(trial), "peak_current_a": 0.0}, evidence)
    (row,) = trials.table([trial], [trial.case])
    assert row.pose == f"{evidence.kind} ({evidence.source})"
    check(compared_run(finished.record, "a").summary.to_dict(), evidence)
    point = sweep_measure.measure(Point("lateral-undulation", "yaw16", "flat", 0, 0, 5.0))
    if evidence.is_measured:
        check(dataclasses.asdict(point), evidence)
    else:
        assert point == sweep_measure.Measurement(
            "refused: dead-reckoned pose; a sweep needs a measured one"
        )


def test_a_sweep_computes_the_travel_of_a_point_once(
    gait_run: RunResult, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from snakewalk.controller.metrics import displacement
    from snakewalk.controller.metrics import travel as travels

    calls: list[int] = []

    def counted(record: Any) -> Any:
        calls.append(1)
        return displacement.gait_displacement(record)

    for module in (travels, sweep_measure):
        monkeypatch.setattr(module, "gait_displacement", counted)
    row = sweep_measure.measure(Point("lateral-undulation", "yaw16", "flat", 0, 0, 4.0))
    assert row.speed_m_s is not None
    assert len(calls) == 1
