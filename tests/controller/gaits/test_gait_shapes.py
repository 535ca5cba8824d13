"""Every gait: periodic, mirrored as its mirror image, refused where joints are missing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.loader import load_gait, load_robot, shipped
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Gait, ranges
from snakewalk.controller.gaits.registry import GAITS, make_gait

ROBOTS = {
    name: load_robot(name)
    for name in ("yaw16", "alternating16", "alternating32", "salamander", "quadruped")
}
PHASES = np.linspace(0.0, 2.0 * np.pi, 50)


def suits(gait: type[Gait], robot: RobotConfig) -> bool:
    return not (
        (gait.needs.pitch and not robot.pitch_joints)
        or (gait.needs.yaw and not robot.yaw_joints)
        or gait.needs.legs != bool(robot.limbs)
        or (gait.needs.leg_axes and gait.needs.leg_axes != robot.limbs[0].joint_axes)
    )


PAIRS = [(g, r) for g in GAITS.values() for r in ROBOTS.values() if suits(g, r)]
IDS = [f"{g.name}-{r.name}" for g, r in PAIRS]


@pytest.mark.parametrize(("gait", "robot"), PAIRS, ids=IDS)
def test_every_gait_is_periodic_moves_and_keeps_to_the_joints(
    gait: type[Gait], robot: RobotConfig
) -> None:
    made = gait()
    made.check(robot)
    joints = made.joints_rad(robot, PHASES)
    assert joints.shape == (50, robot.joint_count)
    np.testing.assert_allclose(joints, made.joints_rad(robot, PHASES + 2.0 * np.pi), atol=1e-9)
    assert np.ptp(joints, axis=0).max() > 0.05
    steps = np.abs(np.diff(made.joints_rad(robot, np.linspace(0, 2 * np.pi, 2000)), axis=0))
    assert steps.max() < 0.05, "continuous over the whole cycle"


@pytest.mark.parametrize(("gait", "robot"), PAIRS, ids=IDS)
def test_the_mirrored_gait_bends_to_the_other_side_and_lifts_alike(
    gait: type[Gait], robot: RobotConfig
) -> None:
    plain, mirrored = (gait.of({"mirror": m}).joints_rad(robot, PHASES) for m in (False, True))
    np.testing.assert_array_equal(mirrored[:, robot.yaw_joints], -plain[:, robot.yaw_joints])
    np.testing.assert_array_equal(mirrored[:, robot.pitch_joints], plain[:, robot.pitch_joints])


@pytest.mark.parametrize("gait", [g for g in GAITS.values() if g.needs.pitch], ids=lambda g: g.name)
def test_gaits_that_lift_refuse_a_robot_of_yaw_joints_in_one_line(gait: type[Gait]) -> None:
    with pytest.raises(InputError, match="needs pitch joints; robot yaw16 has none") as caught:
        gait().joints_rad(ROBOTS["yaw16"], PHASES)
    assert len(caught.value.faults) == 1


@pytest.mark.parametrize("gait", GAITS.values(), ids=lambda g: g.name)
def test_every_gait_says_what_it_is_and_every_parameter_has_a_range(gait: type[Gait]) -> None:
    assert gait.source
    assert gait.title
    for name, span in ranges(gait.model).items():
        assert span.low < span.high, name
        assert span.low <= span.default <= span.high, name
        assert span.description, name


def test_all_faults_of_parameters_are_reported_at_once() -> None:
    with pytest.raises(ConfigError) as caught:
        make_gait("sidewinding", {"waves": 99.0, "lift": 0.1})
    text = "\n".join(caught.value.faults)
    assert "waves" in text
    assert "lift: unknown key" in text
    with pytest.raises(InputError, match="no such gait; there are lateral-undulation"):
        make_gait("hop")


def test_a_gait_that_bends_a_joint_too_far_is_refused_with_the_joint_and_its_limit() -> None:
    gait = make_gait("concertina", {"winding_rad": 1.5, "folds": 4.0})
    with pytest.raises(
        InputError, match=r"\(ID \d+\) would bend to \d\.\d+ rad; its limit is 1.50"
    ):
        gait.check(ROBOTS["alternating16"])


@pytest.mark.parametrize("name", shipped("gaits"))
def test_shipped_sets_suit_the_robots_that_they_name(name: str) -> None:
    known = load_gait(name)
    assert known.name == name
    make_gait(known.gait, known.parameters).check(load_robot(known.robot))


@settings(max_examples=40)
@given(
    winding=st.floats(0.1, 1.0),
    waves=st.floats(0.75, 2.0),
    name=st.sampled_from(["yaw16", "alternating32"]),
)
def test_an_undulating_body_winds_by_the_angle_asked_whatever_its_joints(
    winding: float, waves: float, name: str
) -> None:
    robot = ROBOTS[name]
    gait = make_gait("lateral-undulation", {"winding_rad": winding, "waves": waves})
    joints = gait.joints_rad(robot, PHASES)[:, robot.yaw_joints]
    headings = -np.cumsum(joints, axis=1)
    # a link against the head link swings as the wave does between two places of the body
    apart = (robot.yaw_joints[1] - robot.yaw_joints[0]) / (robot.joint_count + 1)
    at = apart * np.arange(1, len(robot.yaw_joints) + 1)
    expected = 2.0 * winding * np.abs(np.sin(np.pi * waves * at))
    swing = 0.5 * np.ptp(headings, axis=0)
    np.testing.assert_allclose(swing, expected, atol=0.006 * winding)


def test_the_compound_serpenoid_holds_sidewinding_as_a_member() -> None:
    robot = ROBOTS["alternating16"]
    side = make_gait("sidewinding")
    joints = side.joints_rad(robot, PHASES)
    fine = side.joints_rad(robot, np.linspace(0, 2 * np.pi, 4001))
    lateral, dorsal = (
        float(np.abs(fine[:, list(own)]).max()) for own in (robot.yaw_joints, robot.pitch_joints)
    )
    family = make_gait(
        "compound-serpenoid",
        {
            "lateral_rad": lateral,
            "dorsal_rad": dorsal,
            "lateral_waves": side.params.waves,
            "dorsal_waves": side.params.waves,
        },
    )
    np.testing.assert_allclose(family.joints_rad(robot, PHASES), joints, atol=1e-4)


@pytest.mark.parametrize("name", ["rectilinear", "thunniform-dolphin"])
def test_a_turn_without_yaw_joints_is_rejected(name: str) -> None:
    robot = RobotConfig(name="planar", joint_axes="pppppp")
    make_gait(name).check(robot)
    with pytest.raises(InputError, match=r"turn_rad 0\.3 needs yaw joints; robot planar has none"):
        make_gait(name, {"turn_rad": 0.3}).check(robot)
