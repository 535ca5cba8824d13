"""A rehearsal in simulated time: the same bytes twice, a true judgement, and a lost pose."""

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.pose import TrackerConfig
from snakewalk.controller.metrics.effort import energy_track, sampled_energy
from snakewalk.controller.rehearsal import rehearsal
from snakewalk.controller.rehearsal.commands import rehearse as rehearse_command
from snakewalk.controller.rehearsal.judgement import judge, true_arrivals
from snakewalk.controller.rehearsal.rehearsal import SimulatedPort, metric_errors, true_record
from snakewalk.controller.run.external.served_robot import Place, ServedRobot, Serving
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.request import RunRequest, RunResult
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.truth import Truth, read_truth
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.serve.watched_plant import WatchedPlant
from tests.helpers.command import snakewalk

NOISY = TrackerConfig(noise_m=0.01, noise_deg=3.0, delay_s=0.1)
Rehearse = Callable[..., tuple[RunResult, Truth, ServedRobot]]


@pytest.fixture(scope="module")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    (folder / "snake.toml").write_text(
        'name = "snake"\njoint_axes = "yyyyyyyy"\nlink_length_m = 0.07\nbody_radius_m = 0.03\n'
        "link_mass_kg = 0.15\n[pose]\nmax_age_s = 0.3\nhold_s = 0.6\n"
    )
    file = folder / "short.toml"
    file.write_text(
        'name = "short"\nrobot = "snake.toml"\nmotion = "serpenoid"\nwaypoints_m = [[0.3, 0.0]]\n'
        "waypoint_radius_m = 0.35\ntime_limit_s = 8.0\n"
    )
    return file


@pytest.fixture
def rehearsed(run_file: Path, tmp_path: Path) -> Rehearse:
    def run(
        tracker: TrackerConfig, name: str = "run", **changes: object
    ) -> tuple[RunResult, Truth, ServedRobot]:
        prepared = prepare_job(str(run_file), pose="udp:9870", **changes)
        truth = tmp_path / f"{name}.jsonl"
        served = ServedRobot(
            prepared.robot,
            prepared.world,
            Place((0.01, -0.02), 0.05),
            Serving(tracker),
            truth,
        )
        with served:
            finished = run_robot(
                RunRequest(prepared, tmp_path / name, SimulatedPort(served), stoppable=False)
            )
        return finished, read_truth(truth), served

    return run


@pytest.mark.nightly("two complete rehearsals: 34 s of CPU")
def test_a_rehearsal_repeats_bit_for_bit_and_is_judged(rehearsed: Rehearse) -> None:
    # far enough for the poses to agree with the joints: before, no distance is measured
    farther = {"waypoints_m": [(1.2, 0.0)], "time_limit_s": 20.0}
    first, truth, _ = rehearsed(NOISY, **farther)
    second, again, _ = rehearsed(NOISY, name="again", **farther)
    assert first.log.read_bytes() == second.log.read_bytes()
    assert np.array_equal(truth.head_m, again.head_m)
    assert first.summary.pose_source == "udp"
    assert first.record.header.port_is_pseudo_terminal
    found = judge(truth, first.record, first.summary)
    assert found.has_arrived
    assert found.is_true
    assert found.pose_error_rms_m is not None
    assert found.pose_error_rms_m < 0.03
    metrics = metric_errors(truth, first.record, first.summary)
    assert metrics is not None
    assert metrics.distance_m == first.summary.travelled_m
    assert metrics.true_distance_m == pytest.approx(found.travelled_m, abs=0.1)
    assert metrics.distance_m == pytest.approx(metrics.true_distance_m, abs=0.1)
    assert metrics.eta == pytest.approx(metrics.true_eta, rel=0.2)
    assert metrics.alarms == 0
    assert metrics.cost_of_transport == pytest.approx(metrics.true_cost_of_transport, rel=0.1)
    json.dumps(asdict(metrics))
    still = replace(truth, head_m=np.tile(truth.head_m[:1], (len(truth.time_s), 1)))
    lost = metric_errors(still, first.record, first.summary)
    assert lost is not None
    assert lost.true_eta is not None
    assert metrics.true_eta is not None
    assert lost.true_eta < 0.5 * metrics.true_eta
    moved_m = truth.centre_m + np.array([0.0, 3.0, 0.0])
    wrong = judge(replace(truth, centre_m=moved_m), first.record, first.summary)
    assert (wrong.truly_reached, wrong.claimed) == (0, 1)
    assert wrong.text.endswith("the run claims 1: that is false")


