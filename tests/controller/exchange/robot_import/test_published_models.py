"""Models of the classes that are published: each is imported, exported, and imported again."""

import math
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.console.child_process import run_limited
from snakewalk.controller.exchange.robot_export import mjcf_text, urdf_text
from snakewalk.controller.exchange.robot_import import model_compiler
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import (
    ImportedRobot,
    import_robot,
)
from tests.helpers.foreign_robots import (
    CLASSES,
    arm_of_threes,
    modules_without_meshes,
    rounded_quarter_turns,
    standing_on_world,
    wheeled_mjcf,
    wheeled_urdf,
)

COMPILE = model_compiler.compile_model


def imported(tmp_path: Path, text: str, suffix: str = ".urdf", *assumed: str) -> ImportedRobot:
    file = tmp_path / f"model{suffix}"
    file.write_text(text)
    answers = dict(words.split("=") for words in assumed)
    return import_robot(file, "model", "XM430-W350", RobotChoice(assume=answers))


def noted(made: ImportedRobot, words: str) -> bool:
    return any(words in note for note in made.notes)


CHAIN = """<robot name="m">
{before}<link name="l0">{inertial}{shape}</link>
<link name="l1">{inertial}{shape}</link>
<!-- a comment
over two lines -->
<link name="l2">{inertial}{shape}</link>
<link name="l3">{inertial}{tail}</link>
{joints}{after}</robot>
"""
INERTIAL = (
    '<inertial><origin xyz="0.035 0 0"/><mass value="0.1"/><inertia ixx="3e-5" ixy="0" ixz="0" '
    'iyy="6e-5" iyz="0" izz="6e-5"/></inertial>'
)
SHAPE = (
    f'<collision><origin xyz="0.035 0 0" rpy="0 {math.pi / 2} 0"/><geometry><cylinder '
    'length="0.06" radius="0.025"/></geometry></collision>'
)
LIMIT = '<limit lower="-1.2" upper="1.2" effort="4" velocity="3"/>'


def urdf(
    *, inertial: str = INERTIAL, shape: str = SHAPE, tail: str = SHAPE, before: str = "",
    after: str = "", turn: str = "0", inside: str = "",
) -> str:  # fmt: skip
    """Four links of 0.07 m whose cylinders end 5 mm before the joints."""
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0.07 0 0" rpy="{turn} 0 0"/><axis xyz="0 0 1"/>{LIMIT}{inside}</joint>\n'
        for k in range(3)
    )
    return CHAIN.format(
        inertial=inertial, shape=shape, tail=tail, before=before, after=after, joints=joints
    )


@pytest.mark.fast_cases(5)
@pytest.mark.parametrize("name", CLASSES)
def test_each_class_is_imported_exported_and_imported_again(tmp_path: Path, name: str) -> None:
    model = CLASSES[name]
    made = imported(tmp_path, model.make(), model.suffix, *model.assumed)
    robot = made.robot
    if not model.axes:
        assert re.fullmatch(r"(yp)*y?|(py)*p?", robot.joint_axes)
    else:
        assert robot.joint_axes == model.axes
    for again, text in ((".urdf", urdf_text(robot)), (".xml", mjcf_text(robot))):
        back = imported(tmp_path, text, again)
        assert back.kinematics_error_m < 1e-9
        assert back.robot.joint_axes == robot.joint_axes
        assert back.robot.signs == (1,) * robot.joint_count  # joints are exported with our signs
        np.testing.assert_allclose(back.robot.link_lengths_m, robot.link_lengths_m, atol=1e-9)
        np.testing.assert_allclose(back.robot.link_masses_kg, robot.link_masses_kg, atol=1e-9)


