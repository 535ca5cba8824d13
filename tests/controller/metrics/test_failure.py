"""The cause of a failure, on logs made so that one thing is wrong."""

import dataclasses

import numpy as np
import pytest

from snakewalk.config.heightfield import HeightField
from snakewalk.controller.metrics.failure import failure
from snakewalk.controller.metrics.ground_contact import roll_rad
from snakewalk.controller.runlog.record import Event, PlanSummary, RunRecord
from snakewalk.controller.runlog.topics import FrictionTable, PoseTable

SECONDS, HZ, PULSE_M_S, PREDICTED_M_S = 60.0, 10.0, 0.3, 0.25
PATH_M = np.array([[0.0, 0.0], [30.0, 0.0]])
LINKS = 17


def made(
    record: RunRecord,
    *,
    share: float = 0.9,
    up_deg: float = 0.0,
    roll_deg: float = 0.0,
    progress: float = 1.0,
    clamped: float = 0.0,
    seconds: float = SECONDS,
    pulse_m_s: float = PULSE_M_S,
) -> RunRecord:
    """Log of a straight body on a 30 m path: ``share`` of the prediction, ``progress`` of that.

    It moves along itself, and points so that ``progress`` of its way is along the path.
    """
    t = np.arange(0.0, seconds, 1.0 / HZ)
    n, speed = len(t), share * PREDICTED_M_S
    along = progress * speed * t
    back = np.linspace(0.0, 1.2, LINKS)
    up = np.radians(up_deg)
    links = np.zeros((n, LINKS, 3))
    ahead = speed * t[:, None] - np.cos(up) * back
    links[..., 0], links[..., 1] = progress * ahead, np.sqrt(1.0 - progress**2) * ahead
    links[..., 2] = -np.sin(up) * back
    a = np.radians(roll_deg) * (t > seconds / 2)
    one, zero = np.ones(n), np.zeros(n)
    rotation = np.moveaxis(
        np.array([[one, zero, zero], [zero, np.cos(a), -np.sin(a)], [zero, np.sin(a), np.cos(a)]]),
        -1,
        0,
    )
    pose = PoseTable(
        time_s=t,
        head_m=links[:, 0],
        rotation=rotation,
        links_m=links,
        centre_m=links.mean(axis=1),
        speed_m_s=speed * one,
        predicted_speed_m_s=PREDICTED_M_S * one,
        pulse_m_s=pulse_m_s * one,
        path_s_m=along,
        target=np.zeros(n, dtype=np.int64),
    )
    rows = np.arange(n) % len(record.cycle.time_s)
    columns = {
        f.name: getattr(record.cycle, f.name)[rows]
        for f in dataclasses.fields(record.cycle)
        if f.name not in {"time_s", "verdict", "reason", "joints"}
    }
    cycle = dataclasses.replace(
        record.cycle,
        **columns,
        time_s=t,
        verdict=tuple("clamp" if k % 10 < 10 * clamped else "pass" for k in range(n)),
        reason=("",) * n,
        joints=((),) * n,
    )
    plan = PlanSummary(PATH_M, np.array([[25.0, 0.0]]), 0.3)
    return dataclasses.replace(
        record,
        header=dataclasses.replace(record.header, plan=plan),
        pose=pose,
        cycle=cycle,
        paths=((0.0, PATH_M),),
        events=(),
    )


@pytest.mark.parametrize(
    ("wrong", "cause"),
    [
        ({}, "time"),
        ({"up_deg": 10.0}, "time"),  # slow on a climb, but within what was predicted
        ({"share": 0.3}, "slip"),
        ({"share": 0.3, "up_deg": 4.0}, "slip"),  # arctan 0.1 is 5.7 deg
        ({"share": 0.3, "up_deg": 7.0}, "climb"),
        ({"share": 0.3, "up_deg": -7.0}, "slip"),
        ({"share": -0.2, "up_deg": 12.0}, "climb"),  # slides back
        ({"progress": 0.2}, "steering"),
        ({"progress": -0.5}, "steering"),
        ({"roll_deg": 70.0, "share": 0.1}, "roll"),
        ({"roll_deg": 55.0}, "time"),
        ({"roll_deg": 179.0}, "roll"),
        ({"clamped": 0.5, "share": 0.3}, "joint"),
        ({"clamped": 0.1}, "time"),
        ({"pulse_m_s": 0.0}, "joint"),
    ],
)
def test_one_thing_wrong(record: RunRecord, wrong: dict[str, float], cause: str) -> None:
    found = failure(made(record, **wrong))
    assert found is not None
    assert found.cause == cause


