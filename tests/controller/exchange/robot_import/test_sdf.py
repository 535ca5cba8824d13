"""SDF models (http://sdformat.org/spec) give the robot of the same URDF, however frames are laid.

The files follow the layout of ``test/sdf/double_pendulum.sdf`` in gazebosim/sdformat.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from snakewalk.config.errors import InputError
from snakewalk.controller.exchange.robot_import.robot_import import ImportedRobot, import_robot

COUNT, LENGTH_M = 5, 0.07


def words(pose: RigidTransform, rotation: str = "euler_rpy") -> str:
    turn = pose.rotation
    numbers = turn.as_quat() if rotation == "quat_xyzw" else turn.as_euler("xyz")
    return " ".join(f"{v:.12f}" for v in (*pose.translation, *numbers))


def any_pose(rng: np.random.Generator) -> RigidTransform:
    turn = Rotation.random(rng=rng)
    return RigidTransform.from_components(rng.uniform(-0.2, 0.2, 3), turn)


def sdf(
    seed: int = 0, *, version: str = "1.9", axes: str = "joint", inside: str = "", around: str = ""
) -> str:
    """Write a chain along x whose joints turn about z, y, -z and -y; all frames are random."""
    rng = np.random.default_rng(seed)
    link_at = [any_pose(rng) for _ in range(COUNT)]
    joint_at = [
        RigidTransform.from_components([LENGTH_M * (k + 1), 0, 0], Rotation.random(rng=rng))
        for k in range(COUNT - 1)
    ]
    parts = []
    for k, pose in enumerate(link_at):
        middle = RigidTransform.from_translation([LENGTH_M * (k + 0.5), 0, 0])
        shape = middle * RigidTransform.from_rotation(Rotation.from_euler("y", 90, degrees=True))
        frame = "" if k == 0 else f' relative_to="l{k - 1}"'
        placed = pose if k == 0 or version < "1.7" else link_at[k - 1].inv() * pose
        attributes = "" if version < "1.7" else f"{frame} rotation_format='quat_xyzw'"
        rotation = "euler_rpy" if version < "1.7" else "quat_xyzw"
        parts.append(
            f"<link name='l{k}'><pose{attributes}>{words(placed, rotation)}</pose><inertial>"
            f"<pose>{words(pose.inv() * middle)}</pose><mass>0.1{k}</mass></inertial>"
            f"<collision name='c'><pose>{words(pose.inv() * shape)}</pose><geometry><cylinder>"
            f"<radius>0.02</radius><length>{LENGTH_M}</length></cylinder></geometry></collision>"
            f"{inside}</link>"
        )
    for k, pose in enumerate(joint_at):
        axis = np.array([[0, 0, 1], [0, 1, 0], [0, 0, -1], [0, -1, 0]][k], dtype=float)
        attribute = mark = ""
        if axes == "joint":
            axis = pose.rotation.inv().apply(axis)
        elif axes == "named":
            attribute = f" expressed_in='l{k}'"
            axis = link_at[k].rotation.inv().apply(axis)
        elif axes == "parent":
            mark = "<use_parent_model_frame>1</use_parent_model_frame>"
        parts.append(
            f"<joint name='j{k}' type='revolute'><parent>l{k}</parent><child>l{k + 1}</child>"
            f"<pose>{words(link_at[k + 1].inv() * pose)}</pose><axis>"
            f"<xyz{attribute}>{' '.join(map(str, axis))}</xyz><limit><lower>-1.{k}</lower>"
            f"<upper>1.{k}</upper><effort>{2 + k}</effort><velocity>3</velocity></limit>{mark}"
            "</axis></joint>"
        )
    model = f"<model name='snake'>{''.join(parts)}</model>"
    return f"<sdf version='{version}'>{around or '{}'}</sdf>".format(model)


def imported(tmp_path: Path, text: str) -> ImportedRobot:
    file = tmp_path / "snake.sdf"
    file.write_text(text)
    return import_robot(file, "snake", "XM430-W350")


@pytest.mark.parametrize(
    ("version", "axes"),
    [("1.9", "joint"), ("1.7", "named"), ("1.6", "parent"), ("1.6", "joint"), ("1.4", "model")],
)
def test_an_sdf_is_its_chain_wherever_its_frames_are(
    tmp_path: Path, version: str, axes: str
) -> None:
    made = imported(tmp_path, sdf(version=version, axes=axes))
    robot = made.robot
    assert robot.joint_axes == "ypyp"
    assert made.joint_names == ("j0", "j1", "j2", "j3")
    assert made.kinematics_error_m < 1e-9
    np.testing.assert_allclose(robot.link_lengths_m, [LENGTH_M] * COUNT, atol=1e-9)
    np.testing.assert_allclose(robot.link_masses_kg, [0.1, 0.11, 0.12, 0.13, 0.14], atol=1e-9)
    np.testing.assert_allclose(robot.limit_rad, [1.0, 1.1, 1.2, 1.3])
    # the head is at x = 0, so left is -y; with ours the part behind turns about down, or left
    assert robot.signs == (-1, -1, 1, 1)
    assert "torque of a plan: the model states 2 N m" in made.notes


def test_a_world_with_a_ground_holds_one_robot(tmp_path: Path) -> None:
    around = (
        "<world name='w'><include><uri>model://sun</uri></include>"
        "<model name='ground'><static>1</static><link name='plane'/></model>{}</world>"
    )
    made = imported(tmp_path, sdf(around=around, inside="<sensor name='s' type='imu'/>"))
    assert made.robot.joint_count == COUNT - 1
    assert "left out of the SDF: 5 sensor" in made.notes


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("<mass>0.12</mass>", ""), "l2.mass_kg"),
        (("type='revolute'", "type='ball'"), "joint j0, line 1: is ball from l0 to l1"),
        (('relative_to="l0"', 'relative_to="l3"'), "is relative to itself"),
        (('relative_to="l0"', 'relative_to="arm::l0"'), "has no link, joint or frame arm::l0"),
        (("<model name='snake'>", "<model name='snake'><include/>"), "gz sdf -p"),
        (("<parent>l0</parent>", "<parent>l9</parent>"), "from l9 to l1; expected"),
        (("<pose>", "<pose>left "), "expected the numbers of a pose"),
        (("</limit>", "</limit><mimic joint='j1'/>"), "mimics another"),
    ],
)
def test_an_sdf_that_is_no_chain_is_rejected_with_a_reason(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    text = sdf()
    assert change[0] in text
    with pytest.raises(InputError, match=said):
        imported(tmp_path, text.replace(*change, 1))


def test_a_joint_of_an_sdf_without_limits_is_endless(tmp_path: Path) -> None:
    text = sdf().replace("<upper>1.0</upper>", "<upper>1e16</upper>").replace("-1.0<", "-1e16<")
    made = imported(tmp_path, text)
    assert any(note.startswith("without a range in the model") for note in made.notes)


def test_a_base_in_the_world_is_dropped(tmp_path: Path) -> None:
    base = "<joint name='base' type='fixed'><parent>world</parent><child>l0</child></joint></model>"
    made = imported(tmp_path, sdf().replace("</model>", base))
    assert made.robot.joint_count == COUNT - 1
    assert any(note.startswith("link world is dropped") for note in made.notes)