def test_a_run_that_loses_its_pose_holds_and_fails_with_torque_off(rehearsed: Rehearse) -> None:
    lost = NOISY.model_copy(update={"dropout_every_s": 1.5, "dropout_s": 600.0})
    finished, truth, served = rehearsed(lost)
    assert finished.outcome.tripped is not None
    assert finished.outcome.tripped.startswith("pose: no usable pose for ")
    assert not served.line.bank["Torque Enable"].any()
    events = [each.text for each in finished.record.events if each.kind == "pose"]
    assert any("the motion pauses for up to 0.6 s" in text for text in events)
    found = judge(truth, finished.record, finished.summary)
    assert not found.has_arrived
    rows = finished.record.pose_source
    assert rows.fault[-1].startswith("no usable pose")
    assert rows.position_sd_m[-1] > 1.5 * rows.position_sd_m[5]
    _check_true_energy(finished.record, truth)


def test_an_end_by_an_unconfirmed_pose_says_so_everywhere(rehearsed: Rehearse) -> None:
    """The first waypoint is so near that the run ends before the joints can confirm the pose."""
    finished, _, _ = rehearsed(NOISY, waypoint_radius_m=0.9)
    assert finished.verdict.exit_code == 3
    texts = {event.kind: event.text for event in finished.record.events}
    assert texts["stop"] == ("torque off; reached 1 of 1 by a pose that the joints did not confirm")
    assert texts["waypoint"].endswith("by a pose that the joints have not confirmed")


def _check_true_energy(record: RunRecord, truth: Truth) -> None:
    """The reference is the energy of the server, and nothing that the run measured."""
    cycle = replace(record.cycle, current_a=3.0 * record.cycle.current_a)
    records = true_record(truth, record), true_record(truth, replace(record, cycle=cycle))
    tracks = [energy_track(each[0]) for each in records if each is not None]
    assert [track.source for track in tracks] == ["integrated"] * 2
    np.testing.assert_array_equal(*(track.electrical_j for track in tracks))
    used_j = tracks[0].between(-np.inf, np.inf)[0]
    assert used_j == pytest.approx(truth.energy_j[-1, 0], rel=0.05)
    assert sampled_energy(record).between(-np.inf, np.inf)[0] == pytest.approx(used_j, rel=0.15)


def test_a_silent_tracker_ends_a_run_before_torque(
    rehearsed: Rehearse, monkeypatch: pytest.MonkeyPatch
) -> None:
    def enabled(self: ServoChain) -> None:
        pytest.fail("torque is on")

    monkeypatch.setattr(ServoChain, "enable", enabled)
    with pytest.raises(InputError, match="no usable pose within 5 s: nothing arrived"):
        rehearsed(TrackerConfig(delay_s=5.0, clock_offset_s=3.0, jitter_s=4.0))


def test_only_the_named_sender_is_used(rehearsed: Rehearse, run_file: Path) -> None:
    """The first sender need not be the user's: the file names the host."""
    robot = run_file.parent / "named.toml"
    text = (run_file.parent / "snake.toml").read_text()
    robot.write_text(f'{text}sender = "10.0.0.5"\n')
    with pytest.raises(InputError, match="no usable pose within 5 s: nothing arrived"):
        rehearsed(NOISY, robot=str(robot))
    robot.write_text(f'{text}sender = "127.0.0.1"\n')
    finished, _, _ = rehearsed(NOISY, robot=str(robot), waypoint_radius_m=0.9)
    assert finished.outcome.reached == 1