@pytest.mark.parametrize(
    ("limit_s", "wrong", "cause"),
    [
        (118.0, {"progress": 0.2}, "time"),  # 29.7 m at 0.25 m/s take 118.8 s
        (118.0, {"share": 0.3, "clamped": 0.5}, "time"),
        (118.0, {"roll_deg": 70.0}, "roll"),
        (119.0, {"progress": 0.2}, "steering"),
        (119.0, {"share": 0.3}, "slip"),
    ],
)
def test_a_limit_too_short_for_the_plan_is_told_whatever_else_went_on(
    record: RunRecord, limit_s: float, wrong: dict[str, float], cause: str
) -> None:
    run = made(record, **wrong)
    plan = dataclasses.replace(run.header.plan, predicted_speed_m_s=PREDICTED_M_S)
    limited = run.header.run.model_copy(update={"time_limit_s": limit_s})
    header = dataclasses.replace(run.header, plan=plan, run=limited)
    found = failure(dataclasses.replace(run, header=header))
    assert found is not None
    assert found.cause == cause
    assert ("time_limit_s is 118" in found.text) == (cause == "time")


def test_a_body_that_its_load_slows_down_is_late_because_of_its_joints(record: RunRecord) -> None:
    slowed = Event(9.0, "warning", "derating", "slowing down: joint yaw_09 (ID 9) at 1.62 A")
    found = failure(dataclasses.replace(made(record), events=(slowed,)))
    assert found is not None
    assert (found.cause, found.text[-9:]) == ("joint", "at 1.62 A")


def test_a_run_that_reached_everything_has_no_failure(record: RunRecord) -> None:
    assert failure(made(record, seconds=130.0)) is None


def test_a_trip_comes_first_and_is_told(record: RunRecord) -> None:
    trip = Event(3.0, "error", "trip", "joint 4: 2.3 A")
    rolled = made(record, roll_deg=90.0, seconds=130.0)
    found = failure(dataclasses.replace(rolled, events=(trip,)))
    assert found is not None
    assert (found.cause, found.text) == ("safety", "stopped by safety: joint 4: 2.3 A")


def test_progress_goes_on_over_a_path_that_was_laid_again(record: RunRecord) -> None:
    """Arc lengths begin at 0 again; what counts is the path that remains."""
    run = made(record)
    laid_s, rest_m = 45.0, 30.0 - 45.0 * 0.9 * PREDICTED_M_S
    after = run.pose.time_s >= laid_s
    along = np.where(after, run.pose.path_s_m - (30.0 - rest_m), run.pose.path_s_m)
    again = dataclasses.replace(
        run,
        pose=dataclasses.replace(run.pose, path_s_m=along),
        paths=((0.0, PATH_M), (laid_s, np.array([[30.0 - rest_m, 0.0], [30.0, 0.0]]))),
    )
    found = failure(again)
    assert found is not None
    assert found.cause == "time"


@pytest.mark.parametrize("roll_deg", [-170.0, -90.0, 0.0, 60.0, 100.0])
def test_roll_beyond_a_right_angle(record: RunRecord, roll_deg: float) -> None:
    rotation = made(record, roll_deg=roll_deg).pose.rotation[-1:]
    assert np.degrees(roll_rad(rotation)) == pytest.approx([roll_deg])


def sliding(log: RunRecord, speed_m_s: tuple[float, float, float]) -> RunRecord:
    """Move the body to the side of its motion, without its joints."""
    aside_m = log.pose.time_s[:, None] * np.array(speed_m_s)
    pose = dataclasses.replace(
        log.pose,
        links_m=log.pose.links_m + aside_m[:, None],
        centre_m=log.pose.centre_m + aside_m,
    )
    return dataclasses.replace(log, pose=pose)


