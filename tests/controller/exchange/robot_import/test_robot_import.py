"""Other people's models become robots: kinematics to the digit, and plain words for the rest."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, shipped
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.exchange.robot_export import mjcf_text, urdf_text
from snakewalk.controller.exchange.robot_import import model_compiler
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import (
    ImportedRobot,
    import_robot,
)
from tests.helpers.uneven import UNEVEN

SWIMMER = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "swimmer.xml"
ROOT = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint axis="0 0 1"/>'


def swimmer(segments: int) -> str:
    """A swimmer as dm_control builds it: the head looks along -y, and what is seen has no mass."""
    inner = ""
    for k in reversed(range(1, segments)):
        inner = (
            f'<body name="segment{k}" pos="0 .1 0">'
            '<geom type="capsule" size=".01" fromto="0 -.05 0 0 .05 0" mass="0"/>'
            '<geom type="box" size=".001 .05 .01" mass=".01"/>'
            f'<joint name="joint{k}" pos="0 -.05 0" axis="0 0 1" limited="true" '
            f'range="-60 60"/>{inner}</body>'
        )
    return (
        '<mujoco><worldbody><geom type="plane" size="2 2 .1"/><body name="head" pos="0 0 .05">'
        '<geom type="ellipsoid" size=".02 .04 .017" pos="0 -.022 0" mass="0"/>'
        f'<geom type="box" size=".001 .05 .01" mass=".01"/>{ROOT}{inner}</body>'
        "</worldbody></mujoco>"
    )


COMPILE = model_compiler.compile_model


def chain(*joints: str, root: str = "<freejoint/>", extra: str = "") -> str:
    """Boxes of 0.1 m along -x, one behind each joint."""
    inner = ""
    for k, joint in reversed(list(enumerate(joints, start=1))):
        at = "-0.1 0 0" if k > 1 else "-0.05 0 0"
        inner = (
            f'<body name="b{k}" pos="{at}"><geom type="box" size=".05 .02 .02" pos="-.05 0 0" '
            f'mass=".1"/>{joint}{inner}</body>'
        )
    return (
        f'<mujoco><worldbody><body name="b0">{root}<geom type="box" size=".05 .02 .02" mass=".1"/>'
        f"{inner}</body></worldbody>{extra}</mujoco>"
    )


def yaw(name: str, rest: str = "") -> str:
    return f'<joint name="{name}" axis="0 0 1" range="-80 80" limited="true" {rest}/>'


def imported(tmp_path: Path, text: str, **options: float) -> ImportedRobot:
    file = tmp_path / "model.xml"
    file.write_text(text)
    return import_robot(file, "model", "XM430-W350", RobotChoice(**options))


def test_the_swimmer_of_gymnasium_is_a_chain_of_three_links() -> None:
    for reverse in (False, True):
        choice = RobotChoice(scale=0.1, reverse=reverse)
        made = import_robot(SWIMMER, "swimmer", "XL330-M288", choice)
        assert made.robot.joint_axes == "yy"
        assert made.robot.link_lengths_m == pytest.approx((0.1, 0.1, 0.1))
        sphere, rod = 4 / 3 * np.pi * 0.1**3, np.pi * 0.1**2
        assert made.robot.link_masses_kg == pytest.approx([1000e-3 * (sphere + rod)] * 3)
        assert made.robot.link_radii_m == pytest.approx((0.01, 0.01, 0.01))
        assert made.robot.limit_rad == pytest.approx(np.radians([100.0, 100.0]))
        assert made.robot.signs == ((1, 1) if reverse else (-1, -1))
        assert made.kinematics_error_m < 1e-9
    assert made.joint_names == ("motor2_rot", "motor1_rot")


def test_a_model_that_is_too_large_for_servos_is_told_how_to_shrink() -> None:
    with pytest.raises(
        InputError, match=r"its mass is .* kg, and must be over .* at most 20 kg; use --scale"
    ):
        import_robot(SWIMMER, "swimmer", "XL330-M288")


def test_a_swimmer_of_dm_control_lies_across_and_has_looks_without_mass(tmp_path: Path) -> None:
    made = imported(tmp_path, swimmer(6))
    assert made.robot.joint_axes == "yyyyy"
    assert made.robot.link_lengths_m == pytest.approx([0.1] * 6)
    assert made.robot.link_masses_kg == pytest.approx([0.01] * 6)
    assert made.kinematics_error_m < 1e-9


@pytest.mark.parametrize("robot", [load_robot("alternating12"), UNEVEN], ids=lambda each: each.name)
def test_what_is_exported_comes_back(tmp_path: Path, robot: RobotConfig) -> None:
    file = tmp_path / "model.urdf"
    for text in (urdf_text(robot), mjcf_text(robot)):
        file.write_text(text)
        made = import_robot(file, robot.name, "XM430-W350")
        assert made.robot.joint_axes == robot.joint_axes
        assert made.robot.signs == robot.signs
        np.testing.assert_allclose(made.robot.link_lengths_m, robot.link_lengths_m, atol=1e-9)
        np.testing.assert_allclose(made.robot.link_masses_kg, robot.link_masses_kg, atol=1e-9)
        assert made.kinematics_error_m < 1e-9


ROBOTS = [load_robot(name) for name in shipped("robots")]


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda each: each.name)
def test_a_shipped_robot_comes_back_from_its_files(tmp_path: Path, robot: RobotConfig) -> None:
    """The stops of the simulator, 0.1 rad beyond the limits, were in the file.

    Masses beside the line of a link and figures of the servos are no part of the files.
    """
    for write in (mjcf_text,) if robot.limbs else (mjcf_text, urdf_text):
        file = tmp_path / "model.xml"
        texts = []
        made = robot
        for _ in range(2):
            file.write_text(write(made))
            made = import_robot(file, robot.name, robot.servo.model).robot
            texts.append(write(made))
            assert (made.joint_axes, made.signs) == (robot.joint_axes, robot.signs)
            np.testing.assert_allclose(made.limit_rad, robot.limit_rad, atol=1e-6)
            np.testing.assert_allclose(made.link_lengths_m, robot.link_lengths_m, atol=1e-9)
            np.testing.assert_allclose(made.link_masses_kg, robot.link_masses_kg, atol=1e-9)
        assert texts[0] == texts[1]


def test_anchors_beside_the_line_but_on_their_axes_make_no_difference(tmp_path: Path) -> None:
    """As CAD programs write them: origins anywhere along the pins."""
    joints = (
        yaw("a", 'pos="0 0 0.013"'),
        '<joint name="b" axis="0 -1 0" pos="0 -0.02 0" range="-60 60" limited="true"/>',
        yaw("c", 'pos="0 0 -0.01"'),
    )
    made = imported(tmp_path, chain(*joints))
    assert made.robot.joint_axes == "ypy"
    assert made.robot.signs == (-1, -1, -1)
    assert made.kinematics_error_m < 1e-9
    assert imported(tmp_path, chain(*joints), reverse=True).kinematics_error_m < 1e-9


def test_two_hinges_of_one_body_are_a_module_of_two_axes(tmp_path: Path) -> None:
    two = [
        yaw(f"a{k}") + f'<joint name="b{k}" axis="0 1 0" range="-60 60" limited="true"/>'
        for k in range(2)
    ]
    made = imported(tmp_path, chain(*two))
    assert made.robot.joint_axes == "ypyp"
    assert made.robot.link_lengths_m == pytest.approx([0.1, 0.0, 0.1, 0.0, 0.1])
    assert made.robot.link_shapes[1] == "none"
    assert made.kinematics_error_m < 1e-9


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco", "is no XML"),
        ("<world/>", "begins with <world>"),
        ("<mujoco><worldbody><bod/></worldbody></mujoco>", "MuJoCo cannot read it"),
        ("<mujoco/>", "free bodies that carry hinges: none"),
        (chain(yaw("a"), yaw("b"), root=""), "b1: is bolted to the world"),
        (chain(yaw("a")), "one hinge"),
        (chain(yaw("a"), '<joint name="s" type="slide"/>'), "joint s: is a slide joint"),
        (chain(yaw("a"), '<joint name="r" axis="1 0 0"/>'), "joint a: its axis lies along|joint r"),
        (
            chain(yaw("a"), '<joint name="o" axis="0 1 1"/>'),
            "joint o: its axis is 45 degrees from that of a: neither",
        ),
        (
            chain(yaw("a"), yaw("b", 'pos="0 0.03 0"'), yaw("c")),
            "b: lies 0.03 m from the line of the others",
        ),
        (
            chain(yaw("a"), yaw("b"), extra='<equality><joint joint1="a" joint2="b"/></equality>'),
            "couples joints",
        ),
        (
            chain(yaw("a"), '<joint name="n" axis="0 0 1" range="0 90"/>'),
            "joint n: its range, 0 to",
        ),
    ],
)
def test_what_a_robots_file_cannot_say_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        imported(tmp_path, text)
    assert str(caught.value).startswith(str(tmp_path))


def test_legs_and_mimics_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="body torso: carries 4 bodies"):
        import_robot(SWIMMER.with_name("ant.xml"), "ant", "XM430-W350")
    file = tmp_path / "m.urdf"
    file.write_text(
        '<robot name="m"><link name="a"/><joint name="j"><mimic joint="k"/></joint></robot>'
    )
    with pytest.raises(InputError, match="joint j, line 1: mimics another"):
        import_robot(file, "m", "XM430-W350")


def test_urdf_meshes_that_are_elsewhere_do_not_matter(tmp_path: Path) -> None:
    """Radius and length come from the inertia of an even cylinder."""
    text = urdf_text(load_robot("yaw16"))
    meshed = text.replace(
        '<cylinder radius="0.03" length="0.07" />', '<mesh filename="package://x" />'
    )
    assert meshed != text
    file = tmp_path / "m.urdf"
    file.write_text(meshed)
    made = import_robot(file, "m", "XM430-W350")
    assert made.robot.link_radii_m == pytest.approx([0.03] * 17, abs=1e-6)


def test_the_command_writes_a_file_that_loads_and_tells_what_was_left_out(tmp_path: Path) -> None:
    out, model = tmp_path / "mine.toml", tmp_path / "m.xml"
    model.write_text(
        chain(yaw("a"), '<joint name="b" axis="0 0 1" range="-30 80" limited="true"/>')
    )
    words = ["robot", "import", str(model), "-o", str(out), "--json"]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    said = json.loads(ran.stdout)
    assert said["kinematics_error_m"] < 1e-9
    assert any("joint b: turns from -0.524 to 1.4 rad" in note for note in said["notes"])
    assert load_robot(str(out)).limit_rad == pytest.approx(np.radians([80.0, 30.0]))
    assert "joint b: turns" in out.read_text()
    assert isinstance(CliRunner().invoke(app, words).exception, InputError)  # it exists


@pytest.mark.nightly("fills the memory that a process is allowed: 9 s of CPU")
def test_a_model_that_asks_for_all_memory_is_rejected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_compiler, "compile_model", COMPILE)
    text = chain(yaw("a"), yaw("b")).replace(
        "</worldbody>",
        '<replicate count="200000000" offset="0 0 1"><geom size="1"/></replicate></worldbody>',
    )
    with pytest.raises(InputError, match=r"MuJoCo cannot read it: .*(memory|gave up)"):
        imported(tmp_path, text)


@pytest.mark.parametrize(
    "inside",
    [
        '<size nuserdata="500000000"/>',
        '<asset><texture name="t" type="2d" builtin="flat" width="60000" height="60000"/></asset>',
        '<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>',
        '<option collision="all" mpr_iterations="50"/>',
        '<visual><headlight no_such="1"/></visual>',
    ],
)
def test_parts_that_a_robot_file_does_not_use_are_not_compiled(tmp_path: Path, inside: str) -> None:
    made = imported(tmp_path, chain(yaw("a"), yaw("b"), extra=inside))
    assert made.robot.joint_axes == "yy"


def test_a_compiler_that_crashes_or_never_ends_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_compiler, "compile_model", COMPILE)
    monkeypatch.setattr(model_compiler, "_COMPILER", "import os; os.abort()")
    with pytest.raises(InputError, match=r"its compiler gave up: 2 GB of memory and 10 s"):
        imported(tmp_path, chain(yaw("a"), yaw("b")))


def test_more_parts_than_a_chain_has_are_not_compiled(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds 1003 bodies and joints; a chain has at most 1000"):
        imported(tmp_path, chain(*(yaw(f"j{k}") for k in range(501))))


def test_a_model_in_millimetres_keeps_its_masses(tmp_path: Path) -> None:
    from tests.foreign.robots import LENGTH_M, MASS_KG, urdf

    file = urdf(size=1000.0)(tmp_path)
    with pytest.raises(InputError, match=r"--mass-scale 1"):
        import_robot(file, "m", "XM430-W350")
    made = import_robot(file, "m", "XM430-W350", RobotChoice(scale=0.001, mass_scale=1.0))
    assert made.robot.length_m == pytest.approx(6 * LENGTH_M)
    assert made.robot.mass_kg == pytest.approx(6 * MASS_KG)
    assert made.facts["unit"].source == "user"