@pytest.mark.nightly("plans and runs every published class of robot")
@pytest.mark.parametrize("name", CLASSES)
def test_each_class_is_planned_and_run(tmp_path: Path, name: str) -> None:
    model = CLASSES[name]
    file, out = tmp_path / f"model{model.suffix}", tmp_path / "robot.toml"
    file.write_text(model.make())
    words = [word for key in model.assumed for word in ("--assume", key)]
    words += ["--servo", model.servo, "--scale", str(model.scale)]
    wave = ["lateral-undulation"] if model.axes == "y" * 8 else ["sidewinding"]
    gait = [*wave, *(["-p", "winding_rad=0.4"] if len(wave[0]) < 12 else [])]
    for command in (
        ["robot", "import", str(file), "-o", str(out), *words],
        ["plan", "flat-square", "--robot", str(out)],
        ["gait", "run", *gait, "--robot", str(out), "--seconds", "3", "--no-film",
         "-o", str(tmp_path / "run")],
    ):  # fmt: skip
        ran = CliRunner().invoke(app, command)
        missed = command[0] == "plan" and " waypoints are reached in " in ran.output
        assert ran.exit_code == int(missed), (command, ran.output)


def test_an_end_link_is_as_long_as_a_link_of_the_same_shape(tmp_path: Path) -> None:
    for text in (urdf(), urdf(inertial=INERTIAL.replace("0.035", "0"))):
        made = imported(tmp_path, text)
        assert made.robot.link_lengths_m == pytest.approx([0.07] * 4, abs=1e-12)
        assert noted(made, "head l0: 0.07 m long, its shape is that of l1")
        assert noted(made, "tail l3: 0.07 m long, its shape is that of l2")


def test_an_end_link_of_another_shape_reaches_as_far_as_that(tmp_path: Path) -> None:
    made = imported(tmp_path, urdf(tail=SHAPE.replace('length="0.06"', 'length="0.05"')))
    assert made.robot.link_lengths_m == pytest.approx([0.07, 0.07, 0.07, 0.06])
    assert noted(made, "tail l3: 0.06 m long, as far as its shape reaches")


def test_an_end_link_without_shape_is_as_long_as_its_neighbour(tmp_path: Path) -> None:
    made = imported(tmp_path, urdf(tail=""))
    assert made.robot.link_lengths_m == pytest.approx([0.07] * 4)
    assert noted(made, "tail l3: 0.07 m long, as its neighbour l2")


def test_an_end_link_with_neither_is_twice_as_long_as_its_centre_is_far(tmp_path: Path) -> None:
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="{a}"/><child link="{b}"/><origin '
        f'xyz="{x} 0 0"/><axis xyz="{axis}"/>{LIMIT}</joint>'
        for k, (a, b, x, axis) in enumerate([("a", "c", 0.08, "0 0 1"), ("c", "b", 0, "0 1 0")])
    )
    text = (
        f'<robot name="m">{"".join(f"<link name={n!r}>{{}}</link>" for n in "acb")}{joints}</robot>'
    )
    made = imported(tmp_path, text.format(INERTIAL, INERTIAL, INERTIAL))
    assert made.robot.link_lengths_m == pytest.approx([0.09, 0.0, 0.07])
    assert noted(made, "head a: 0.09 m long, twice the distance of its centre of mass")
    at_joint = INERTIAL.replace("0.035 0 0", "0 0 0")
    with pytest.raises(InputError, match=r"link b: states no length.* --assume b\.length_m=0\.07$"):
        imported(tmp_path, text.format(INERTIAL, INERTIAL, at_joint))
    made = imported(tmp_path, text.format(INERTIAL, INERTIAL, at_joint), ".urdf", "b.length_m=0.05")
    assert made.robot.link_lengths_m[2] == 0.05
    assert made.notes[-1] == "assumed by option: b.length_m = 0.05"