@pytest.mark.parametrize(
    ("slope_deg", "slide_m_s", "cause"),
    [(18.0, 0.2, "climb"), (10.0, 0.2, "slip"), (4.0, 0.2, "slip"), (18.0, 0.02, "steering")],
)
def test_a_body_that_slides_before_a_steep_path_does_not_climb_it(
    record: RunRecord, slope_deg: float, slide_m_s: float, cause: str
) -> None:
    """A body that turns aside before a steep plane advances, but not along its path."""
    x_m = np.arange(-20.0, 32.0, 0.5)
    height_m = np.tile(np.tan(np.radians(slope_deg)) * np.maximum(x_m, 0.0), (9, 1))
    log = sliding(made(record, progress=0.1), (-slide_m_s, 0.0, 0.0))
    ground = HeightField(height_m, 0.5, -20.0, -2.0)
    header = dataclasses.replace(log.header, ground=ground)
    found = failure(dataclasses.replace(log, header=header))
    assert found is not None
    assert found.cause == cause


@pytest.mark.parametrize(("slope_deg", "cause"), [(32.0, "climb"), (10.0, "steering")])
def test_a_body_that_turns_about_before_a_steep_plane_does_not_climb_it(
    record: RunRecord, slope_deg: float, cause: str
) -> None:
    """It advanced by 5.1 m within half a metre of the foot, and was called badly steered."""
    x_m = np.arange(-20.0, 32.0, 0.5)
    height_m = np.tile(np.tan(np.radians(slope_deg)) * np.maximum(x_m, 0.0), (9, 1))
    log = made(record, progress=0.0)
    pose = log.pose
    about_rad = pose.time_s / 3.0
    turns = np.stack([np.cos(about_rad), np.sin(about_rad), 0.0 * about_rad], axis=1)
    along_m = np.linspace(0.5, -0.5, pose.links_m.shape[1])
    centre_m = 0.2 * np.roll(turns, 1, axis=1)
    links_m = centre_m[:, None] + along_m[:, None] * turns[:, None]
    pose = dataclasses.replace(pose, centre_m=centre_m, links_m=links_m)
    header = dataclasses.replace(log.header, ground=HeightField(height_m, 0.5, -20.0, -2.0))
    found = failure(dataclasses.replace(log, pose=pose, header=header))
    assert found is not None
    assert found.cause == cause


@pytest.mark.parametrize(("astray_s", "cause"), [(20.0, "steering"), (0.1, "slip")])
def test_a_body_that_went_astray_before_it_slid_was_steered_there(
    record: RunRecord, astray_s: float, cause: str
) -> None:
    """It advanced without slip until its first new path; it slid later."""
    log = made(record, progress=0.0)
    aside_m = np.zeros((len(log.pose.time_s), 3))
    aside_m[:, 0] = 0.2 * np.maximum(log.pose.time_s - astray_s, 0.0)
    pose = dataclasses.replace(
        log.pose, links_m=log.pose.links_m + aside_m[:, None], centre_m=log.pose.centre_m + aside_m
    )
    paths = ((0.0, PATH_M), (astray_s, PATH_M))
    found = failure(dataclasses.replace(log, pose=pose, paths=paths))
    assert found is not None
    assert found.cause == cause


@pytest.mark.parametrize("fall_deg", [14.0, 5.0])
def test_a_slide_to_the_side_states_the_slope_under_the_body(
    record: RunRecord, fall_deg: float
) -> None:
    """A path along a hillside is level, and the body slides off it downhill."""
    y_m = np.arange(-20.0, 20.0, 0.5)
    height_m = np.tile(-np.tan(np.radians(fall_deg)) * y_m[:, None], (1, 66))
    log = sliding(made(record), (0.0, 0.2, 0.0))
    pose = dataclasses.replace(log.pose, path_s_m=np.full(len(log.pose.time_s), 1.0))
    header = dataclasses.replace(log.header, ground=HeightField(height_m, 0.5, -1.0, -20.0))
    found = failure(dataclasses.replace(log, header=header, pose=pose))
    assert found is not None
    assert found.cause == "slip"
    assert f"where the ground falls by {fall_deg:.0f} deg" in found.text


