"""Robots in other programs' formats: MuJoCo reads them, and finds the links where ours are."""

import json
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.exported_body import exported_speeds
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot, load_world, shipped
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.exchange.robot_export import CONTACT_NOTES, mjcf_text, urdf_text
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import MujocoPlant
from tests.helpers.uneven import UNEVEN
from tests.sim.physics.test_gear_friction import drive_of

ROBOTS = [load_robot(name) for name in shipped("robots")]
CHAINS = [*(robot for robot in ROBOTS if not robot.limbs), UNEVEN]


def poses(robot: RobotConfig) -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.uniform(-1.0, 1.0, (20, robot.joint_count)) * np.array(robot.limit_rad)


def limits(model: mujoco.MjModel) -> np.ndarray:
    return model.jnt_range[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]


@pytest.mark.parametrize("robot", CHAINS, ids=lambda robot: robot.name)
def test_links_of_the_urdf_are_where_ours_are(robot: RobotConfig) -> None:
    model = mujoco.MjModel.from_xml_string(urdf_text(robot))
    data = mujoco.MjData(model)
    assert model.nq == robot.joint_count
    head = BodyPose(0.0, np.zeros(3), np.eye(3))  # MuJoCo welds a URDF's first link to the world
    for joint_rad in poses(robot):
        data.qpos[:] = joint_rad
        mujoco.mj_kinematics(model, data)
        ours = body_in_world(robot, head, joint_rad)
        assert np.abs(data.xipos[1:] - ours.link_m[1:]).max() < 1e-9
        assert np.abs(data.xmat[1:].reshape(-1, 3, 3) - ours.rotation[1:]).max() < 1e-9
    assert np.abs(model.body_mass[1:] - robot.link_masses_kg[1:]).max() < 1e-9
    assert limits(model) == pytest.approx(np.outer(robot.limit_rad, [-1.0, 1.0]))
    names = [model.joint(j).name for j in range(model.njnt)]
    assert names == list(robot.joint_names)


@pytest.mark.parametrize("robot", [*ROBOTS, UNEVEN], ids=lambda robot: robot.name)
def test_links_of_the_mjcf_are_where_ours_are(robot: RobotConfig) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf_text(robot, contact="none"))
    data = mujoco.MjData(model)
    assert abs(model.body_mass.sum() - robot.mass_kg) < 1e-9
    mass_kg = model.body_mass[1 : 1 + robot.link_count, None]
    turned = np.array([0.3, -0.5, 0.6, 0.2])
    for joint_rad in poses(robot):
        data.qpos[:3], data.qpos[3:7] = (0.4, -1.0, 0.2), turned / np.linalg.norm(turned)
        data.qpos[7:] = joint_rad
        mujoco.mj_kinematics(model, data)
        spine = slice(1, 1 + robot.link_count)  # legs are bodies behind it
        axes = data.xmat[spine].reshape(-1, 3, 3)
        ours = body_in_world(robot, BodyPose(0.0, data.qpos[:3].copy(), axes[0].copy()), joint_rad)
        assert np.abs(data.xipos[spine] - ours.link_m).max() < 1e-9
        assert np.abs(axes - ours.rotation).max() < 1e-9
        centre_m = (mass_kg * data.xipos[spine]).sum(axis=0) / mass_kg.sum()
        assert np.abs(centre_m - ours.centre_m).max() < 1e-9


def test_a_urdf_of_a_body_with_legs_is_refused_not_written_without_them() -> None:
    with pytest.raises(InputError, match=r"salamander: has legs.*--mjcf"):
        urdf_text(load_robot("salamander"))


def test_the_head_of_the_urdf_weighs_what_it_does() -> None:
    robot = load_robot("xl330-16")
    text = urdf_text(robot)
    assert text.count(f'<mass value="{robot.mean_link_mass_kg!r}"') == robot.joint_count + 1


def test_export_writes_what_is_asked_for(tmp_path: Path) -> None:
    files = tmp_path / "a.urdf", tmp_path / "a.xml"
    words = ["robot", "export", "yaw16", "--urdf", str(files[0]), "--mjcf", str(files[1])]
    assert CliRunner().invoke(app, words).exit_code == 0
    for file in files:
        assert mujoco.MjModel.from_xml_path(str(file)).nbody > 16
    assert isinstance(CliRunner().invoke(app, words).exception, InputError)  # they exist
    nothing = CliRunner().invoke(app, ["robot", "export", "yaw16"]).exception
    assert isinstance(nothing, InputError)
    assert "--urdf FILE" in str(nothing)