class Shaft:
    """A plant that notes the goals of its only motor."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.position_rad = self.velocity_rad_s = np.zeros(1)
        self.goals: list[tuple[float, float]] = []

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        self.time_s = until_s
        self.goals.append((round(until_s, 6), float(drive.goal_rad[0])))


def test_goals_arrive_late_and_samples_in_regular_intervals() -> None:
    shaft, times = Shaft(), list[float]()
    plant = WatchedPlant(shaft, 0.02, lambda: times.append(round(shaft.time_s, 6)), 0.04)
    one = np.ones(1)
    drive = ServoDrive(one.copy(), *(one.copy() for _ in range(8)))
    drive.torque_on[:], drive.goal_rad[:] = 0.0, 0.3
    plant.advance(0.01, drive)
    drive.torque_on[:] = 1.0
    for k in range(1, 11):
        if k == 3:
            drive.goal_rad[:] = 0.5
        plant.advance(0.01 + 0.01 * k, drive)
        assert drive.goal_rad[0] == (0.5 if k >= 3 else 0.3)
    changed = next(time_s for time_s, goal in shaft.goals if goal == 0.5)
    assert changed == pytest.approx(0.08), "0.03 s, when it was set, and 0.04 s; stops at 0.07"
    assert times == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08, 0.1])


def test_a_stated_accuracy_makes_no_arrival(rehearsed: Rehearse) -> None:
    """The judge of arrivals contains nothing that the run states."""
    lost = NOISY.model_copy(update={"dropout_every_s": 0.3, "dropout_s": 600.0})
    finished, truth, _ = rehearsed(lost)
    plan = finished.record.header.plan
    x_m, y_m = plan.waypoints_m[0]
    centre_m = [x_m + plan.waypoint_radius_m + 0.1, y_m, 0.0]
    near = replace(truth, centre_m=np.tile(centre_m, (len(truth.time_s), 1)))
    found = judge(near, finished.record, replace(finished.summary, pose_position_sd_m=0.06))
    assert (found.truly_reached, found.reached_as_stated, found.has_arrived) == (0, 1, False)
    claiming = replace(found, claimed=1)
    assert claiming.is_true
    assert claiming.text.endswith("the run claims 1: that is within its accuracy")
    assert replace(claiming, reached_as_stated=0).text.endswith("that is false")


def test_arrivals_are_counted_in_order() -> None:
    way = np.stack([np.linspace(0.0, 4.0, 401), np.zeros(401)], axis=1)
    waypoints = np.array([[1.0, 0.1], [3.0, 0.5], [2.0, 0.0]])
    assert true_arrivals(way, waypoints[:1], 0.3)[0] == 1
    reached, closest = true_arrivals(way, waypoints, 0.3)
    assert reached == 1, "the second is missed, and what comes after does not count"
    assert closest[1] == pytest.approx(0.5)


def test_results_are_continued(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run_file: Path
) -> None:
    done = list[rehearsal.RehearsalCase]()

    def each(
        work: object, cases: list[rehearsal.RehearsalCase], *, workers: int
    ) -> list[tuple[rehearsal.RehearsalCase, dict[str, object]]]:
        done.extend(cases)
        facts = {"has_arrived": True, "is_true": True, "verdict": "2 of 2 waypoints"}
        facts |= dict.fromkeys(
            ("path_error_mean_m", "pose_error_rms_m", "heading_error_rms_deg"), 0.01
        )
        return [(case, rehearsal.described(case) | facts) for case in cases]

    monkeypatch.setattr(rehearse_command, "each", each)
    out = tmp_path / "r.jsonl"
    for seeds, total in ((1, 1), (3, 3), (3, 3)):
        rehearse_command.rehearse_runs([str(run_file)], seeds=seeds, out=out)
        assert len(done) == total
    assert len(out.read_text().splitlines()) == 3
    out.write_text(out.read_text() + "{}\n")
    with pytest.raises(InputError, match="line 4 is not a rehearsal"):
        rehearse_command.rehearse_runs([str(run_file)], seeds=3, out=out)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("bus", "serve", "--pose-out", "udp:1"), "--pose-out: needs --robot or --run"),
        (("bus", "serve", "--robot", "yaw16", "--pose-out", "tcp:1"), "expected udp:HOST:PORT"),
        (("bus", "serve", "--robot", "yaw16", "--at", "1"), "expected X,Y or X,Y,DEGREES"),
        (
            ("bus", "serve", "--robot", "yaw16", "--pose-out", "udp:9", "--tracker", "noise=1"),
            "noise",
        ),
        (("log", "judge", "nothing.jsonl", "log.mcap"), "log.mcap"),
        (("run", "flat-slalom", "--pose", "udp:9870"), "measures a robot on a port; add --port"),
        (("run", "flat-slalom", "--port", "x", "--pose", "udp:"), "expected PORT or HOST:PORT"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(words: tuple[str, ...], said: str) -> None:
    ended = snakewalk(*words)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert json.dumps(ended.stderr).count("\\n") == 1