@pytest.mark.parametrize(("high", "cause"), [(0.69, "slip"), (0.71, "time")])
def test_less_friction_than_in_the_file_is_a_slip(
    record: RunRecord, high: float, cause: str
) -> None:
    """A body that is late on slippery ground slips, even if it stays on its path."""
    friction = FrictionTable(
        time_s=np.array([10.0]),
        along=np.array([0.1]),
        across=np.array([0.5]),
        along_95=np.array([[0.08, 0.12]]),
        across_95=np.array([[0.4, high]]),
    )
    assert record.header.world.friction.across == 0.7
    found = failure(dataclasses.replace(made(record), friction=friction))
    assert found is not None
    assert found.cause == cause


def test_a_body_whose_links_advance_while_it_stays_slips(record: RunRecord) -> None:
    """On ice the links move along their bends, and the centre hardly moves."""
    log = made(record, progress=0.0)
    still_m = 0.1 * (log.pose.centre_m - log.pose.centre_m[:1])
    pose = dataclasses.replace(log.pose, centre_m=log.pose.centre_m[:1] + still_m)
    found = failure(dataclasses.replace(log, pose=pose))
    assert found is not None
    assert found.cause == "slip"


@pytest.mark.parametrize("walks_from_s", [0.0, 21.0])
def test_a_slide_off_a_level_path_is_told_before_the_climb_back(
    record: RunRecord, walks_from_s: float
) -> None:
    """The body slides down across the hillside; then its new path climbs back, and it stays.

    A body may also slide off before its first wave.
    """
    y_m = np.arange(-20.0, 20.0, 0.5)
    height_m = np.tile(np.tan(np.radians(20.0)) * y_m[:, None], (1, 66))
    log = made(record)
    time_s = log.pose.time_s
    aside_m = np.zeros((len(time_s), 1, 3))
    aside_m[:, 0, 0] = -0.9 * PREDICTED_M_S * np.maximum(time_s - 20.0, 0.0)
    aside_m[:, 0, 1] = -0.2 * np.minimum(time_s, 20.0)
    pose = dataclasses.replace(
        log.pose,
        links_m=log.pose.links_m + aside_m,
        centre_m=log.pose.centre_m + aside_m[:, 0],
        path_s_m=np.full(len(time_s), 1.0),
        pulse_m_s=np.where(time_s < walks_from_s, 0.0, log.pose.pulse_m_s),
    )
    back_m = np.array([[0.0, -4.0], [0.0, 8.0]])
    header = dataclasses.replace(log.header, ground=HeightField(height_m, 0.5, -1.0, -20.0))
    paths = ((0.0, PATH_M), (20.0, back_m))
    found = failure(dataclasses.replace(log, header=header, pose=pose, paths=paths))
    assert found is not None
    assert found.cause == "slip"
    assert "slid 4.0 m down a slope of 20 deg off its path, and did not come back" in found.text
    alone = failure(dataclasses.replace(log, header=header, pose=pose, paths=((0.0, back_m),)))
    assert alone is not None
    assert alone.cause == "climb"


@pytest.mark.parametrize(("slope_deg", "ends"), [(25.0, ", on a slope of 25 deg"), (5.0, "deg")])
def test_a_body_that_rolls_over_on_a_steep_slope_says_so(
    record: RunRecord, slope_deg: float, ends: str
) -> None:
    y_m = np.arange(-20.0, 20.0, 0.5)
    height_m = np.tile(np.tan(np.radians(slope_deg)) * y_m[:, None], (1, 66))
    log = made(record, roll_deg=100.0)
    header = dataclasses.replace(log.header, ground=HeightField(height_m, 0.5, -1.0, -20.0))
    found = failure(dataclasses.replace(log, header=header))
    assert found is not None
    assert found.cause == "roll"
    assert found.text.endswith(ends)
    assert ("on a slope" in found.text) == (slope_deg > 20.0)