@pytest.mark.parametrize(("turn", "one", "all_"), [("1.57", 0.0008, 0.0016), ("1.571", 2e-4, 4e-4)])
def test_rounded_right_angles_are_accepted_and_reported(
    tmp_path: Path, turn: str, one: float, all_: float
) -> None:
    made = imported(tmp_path, urdf(turn=turn))
    assert made.robot.joint_axes in ("pyp", "ypy")
    note = next(note for note in made.notes if note.startswith("axes are rounded"))
    told = [float(word) for word in re.findall(r"up to (\S+) rad", note)]
    assert told == pytest.approx([one, all_], rel=0.05)
    assert 0.0 < made.kinematics_error_m < 3e-4
    with pytest.raises(InputError, match=r"joint j1: its axis is 85\.9 degrees from that of j0"):
        imported(tmp_path, urdf(turn="1.5"))


def test_a_long_chain_of_rounded_angles_stays_alternating(tmp_path: Path) -> None:
    made = imported(tmp_path, rounded_quarter_turns(41))
    assert made.robot.joint_axes in ("py" * 20, "yp" * 20)


def test_a_link_world_is_dropped(tmp_path: Path) -> None:
    world = (
        '<link name="world"/><joint name="w" type="{}"><parent link="world"/><child link="l0"/>'
        "</joint>"
    )
    for kind in ("fixed", "floating", "planar"):
        made = imported(tmp_path, urdf(before=world.format(kind)))
        assert made.robot.model_dump() == imported(tmp_path, urdf()).robot.model_dump()
        assert noted(made, f"link world is dropped: it holds l0 by the {kind} joint w")
    with pytest.raises(InputError, match="joint w, line 2: connects the robot to the link world"):
        imported(tmp_path, urdf(before=world.format("revolute")))
    made = imported(tmp_path, urdf(before='<link name="world"/>'))
    assert noted(made, "link world is dropped: nothing joins it")


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_frame_that_holds_the_robot_freely_is_dropped_whatever_its_name(
    tmp_path: Path, kind: str
) -> None:
    def free(name: str, child: str) -> str:
        return (
            f'<link name="{name}"/><joint name="to_{child}" type="{kind}"><parent link="{name}"/>'
            f'<child link="{child}"/></joint>'
        )

    made = imported(tmp_path, urdf(before=free("map", "odom") + free("odom", "l0")))
    assert made.robot.model_dump() == imported(tmp_path, urdf()).robot.model_dump()
    assert noted(made, f"link map is dropped: it holds odom by the {kind} joint to_odom")
    assert noted(made, f"link odom is dropped: it holds l0 by the {kind} joint to_l0")


def test_limits_in_the_wrong_order_are_rejected(tmp_path: Path) -> None:
    text = urdf()
    with pytest.raises(InputError, match=r"joint j0, line \d+: its lower limit of 1.2 is above"):
        imported(tmp_path, text.replace('lower="-1.2" upper="1.2"', 'lower="1.2" upper="-1.2"'))


def test_repeated_elements_count_once_and_are_named_with_the_users_lines(tmp_path: Path) -> None:
    twice = '<dynamics damping="0.1"/>\n<dynamics damping="0.7"/>'
    made = imported(tmp_path, urdf(inside=twice))
    assert made.robot.model_dump() == imported(tmp_path, urdf()).robot.model_dump()
    assert noted(made, "joint j0 (line 8 and line 9 with other values), j1 (line 10 and line 11")
    assert noted(made, "3 in all: the first counts")


def test_a_fault_has_the_line_of_the_users_file(tmp_path: Path) -> None:
    text = urdf().replace('<axis xyz="0 0 1"/>', '<axis xyz="0 zero 1"/>')
    line = next(k for k, row in enumerate(text.splitlines(), start=1) if "zero" in row)
    with pytest.raises(InputError, match=f"model.urdf: MuJoCo cannot read it: .*line {line}$"):
        imported(tmp_path, text)


def test_a_fault_in_an_included_file_names_it(tmp_path: Path) -> None:
    (tmp_path / "body.xml").write_text("<mujoco>\n<worldbody>\n<bod/>\n</worldbody>\n</mujoco>")
    with pytest.raises(InputError, match=r"Element 'bod', body\.xml line 3"):
        imported(tmp_path, '<mujoco><include file="body.xml"/></mujoco>', ".xml")


