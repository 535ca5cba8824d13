"""A robot's joints: what they have of their own, and what cannot be."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import checked, load_robot
from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.config.template import plain_toml
from tests.helpers.uneven import UNEVEN, spelt_out

OWN = """
name = "mine"
link_length_m = 0.08

[servo]
model = "XM430-W350"
position_p_gain = 640

[[joints]]
axis = "y"
id = 31

[[joints]]
axis = "p"
id = 7
model = "XL330-M288"
sign = -1
zero_rad = 0.25
limit_rad = 0.9
position_p_gain = 300
current_limit_a = 0.4
armature_kg_m2 = 0.002
gear_drag_n_m_s = 0.006

[[joints]]
axis = "y"
"""


def test_a_joint_says_what_is_its_own(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(OWN)
    robot = load_robot(str(file))
    assert robot.joint_axes == "ypy"
    assert robot.servo_ids == (31, 7, 3)
    assert robot.servo_models == ("XM430-W350", "XL330-M288", "XM430-W350")
    assert robot.signs == (1, -1, 1)
    assert robot.zeros_rad == (0.0, 0.25, 0.0)
    assert robot.limit_rad == (1.5, 0.9, 1.5)
    assert robot.position_p_gains == (640, 300, 640)
    assert robot.current_limits_a == (float("inf"), 0.4, float("inf"))
    assert robot.armatures_kg_m2 == (0.045, 0.002, 0.045)
    assert robot.gear_drags_n_m_s == (0.03, 0.006, 0.03)
    assert robot.joint_label(1) == "joint pitch_02 (ID 7)"
    # a log keeps the robot as JSON, and gives back the same
    assert RobotConfig.model_validate_json(robot.model_dump_json()) == robot


def test_a_chain_without_joints_of_its_own_is_as_before() -> None:
    robot = load_robot("alternating12")
    assert robot.joints == ()
    assert robot.servo_ids == tuple(range(1, 13))
    assert robot.position_p_gains == (800, 400) * 6
    spelt_out = RobotConfig(name="same", joint_axes=robot.joint_axes, joints=(JointConfig(),) * 12)
    for name in ("servo_ids", "limit_rad", "position_p_gains", "current_limits_a", "signs"):
        assert getattr(spelt_out, name) == getattr(robot, name)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"joint_axes": "yy", "joints": [{}]}, "joints: 1 given, but joint_axes has 2"),
        (
            {"joint_axes": "y", "joints": [{"axis": "p"}]},
            "joint yaw_01 (ID 1): axis is p, joint_axes says y",
        ),
        ({"joints": [{"axis": "y"}, {}]}, "joint_axes: is required"),
        ({"joints": 3}, "joints: must be a list"),
        (
            {"joint_axes": "yyy", "joints": [{"id": 3}, {}, {}]},
            "ID 3 is the ID of several joints",
        ),
        (
            {"joint_axes": "y", "joints": [{"current_limit_a": 1.0}]},
            "joint yaw_01 (ID 1): current_limit_a: only pitch joints have one",
        ),
        ({"joint_axes": "y", "links": [{}]}, "a spine of 1 joints has 2"),
        ({"joint_axes": "y", "links": [{"length_m": 0.0}, {}]}, "of the head and of the tail must"),
        (
            {"joint_axes": "yyp", "links": [{}, {"length_m": 0}, {}, {}]},
            "length_m of link 1 is 0: the axes of the joints before and behind it must differ",
        ),
        (
            {"joint_axes": "ypy", "links": [{}, {"length_m": 0}, {"length_m": 0}, {}]},
            "a module has two axes at most",
        ),
        (
            {"joint_axes": "y", "links": [{"radius_m": 0.05}, {}]},
            "write body_radius_m = 0.05, and radius_m in each thinner link of [[links]]",
        ),
        (
            {"joint_axes": "y", "links": [{"shape": "rails"}, {}]},
            'shape rails needs belly.shape = "rails" and its width_m',
        ),
        (
            {
                "joint_axes": "y",
                "links": [{"radius_m": 0.02}, {}],
                "body_profile": [0.5, 1.0],
            },
            "radius_m and body_profile: both state",
        ),
        (
            {"joint_axes": "yp", "links": [{}, {"length_m": 0, "shape": "capsule"}, {}]},
            "a capsule needs a length; ball or none",
        ),
        ({"joint_axes": "y", "links": [{"length_m": 0.003}, {}]}, "length_m: 0, or over 0.005"),
        (
            {"joint_axes": "yy", "joints": [{}, {"zero_rad": -2.0}]},
            "joint yaw_02 (ID 2): zero_rad -2 with a limit of 1.5 rad leaves the servo's turn",
        ),
        ({"joint_axes": "y", "joints": [{"sign": 0}]}, "sign: must be 1 or -1"),
        (
            {"joint_axes": "y", "joints": [{"zeros_rad": 0.1}]},
            "zeros_rad: unknown key; did you mean zero_rad?",
        ),
    ],
)
def test_what_cannot_be_is_told(keys: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError) as caught:
        checked(RobotConfig, {"name": "x", **keys}, "x.toml")
    assert said in "\n".join(caught.value.faults)


def test_a_chain_says_what_each_link_is() -> None:
    assert UNEVEN.length_m == pytest.approx(0.12 + 4 * 0.08 + 0.15)
    assert UNEVEN.mass_kg == pytest.approx(0.3 + 4 * 0.2 + 5 * 0.01 + 0.06)
    assert UNEVEN.link_shapes[:3] == ("capsule", "none", "capsule")
    ends_m = np.array(UNEVEN.link_ends) * UNEVEN.mean_link_length_m
    np.testing.assert_allclose(np.diff(ends_m), UNEVEN.link_lengths_m, atol=1e-12)
    assert UNEVEN.radii_m(3) == (0.04, 0.04, 0.02)
    read = checked(RobotConfig, tomllib.loads(plain_toml(UNEVEN)), "uneven.toml")
    assert read == UNEVEN


def test_links_spelt_out_are_the_same_chain() -> None:
    plain = load_robot("alternating12")
    same = spelt_out(plain)
    assert same.link_ends == plain.link_ends
    assert same.radii_m(20) == plain.radii_m(20)
    assert same.length_m == pytest.approx(plain.length_m, rel=1e-15)
