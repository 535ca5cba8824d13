"""What Foxglove opens: its messages as it published them, and the body where it was."""

import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import WaterGround
from snakewalk.controller.exchange.body_frames import body_frames
from snakewalk.controller.exchange.foxglove_scene import foxglove_schema, write_foxglove_scene
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.sim.physics.plant import MujocoPlant

Messages = dict[str, list[Any]]
PYTHON_TYPES = {"number": (int, float), "integer": int, "string": str, "boolean": bool}


@pytest.fixture(scope="module")
def messages(record: RunRecord, tmp_path_factory: pytest.TempPathFactory) -> Messages:
    return written(record, tmp_path_factory.mktemp("scene") / "scene.mcap")


def written(record: RunRecord, path: Path) -> Messages:
    """Messages of each topic, every one of them as its schema says."""
    counts = write_foxglove_scene(record, path)
    out: Messages = defaultdict(list)
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            row = json.loads(message.data)
            assert faults(row, json.loads(schema.data), schema.name) == []
            out[channel.topic].append(row)
    assert {topic: len(rows) for topic, rows in out.items()} == counts
    return out


def faults(value: Any, schema: Any, where: str) -> list[str]:
    """Faults of a message by its schema, as far as the schemas here say anything."""
    if "enum" in schema:
        return [] if value in schema["enum"] else [where]
    kinds = [schema["type"]] if isinstance(schema["type"], str) else schema["type"]
    if value is None:
        return [] if "null" in kinds else [where]
    if kinds[0] == "array":
        ok, items = isinstance(value, list), schema.get("items")
        if not ok or items is None:
            return [] if ok else [where]
        return [fault for one in value for fault in faults(one, items, where)]
    if kinds[0] != "object":
        return [] if isinstance(value, PYTHON_TYPES[kinds[0]]) else [where]
    if "properties" not in schema:
        return [] if isinstance(value, dict) else [where]
    known = schema.get("properties", {})
    wrong = [f"{where}: no {name}" for name in schema.get("required", []) if name not in value]
    wrong += [f"{where}: has {name}" for name in value if name not in known]
    return wrong + [
        fault
        for name, inner in value.items()
        if name in known
        for fault in faults(inner, known[name], f"{where}.{name}")
    ]


def test_the_schemas_are_those_of_foxglove_s_package() -> None:
    log = foxglove_schema("foxglove.Log")
    assert log["required"] == ["timestamp", "level", "message", "name", "file", "line"]
    assert log["properties"]["timestamp"]["required"] == ["sec", "nsec"]
    assert [log["properties"][name]["type"] for name in ("level", "message", "line")] == [
        *("integer", "string", "integer")
    ]
    scene = foxglove_schema("foxglove.SceneUpdate")["properties"]["entities"]["items"]
    cubes = scene["properties"]["cubes"]
    assert (scene["title"], cubes["type"]) == ("foxglove.SceneEntity", "array")
    assert cubes["items"]["properties"]["size"]["title"] == "foxglove.Vector3"
    joint = foxglove_schema("foxglove.JointStates")["properties"]["joints"]["items"]
    assert joint["required"] == ["name"]
    assert joint["properties"]["effort"] == {"type": "number"}


def test_the_body_hangs_on_its_frames(messages: Messages, record: RunRecord) -> None:
    robot, frames = record.header.robot, body_frames(record)
    first = {entity["id"]: entity for entity in messages["/scene"][0]["entities"]}
    for name in frames.names:
        (cylinder,) = first[name]["cylinders"]
        assert first[name]["frame_id"] == name
        assert first[name]["frame_locked"] is True
        assert cylinder["size"]["z"] == pytest.approx(robot.mean_link_length_m, rel=0.1)
        assert cylinder["size"]["x"] == pytest.approx(2.0 * robot.body_radius_m)
    for k, message in enumerate(messages["/tf"]):
        assert [t["child_frame_id"] for t in message["transforms"]] == list(frames.names)
        turn = [list(t["rotation"].values()) for t in message["transforms"]]
        np.testing.assert_allclose(turn, frames.quaternion[k], atol=1e-6)
    head = messages["/head_pose"][3]["pose"]["position"]
    np.testing.assert_allclose(list(head.values()), record.pose.head_m[3], atol=1e-6)