def test_passive_wheels_are_part_of_their_link(tmp_path: Path) -> None:
    made = imported(tmp_path, wheeled_urdf())
    assert made.robot.joint_axes == "y" * 8
    assert made.robot.link_lengths_m == pytest.approx([0.1] * 9)
    assert made.robot.link_masses_kg == pytest.approx([0.22, *[0.221] * 8])
    assert made.robot.body_radius_m == 0.025  # of the box, not of the wheels
    assert noted(made, "18 passive wheels are part of their links")
    made = imported(tmp_path, wheeled_mjcf(), ".xml")
    assert noted(made, "they state a friction of 1.25: --set world.friction.across=1.25")
    assert made.robot.joint_axes == "y" * 8


def test_wheels_state_their_friction_in_a_gazebo_tag(tmp_path: Path) -> None:
    tags = "".join(
        f'<gazebo reference="l{k}_{side}_wheel"><mu1>0.8</mu1></gazebo>'
        for k in range(9)
        for side in ("left", "right")
    )
    made = imported(tmp_path, wheeled_urdf().replace("</robot>", f"{tags}</robot>"))
    assert noted(made, "they state a friction of 0.8: --set world.friction.across=0.8")


def test_driven_wheels_are_no_passive_ones(tmp_path: Path) -> None:
    drive = '<transmission name="t"><joint name="l2_left_wheel_joint"/></transmission></robot>'
    with pytest.raises(InputError, match=r"body l2: carries 2 bodies \(l2_left_wheel, l3\)"):
        imported(tmp_path, wheeled_urdf().replace("</robot>", drive))


def test_missing_meshes_are_counted_and_their_mass_is_kept(tmp_path: Path) -> None:
    made = imported(tmp_path, modules_without_meshes(), ".xml")
    assert made.robot.link_masses_kg == pytest.approx([0.2] * 15)
    assert noted(made, "15 shapes are left out, their mass is kept: missing mesh files: asset/head")
    assert noted(made, "radius of 15 links is assumed")
    assert noted(made, "left out of the MJCF: 14 actuator, 1 texture, 1 material, 1 light")
    with pytest.raises(InputError, match=r"line 1: the mesh module is missing, .* --assume module"):
        imported(tmp_path, wheeled_mjcf(mesh=True), ".xml")
    made = imported(tmp_path, modules_without_meshes(), ".xml", "radius_m=0.033")
    assert made.robot.body_radius_m == 0.033


