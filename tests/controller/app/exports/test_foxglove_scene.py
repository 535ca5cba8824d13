"""What Foxglove opens: its messages as it published them, and the body where it was."""

import json
from collections import defaultdict
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from scipy.spatial.transform import Rotation

from snakewalk.controller.app.exports.body_frames import body_frames
from snakewalk.controller.app.exports.foxglove_scene import write_foxglove_scene
from snakewalk.controller.app.exports.foxglove_schema import SCHEMAS
from snakewalk.controller.runlog.record import RunRecord

Messages = dict[str, list[Any]]
PYTHON_TYPES = {"number": (int, float), "integer": int, "string": str, "boolean": bool}


@pytest.fixture(scope="module")
def messages(record: RunRecord, tmp_path_factory: pytest.TempPathFactory) -> Messages:
    path = tmp_path_factory.mktemp("scene") / "scene.mcap"
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
    """What of a message its schema forbids, as far as the schemas here say anything."""
    if schema["type"] == "array":
        ok = isinstance(value, list)
        return [f for one in value for f in faults(one, schema["items"], where)] if ok else [where]
    if schema["type"] != "object":
        return [] if isinstance(value, PYTHON_TYPES[schema["type"]]) else [where]
    known = schema.get("properties", {})
    wrong = [f"{where}: no {name}" for name in schema.get("required", []) if name not in value]
    wrong += [f"{where}: has {name}" for name in value if name not in known]
    return wrong + [
        fault
        for name, inner in value.items()
        if name in known
        for fault in faults(inner, known[name], f"{where}.{name}")
    ]


def compare(schema: Any, descriptor: Any) -> None:
    """A schema's fields are those of the published message, of the same kinds, all of them."""
    left_out = {"acceleration"} if descriptor.name == "JointState" else set()
    assert set(schema["properties"]) == {f.name for f in descriptor.fields} - left_out
    for field in descriptor.fields:
        if field.name in left_out:
            continue
        ours = schema["properties"][field.name]
        if field.is_repeated:
            assert ours["type"] == "array", field.full_name
            ours = ours["items"]
        kind = field.cpp_type
        if kind != field.CPPTYPE_MESSAGE:
            expected = {
                field.CPPTYPE_DOUBLE: "number",
                field.CPPTYPE_STRING: "string",
                field.CPPTYPE_BOOL: "boolean",
            }.get(kind, "integer")
            assert ours["type"] == expected, field.full_name
        elif field.message_type.full_name.startswith("google."):
            assert set(ours["properties"]) == {"sec", "nsec"}, field.full_name  # Foxglove's JSON
        elif "properties" in ours:
            assert ours["title"] == field.message_type.full_name
            compare(ours, field.message_type)


@pytest.mark.parametrize("name", SCHEMAS)
def test_the_schemas_are_those_that_foxglove_publishes(name: str) -> None:
    pytest.importorskip("foxglove_schemas_protobuf")
    short = name.removeprefix("foxglove.")
    module = import_module(f"foxglove_schemas_protobuf.{short}_pb2")
    compare(SCHEMAS[name], module.DESCRIPTOR.message_types_by_name[short])


def test_the_body_hangs_on_its_frames(messages: Messages, record: RunRecord) -> None:
    robot, frames = record.header.robot, body_frames(record)
    first = {entity["id"]: entity for entity in messages["/scene"][0]["entities"]}
    for name in frames.names:
        (cylinder,) = first[name]["cylinders"]
        assert first[name]["frame_id"] == name
        assert first[name]["frame_locked"] is True
        assert cylinder["size"]["z"] == pytest.approx(robot.link_length_m, rel=0.1)
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