def test_show_says_what_each_joint_is(tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    file.write_text(
        'name = "two"\n[[joints]]\naxis = "y"\nid = 9\nsign = -1\n[[joints]]\naxis = "p"\n'
    )
    shown = json.loads(CliRunner().invoke(app, ["robot", "show", str(file), "--json"]).stdout)
    assert shown["mass_kg"] == 0.33
    assert [each["id"] for each in shown["joints"]] == [9, 2]
    assert [each["sign"] for each in shown["joints"]] == [-1, 1]
    plain = CliRunner().invoke(app, ["robot", "show", str(file)]).stdout
    assert "XM430-W350" in plain


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_show_knows_every_joint_of_every_shipped_robot(robot: RobotConfig) -> None:
    ran = CliRunner().invoke(app, ["robot", "show", robot.name, "--json"])
    assert ran.exit_code == 0
    shown = json.loads(ran.stdout)
    assert [each["id"] for each in shown["joints"]] == list(robot.servo_ids)
    assert "".join(each["axis"] for each in shown["joints"]) == robot.all_axes
    assert shown["links"] == robot.link_count


def test_show_tells_each_link_where_links_differ(tmp_path: Path) -> None:
    file = tmp_path / "uneven.toml"
    file.write_text(plain_toml(UNEVEN))
    words = ["robot", "show", str(file)]
    shown = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert [link["length_m"] for link in shown["each_link"]] == list(UNEVEN.link_lengths_m)
    assert shown["mass_kg"] == 1.21
    assert "none" in CliRunner().invoke(app, words).stdout


def system(robot: RobotConfig, kind: Literal["topic", "dynamixel"]) -> ET.Element:
    root = ET.fromstring(urdf_text(robot, kind))
    found = root.find("ros2_control")
    assert found is not None
    assert found.get("type") == "system"
    return found


def params(of: ET.Element | None) -> dict[str, str]:
    assert of is not None
    return {each.get("name", ""): each.text or "" for each in of.findall("param")}


def test_ros2_control_drives_our_node_by_its_topics() -> None:
    robot = load_robot("alternating16")
    tag = system(robot, "topic")
    hardware = tag.find("hardware")
    assert hardware is not None
    assert hardware.findtext("plugin") == (
        "joint_state_topic_hardware_interface/JointStateTopicSystem"
    )
    assert params(hardware) == {
        "joint_commands_topic": "/robot_joint_command",
        "joint_states_topic": "/robot_joint_states",
    }
    joints = tag.findall("joint")
    assert [each.get("name") for each in joints] == list(robot.joint_names)
    for joint, limit in zip(joints, robot.limit_rad, strict=True):
        asked = joint.find("command_interface")
        assert asked is not None
        assert asked.get("name") == "position"
        assert params(asked) == {"min": repr(-limit), "max": repr(limit)}
        states = [each.get("name") for each in joint.findall("state_interface")]
        assert states == ["position", "velocity", "effort"]
    assert not tag.findall("gpio")
    assert mujoco.MjModel.from_xml_string(urdf_text(robot, "topic")).nq == 16


def test_ros2_control_drives_the_servos_themselves_with_their_signs(tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    joints = '[[joints]]\naxis = "y"\nid = 9\nsign = -1\n[[joints]]\naxis = "p"\nid = 4\n'
    file.write_text(f'name = "two"\n{joints}')
    tag = system(load_robot(str(file)), "dynamixel")
    own = params(tag.find("hardware"))
    assert own["baud_rate"] == "1000000"
    assert own["number_of_joints"] == own["number_of_transmissions"] == "2"
    # row by row, split at commas, as the plugin reads it
    assert [float(v) for v in own["transmission_to_joint_matrix"].split(",")] == [-1, 0, 0, 1]
    assert own["joint_to_transmission_matrix"] == own["transmission_to_joint_matrix"]
    servos = tag.findall("gpio")
    assert [params(each)["ID"] for each in servos] == ["9", "4"]
    assert {params(each)["type"] for each in servos} == {"dxl"}
    for servo in servos:
        asked = [each.get("name") for each in servo.findall("command_interface")]
        assert asked == ["Goal Position"]
    file.write_text(f'name = "two"\n{joints}zero_rad = 0.1\n')
    with pytest.raises(InputError, match=r"zero_rad 0\.1.*--ros2-control topic"):
        urdf_text(load_robot(str(file)), "dynamixel")


def test_ros2_control_is_a_part_of_a_urdf(tmp_path: Path) -> None:
    words = ["robot", "export", "yaw16", "--ros2-control", "topic"]
    alone = CliRunner().invoke(app, [*words, "--mjcf", str(tmp_path / "a.xml")]).exception
    assert isinstance(alone, InputError)
    assert "give --urdf FILE" in str(alone)
    file = tmp_path / "a.urdf"
    assert CliRunner().invoke(app, [*words, "--urdf", str(file)]).exit_code == 0
    assert "/robot_joint_command" in file.read_text()


HAS_DC_MOTORS = hasattr(mujoco.MjsActuator, "set_to_dcmotor")


@pytest.mark.skipif(not HAS_DC_MOTORS, reason="this MuJoCo has no dcmotor")
@pytest.mark.parametrize(("name", "most_rad"), [("yaw16", 5e-4), ("alternating16", 4e-3)])
def test_dc_motors_answer_a_step_as_our_servos_do(name: str, most_rad: float) -> None:
    """Half a radian, with full output, the back-EMF and, of pitch joints, the current limit."""
    robot = load_robot(name)
    plant = MujocoPlant(robot, load_world("flat"))
    plant.mechanics.mu = (0.0, 0.0, 0.0, 0.0)  # a model for others has no friction of the ground
    model = mujoco.MjModel.from_xml_string(mjcf_text(robot, "dcmotor", "none"))
    data, drive = mujoco.MjData(model), drive_of(robot)
    data.qpos[:] = plant.qpos
    drive.current_limit_a[:] = robot.current_limits_a
    drive.goal_rad[:] = data.ctrl[:] = 0.5 * np.sin(np.arange(robot.joint_count) / 2.0)
    apart, moved = [], []
    for k in range(400):
        plant.advance(plant.step_s * (k + 1), drive)
        mujoco.mj_step(model, data)
        apart.append(np.abs(plant.position_rad - data.qpos[7:]).max())
        moved.append(np.abs(plant.position_rad).max())
    assert max(moved) > 0.45
    assert max(apart) < most_rad


def test_a_mujoco_without_dc_motors_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def old(text: str) -> None:
        raise ValueError("XML Error: Schema violation: unrecognized element\nElement 'dcmotor'")

    monkeypatch.setattr(mujoco.MjModel, "from_xml_string", old)
    out = tmp_path / "yaw16.xml"
    words = ["robot", "export", "yaw16", "--mjcf", str(out), "--actuators", "dcmotor"]
    done = CliRunner().invoke(app, words)
    assert isinstance(done.exception, InputError)
    assert "cannot load it (XML Error: Schema violation" in str(done.exception)
    assert not out.exists()
    urdf = ["robot", "export", "yaw16", "--urdf", str(out), "--actuators", "dcmotor"]
    assert "give --mjcf FILE" in str(CliRunner().invoke(app, urdf).exception)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_rollers_keep_masses_and_the_order_of_the_joints(robot: RobotConfig) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf_text(robot))
    assert abs(model.body_mass.sum() - robot.mass_kg) < 1e-9
    names = [model.joint(j).name for j in range(1, model.njnt)]
    assert [name for name in names if not name.startswith("roller")] == list(robot.joint_names)


def test_the_exported_body_says_how_its_friction_differs(tmp_path: Path) -> None:
    out = tmp_path / "yaw16.xml"
    words = ["robot", "export", "yaw16", "--mjcf", str(out), "--contact"]
    done = CliRunner().invoke(app, [*words, "isotropic", "--json"])
    assert json.loads(done.output)["contact"] == CONTACT_NOTES["isotropic"]
    assert CONTACT_NOTES["isotropic"] in out.read_text(encoding="utf-8")
    alone = ["robot", "export", "yaw16", "--urdf", f"{out}.urdf", "--contact", "none"]
    assert "give --mjcf FILE" in str(CliRunner().invoke(app, alone).exception)


@pytest.mark.slow
def test_rollers_slip_across_and_roll_along() -> None:
    """A body without them stays where it is: 0.00 of our speed, with them 1.13."""
    ours_m_s, rollers, ice = exported_speeds("lateral-undulation", "yaw16", ("rollers", "none"))
    assert 0.8 < rollers / ours_m_s < 1.3
    assert ice / ours_m_s < 0.05