def test_meshes_of_a_package_are_read_where_they_are(tmp_path: Path) -> None:
    """A box of 60 by 40 by 40 mm about the link's middle."""
    folder = tmp_path / "snake" / "meshes"
    folder.mkdir(parents=True)
    corners = [(x, y, z) for x in (5, 65) for y in (-20, 20) for z in (-20, 20)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    faces = "1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"
    for face in faces:
        a, b, c, d = face.split()
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    mesh = (
        '<visual><geometry><mesh filename="package://snake/meshes/{}" scale="0.001 0.001 0.001"/>'
        "</geometry></visual>"
    )
    (tmp_path / "snake" / "urdf").mkdir()
    there = urdf(shape=mesh.format("box.obj"), tail=mesh.format("box.obj"))
    made = imported(tmp_path / "snake" / "urdf", there)
    assert made.robot.body_radius_m == pytest.approx(0.02)
    assert made.robot.link_lengths_m == pytest.approx([0.07] * 4)
    assert noted(made, "meshes read: 1")
    (folder / "dot.obj").write_text("v 0 0 0\n")  # none that MuJoCo can use
    made = imported(tmp_path / "snake" / "urdf", there.replace("box.obj", "dot.obj"))
    assert noted(made, "mesh file package://snake/meshes/dot.obj is missing or unreadable")


def test_a_link_without_mass_is_asked_for(tmp_path: Path) -> None:
    text = standing_on_world(3, bare_tail=True)
    with pytest.raises(
        InputError, match=r"link link4: states no mass; add --assume link4.mass_kg=1$"
    ):
        imported(tmp_path, text)
    out = tmp_path / "out.toml"
    words = ["robot", "import", str(tmp_path / "model.urdf"), "-o", str(out)]
    assert CliRunner().invoke(app, [*words, "--assume", "link4.mass_kg=0.4"]).exit_code == 0
    assert load_robot(str(out)).link_masses_kg[-1] == 0.4
    assert "assumed by option: link4.mass_kg = 0.4" in out.read_text()
    for wrong in ("link4.mass_kg=x", "link9.mass_kg=1", "radius", "link4.mass_kg=-1"):
        caught = CliRunner().invoke(app, [*words, "--force", "--assume", wrong])
        assert isinstance(caught.exception, InputError), wrong


def test_stated_torque_and_speed_limit_a_plan(tmp_path: Path) -> None:
    made = imported(tmp_path, urdf())
    assert made.robot.joint_speed_limit_rad_s == 3.0
    assert made.robot.torque_limit_n_m == pytest.approx(4.1 * 2.0 / 2.3, abs=1e-3)
    assert noted(made, "torque of a plan: the model states 4 N m; a XM430-W350 holds 3.565")
    made = imported(tmp_path, urdf().replace('effort="4"', 'effort="3000000"'))
    assert made.robot.torque_limit_n_m == pytest.approx(4.1 * 2.0 / 2.3, abs=1e-3)
    assert noted(made, "the model states 3e+06 N m, which no servo has; a XM430-W350 holds 3.565")


def test_inertias_that_no_body_has_do_not_matter(tmp_path: Path) -> None:
    for wrong in ('ixx="-1"', 'ixx="0"', 'ixx="9"'):
        made = imported(tmp_path, urdf(inertial=INERTIAL.replace('ixx="3e-5"', wrong)))
        assert noted(made, "inertia of 4 links is that of no body (l0, l1, l2, ...)")
        assert made.robot.link_lengths_m == pytest.approx([0.07] * 4)


def test_old_coordinates_are_named(tmp_path: Path) -> None:
    text = wheeled_mjcf().replace('coordinate="local"', 'coordinate="global"')
    with pytest.raises(InputError, match=r"line 1: states global coordinates, as MuJoCo 1 had"):
        imported(tmp_path, text, ".xml")


def test_comments_in_another_encoding_do_not_matter(tmp_path: Path) -> None:
    file = tmp_path / "model.urdf"
    file.write_bytes(urdf().replace("a comment", "\u86c7\u5f62").encode("gbk"))
    made = import_robot(file, "model", "XM430-W350")
    assert noted(made, "characters are not UTF-8")
    assert made.robot.joint_axes == "yyy"


@pytest.mark.parametrize("name", ["salamander", "quadruped"])
def test_legs_come_back_as_limbs(tmp_path: Path, name: str) -> None:
    robot = load_robot(name)
    made = imported(tmp_path, mjcf_text(robot), ".xml")
    assert made.robot.joint_axes == robot.joint_axes
    assert made.robot.signs == robot.signs
    assert made.joint_names == robot.joint_names
    for ours, theirs in zip(made.robot.limbs, robot.limbs, strict=True):
        for key in ("link", "joint_axes", "hip_m", "foot_radius_m", "foot_friction"):
            assert getattr(ours, key) == getattr(theirs, key)
        assert ours.segments_m == pytest.approx(theirs.segments_m, abs=1e-12)
        assert ours.segment_mass_kg == pytest.approx(theirs.segment_mass_kg)
    np.testing.assert_allclose(made.robot.limit_rad, robot.limit_rad, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('axis="-1.0 0 0"', 'axis="0 1 0"'), "of leg link11: its axis is neither upright nor"),
        (('pos="0.0 -0.035 0"', 'pos="0.02 -0.035 0.02"'), "off the straight leg at zero angles"),
        (('pos="0.0 -0.035 0"', 'pos="0.0 -0.05 0"'), "are not mirror images"),
    ],
)
def test_legs_that_a_robot_file_cannot_express_are_named(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    text = mjcf_text(load_robot("salamander"))
    assert change[0] in text
    with pytest.raises(InputError, match=said):
        imported(tmp_path, text.replace(change[0], change[1]), ".xml")


def test_xacro_is_run_if_it_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the program on the path, which stands for one that came with ROS."""
    monkeypatch.setattr(model_compiler, "find_spec", lambda _: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    text = arm_of_threes(xacro=True)
    with pytest.raises(InputError, match="is xacro, which needs the program xacro: pip install"):
        imported(tmp_path, text, ".xacro")
    (tmp_path / "expanded.urdf").write_text(arm_of_threes())
    program = tmp_path / "xacro"
    program.write_text(
        f"#!{sys.executable}\nprint(open({str(tmp_path / 'expanded.urdf')!r}).read())\n"
    )
    program.chmod(0o755)
    made = imported(tmp_path, text, ".xacro")
    assert made.robot.joint_axes == "ypp" * 4
    assert noted(made, "xacro was run with its default arguments")
    program.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('package not found: no_such')\n")
    with pytest.raises(InputError, match="xacro cannot expand it: package not found: no_such"):
        imported(tmp_path, text, ".xacro")


def test_the_real_xacro_expands_a_macro(tmp_path: Path) -> None:
    pytest.importorskip("xacro")
    made = imported(tmp_path, arm_of_threes(xacro=True), ".xacro")
    assert made.robot.joint_axes == "ypp" * 4
    assert made.robot.link_lengths_m == pytest.approx([0.25, *[0.0, 0.25, 0.25] * 4])


def test_the_file_of_a_robot_says_what_was_changed(tmp_path: Path) -> None:
    model, out = tmp_path / "m.urdf", tmp_path / "m.toml"
    model.write_text(wheeled_urdf())
    ran = CliRunner().invoke(app, ["robot", "import", str(model), "-o", str(out), "--json"])
    assert ran.exit_code == 0, ran.output
    head = [line for line in out.read_text().splitlines() if line.startswith("# - ")]
    assert any("18 passive wheels" in line for line in head)
    assert tomllib.loads(out.read_text())["joint_axes"][0] == "y"


@pytest.mark.slow
def test_a_broken_file_ends_with_a_line_and_never_with_a_traceback(tmp_path: Path) -> None:
    """Cuts and changed bytes and digits in models of every class."""
    rng = np.random.default_rng(0)
    file, outcomes = tmp_path / "m.urdf", {"imported": 0, "rejected": 0}
    faults: list[str] = []
    texts = [model.make().encode() for model in CLASSES.values()]
    for number in range(240):
        raw = bytearray(texts[number % len(texts)])
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(raw)))
            digits = [k for k, byte in enumerate(raw) if 48 <= byte < 58]
            match rng.integers(3 + 2 * number % 8):
                case 0:
                    raw[at] = int(rng.integers(256))
                case 1:
                    del raw[at : at + int(rng.integers(1, 60))]
                case 2:
                    raw[at:at] = raw[at : at + int(rng.integers(1, 60))]
                case 3:
                    del raw[int(0.9 * len(raw)) + at // 20 :]
                case _ if digits:
                    raw[digits[at % len(digits)]] = 48 + int(rng.integers(10))
            if not raw:
                break
        file.write_bytes(bytes(raw))
        try:
            import_robot(file, "m", "XM430-W350")
            outcomes["imported"] += 1
        except InputError as error:
            faults.append(str(error))
            outcomes["rejected"] += 1
    assert min(outcomes.values()) > 20
    assert [fault for fault in faults if not fault.startswith(str(file))] == []


def test_the_compiler_is_limited(tmp_path: Path) -> None:
    """The limits hold in a process of its own, as the command runs it."""
    (tmp_path / "m.xml").write_text("<mujoco><worldbody/></mujoco>")
    assert COMPILE(tmp_path / "m.xml", tmp_path / "m.mjb") is None
    ended = run_limited("bytearray(3_000_000_000)", most=(2_000_000_000, 10))
    assert "MemoryError" in ended.stderr


def test_soft_limits_narrow_the_ranges(tmp_path: Path) -> None:
    soft = '<safety_controller soft_lower_limit="-0.6" soft_upper_limit="0.6" k_velocity="1"/>'
    made = imported(tmp_path, urdf(inside=soft))
    assert made.robot.limit_rad == (0.6,) * 3
    assert noted(made, "the soft limits of safety_controller count: j0, j1, j2")
    unstated = imported(tmp_path, urdf(inside='<safety_controller k_velocity="1"/>'))
    assert unstated.robot.limit_rad == (1.2,) * 3
    assert not noted(unstated, "soft")


def test_limits_that_may_be_degrees_are_asked_for_at_once(tmp_path: Path) -> None:
    text = urdf().replace('lower="-1.2" upper="1.2"', 'lower="-90" upper="90"')
    with pytest.raises(InputError) as asked:
        imported(tmp_path, text)
    assert len(asked.value.faults) == 4
    for joint, fault in zip(("j0", "j1", "j2"), asked.value.faults, strict=False):
        assert f"joint {joint}: turns to 90 rad in the model, 14.3 turns: degrees" in fault
        assert fault.endswith(f"add --assume {joint}.limit_rad=1.571")
    assert asked.value.faults[-1].endswith("--assume '*.limit_rad=1.571'")
    made = imported(tmp_path, text, ".urdf", "*.limit_rad=1.5", "j1.limit_rad=1")
    assert made.robot.limit_rad == (1.5, 1.0, 1.5)


def test_masses_are_asked_for_at_once_and_answered_by_a_pattern(tmp_path: Path) -> None:
    with pytest.raises(InputError) as asked:
        imported(tmp_path, urdf(inertial=""))
    assert [fault.split(": ")[1] for fault in asked.value.faults[:4]] == [
        f"link l{k}" for k in range(4)
    ]
    made = imported(tmp_path, urdf(inertial=""), ".urdf", "*.mass_kg=0.2", "l3.mass_kg=0.1")
    np.testing.assert_allclose(made.robot.link_masses_kg, [0.1, 0.2, 0.2, 0.2][:: made_way(made)])


def made_way(made: ImportedRobot) -> int:
    """Return 1 if the robot begins with the light link, else -1."""
    return 1 if made.robot.link_masses_kg[0] < 0.15 else -1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('<link name="l3">', '<link name="l2">', "link l2 occurs twice, line 6 and line 7"),
        ('<joint name="j2"', '<joint name="j1"', "joint j1 occurs twice, line 9 and line 10"),
    ],
)
def test_a_repeated_name_is_named_with_both_lines(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        imported(tmp_path, urdf().replace(old, new))


def test_a_base_with_a_shape_is_no_part_of_a_robot_that_floats(tmp_path: Path) -> None:
    before = f"""<link name="cart">{INERTIAL}{SHAPE}</link><joint name="free" type="floating">
<parent link="cart"/><child link="l0"/></joint>"""
    made = imported(tmp_path, urdf(before=before))
    assert made.robot.joint_count == 3
    assert noted(made, "link cart is dropped: it holds l0 by the floating joint free")
    second = """<link name="b"/><joint name="again" type="floating">
<parent link="l3"/><child link="b"/></joint>"""
    with pytest.raises(InputError, match=r"joint j0, line .*: moves a second body"):
        imported(tmp_path, urdf(before=before, after=second))