def test_the_ground_has_the_triangles_of_the_physics(messages: Messages, record: RunRecord) -> None:
    field = record.header.ground
    assert field is not None
    (entity,) = (e for e in messages["/scene"][0]["entities"] if e["id"] == "ground")
    (mesh,) = entity["triangles"]
    points = np.array([list(p.values()) for p in mesh["points"]])
    corners = points[np.array(mesh["indices"]).reshape(-1, 3)]
    rows, columns = field.z_m.shape
    assert len(corners) == 2 * (rows - 1) * (columns - 1)
    middle = corners.mean(axis=1)
    np.testing.assert_allclose(
        middle[:, 2], field.elevation_m(middle[:, 0], middle[:, 1]), atol=1e-5
    )
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()  # seen from above


@pytest.mark.parametrize("world", ["pegs", "pipe", "pole", "corridor"])
def test_an_obstacle_has_the_parts_that_the_body_touches(
    record: RunRecord, tmp_path: Path, world: str
) -> None:
    made = load_world(world)
    header = replace(record.header, world=made, ground=None)
    first = written(replace(record, header=header), tmp_path / "scene.mcap")["/scene"][0]
    (entity,) = (e for e in first["entities"] if e["id"] == "obstacle")
    model = MujocoPlant(load_robot("yaw16"), made).mechanics.model
    geoms = [model.geom(k) for k in range(model.ngeom)]
    touched = [geom for geom in geoms if geom.name.startswith("obstacle")]
    drawn = [*entity["cubes"], *entity["cylinders"]]
    assert len(drawn) == len(touched)
    for part, geom in zip(drawn, touched, strict=True):
        at, size = part["pose"]["position"], list(part["size"].values())
        np.testing.assert_allclose(list(at.values()), geom.pos, atol=1e-6)
        turn = Rotation.from_quat(list(part["pose"]["orientation"].values()))
        same = turn.inv() * Rotation.from_quat(geom.quat, scalar_first=True)
        assert same.magnitude() < 1e-6
        if geom.type == mujoco.mjtGeom.mjGEOM_BOX:
            np.testing.assert_allclose(size, 2.0 * geom.size, atol=1e-6)
        else:
            np.testing.assert_allclose(size, 2.0 * geom.size[[0, 0, 1]], atol=1e-6)


def test_water_lies_as_high_as_it_is_deep(record: RunRecord, tmp_path: Path) -> None:
    made = load_world("pool")
    header = replace(record.header, world=made, ground=None)
    first = written(replace(record, header=header), tmp_path / "scene.mcap")["/scene"][0]
    (entity,) = (e for e in first["entities"] if e["id"] == "water")
    assert isinstance(made.ground, WaterGround)
    assert entity["cubes"][0]["pose"]["position"]["z"] == made.ground.depth_m


def test_legs_have_a_cylinder_each_segment(record: RunRecord, tmp_path: Path) -> None:
    robot = load_robot("salamander")
    header = replace(record.header, robot=robot)
    first = written(replace(record, header=header), tmp_path / "scene.mcap")["/scene"][0]
    drawn = {e["id"]: e for e in first["entities"]}
    for link, joint in enumerate(robot.limb_joints, robot.link_count):
        (cylinder,) = drawn[f"link{link}"]["cylinders"]
        assert cylinder["size"]["z"] == robot.limbs[joint.pair].segments_m[joint.place]


def test_joints_path_and_events(messages: Messages, record: RunRecord) -> None:
    joints = messages["/joint_states"][5]["joints"]
    assert "position" not in joints[15]  # never read: left out, not zero
    assert joints[2]["position"] == pytest.approx(record.cycle.measured_rad[5, 2], abs=1e-6)
    later = [e for m in messages["/scene"][1:] for e in m["entities"]]
    for kind in ("path", "waypoints"):  # the second takes the first one's place
        found = [e for e in later if e["id"] == kind]
        assert [e["timestamp"]["nsec"] for e in found] == [0, 200_000_000]
    assert [len(e["spheres"]) for e in found] == [1, 2]
    assert [(m["level"], m["message"]) for m in messages["/log"]] == [
        (2, 'start: torque on; "quoted", ünïcode'),
        (4, "trip: joint 7: current"),
    ]


def test_the_attitude_stands_where_its_link_is(messages: Messages, record: RunRecord) -> None:
    robot, last = record.header.robot, messages["/imu"][-1]
    assert robot.imu is not None
    assert len(messages["/imu"]) == 15
    turn = Rotation.from_quat(list(last["pose"]["orientation"].values())).as_matrix()
    np.testing.assert_allclose(turn, record.imu.rotation[-1], atol=2e-6)
    places, at = record.pose.links_m[:, robot.imu.link], list(last["pose"]["position"].values())
    np.testing.assert_allclose(at, places[-2] + 0.9 * (places[-1] - places[-2]), atol=1e-5)
    assert last["frame_id"] == "world"
