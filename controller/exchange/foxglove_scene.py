"""A log for Foxglove in 3-D: body, ground, path and waypoints, joints and events.

The MCAP file has Foxglove's well-known messages in JSON, which needs no package.
"""

from collections import Counter
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import cycle
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.ground import water_surface_m
from snakewalk.config.heightfield import HeightField, surface
from snakewalk.controller.exchange.body_frames import WORLD, body_frames
from snakewalk.controller.exchange.imu_readings import imu_readings
from snakewalk.controller.exchange.remaining_fields import TIME, Shown, remaining_fields
from snakewalk.controller.exchange.ros_messages import (
    FRAMES,
    HEAD_POSE,
    IMU,
    JOINT_GOALS,
    JOINT_STATES,
)
from snakewalk.controller.runlog.encode import encode, floats, number
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.row_printer import json_value
from snakewalk.controller.runlog.topics import (
    TABLES,
    ConfigTable,
    CycleTable,
    EventTable,
    ImuTable,
    PathTable,
    PoseTable,
    WaypointTable,
)
from snakewalk.sim.physics.solids import solids

Schema = dict[str, Any]
_INTEGER: Schema = {"type": "integer"}
_KINDS = {"DOUBLE": "number", "FLOAT": "number", "STRING": "string", "BOOL": "boolean"}
"""JSON types by protobuf's; the others are integers."""


@cache
def foxglove_schema(name: str) -> Schema:
    """Return the schema of a message such as ``foxglove.Log``.

    Foxglove's JSON has all fields but the optional ones; times are ``sec`` and ``nsec``.
    """
    short = name.removeprefix("foxglove.")
    module = import_module(f"foxglove_schemas_protobuf.{short}_pb2")
    return _message(module.DESCRIPTOR.message_types_by_name[short])


def _message(descriptor: Any) -> Schema:
    if descriptor.full_name in {"google.protobuf.Timestamp", "google.protobuf.Duration"}:
        fields = {"sec": _INTEGER, "nsec": _INTEGER}
        title = descriptor.name.lower()
        return {"title": title, "type": "object", "properties": fields, "required": [*fields]}
    return {
        "title": descriptor.full_name,
        "type": "object",
        "properties": {field.name: _field(field) for field in descriptor.fields},
        "required": [field.name for field in descriptor.fields if not _is_optional(field)],
    }


def _is_optional(field: Any) -> bool:
    return field.has_presence and field.message_type is None


def _field(field: Any) -> Schema:
    if field.message_type is not None:
        message = _message(field.message_type)
    else:
        names = {getattr(field, f"CPPTYPE_{name}"): kind for name, kind in _KINDS.items()}
        message = {"type": names.get(field.cpp_type, "integer")}
    return {"type": "array", "items": message} if field.is_repeated else message


Json = dict[str, Any]
Row = tuple[float, str, Json]
"""Time in s, topic, message."""
SCENE = "/scene"
FOXGLOVE_LOG = "/log"
TYPES = {
    SCENE: "foxglove.SceneUpdate",
    FRAMES: "foxglove.FrameTransforms",
    JOINT_STATES: "foxglove.JointStates",
    JOINT_GOALS: "foxglove.JointStates",
    HEAD_POSE: "foxglove.PoseInFrame",
    IMU: "foxglove.PoseInFrame",
    FOXGLOVE_LOG: "foxglove.Log",
}
"""Well-known message of each topic."""
SHOWN: Shown = {
    CycleTable: ("sent_rad", "measured_rad", "velocity_rad_s"),
    ImuTable: tuple(ImuTable.topic.columns),
    PoseTable: ("head_m", "rotation", "links_m"),
    PathTable: tuple(PathTable.topic.columns),
    WaypointTable: tuple(WaypointTable.topic.columns),
    EventTable: tuple(EventTable.topic.columns),
}
"""Fields that well-known messages contain; the others keep the log's topics and schemas."""
_LEVELS = {"info": 2, "warning": 3, "error": 4}
"""Levels of ``foxglove.Log``."""
_HEAD = (0.85, 0.33, 0.10, 1.0)
_LINKS = ((0.20, 0.45, 0.70, 1.0), (0.35, 0.65, 0.85, 1.0))
_PATH = (0.95, 0.75, 0.10, 1.0)
_WAYPOINT = (0.10, 0.65, 0.30, 0.35)
_GROUND = ((0.33, 0.36, 0.30, 1.0), (0.80, 0.78, 0.68, 1.0))
_WATER = (0.55, 0.80, 0.92, 0.25)
"""Colours (ours): red, green, blue, opacity; of the ground's lowest and highest point."""
_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
_TURN_TO_X = (0.0, 0.5**0.5, 0.0, 0.5**0.5)
"""Turns a cylinder, which stands along z, along x."""
_TURN_TO_Y = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
"""Quaternion that turns a cylinder, which stands along z, along y."""
_MARGIN_M = 1.0
"""Width of the flat floor that is drawn beyond the path (ours)."""
_WIDTH_PX = 3.0
_PATH_HEIGHT_M = 0.005
"""Height of a drawn line above the ground, so that it is visible (ours)."""


def write_foxglove_scene(record: RunRecord, path: Path) -> dict[str, int]:
    """Write the file; returns the number of messages of each topic."""
    counts: Counter[str] = Counter()
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="", library=f"snakewalk {record.header.software}")

        @cache
        def channel(topic: str) -> int:
            if topic in TYPES:
                name = TYPES[topic]
                schema = encode(foxglove_schema(name)).encode()
            else:
                of_log = next(table.topic for table in TABLES if table.topic.name == topic)
                name = of_log.schema_name
                schema = of_log.schema
            schema_id = writer.register_schema(name, "jsonschema", schema)
            return int(writer.register_channel(topic, "json", schema_id))

        for time_s, topic, message in sorted(_rows(record), key=itemgetter(0)):
            stamp_ns = round(time_s * 1e9)
            data = encode(message).encode()
            writer.add_message(channel(topic), stamp_ns, data, publish_time=stamp_ns)
            counts[topic] += 1
        writer.add_metadata("pose", record.header.pose_evidence.texts)
        writer.finish()
    return dict(counts)


def _rows(record: RunRecord) -> Iterator[Row]:
    things = [*_body(record), _ground(record), *_water(record), *_obstacle(record)]
    yield 0.0, SCENE, _scene(things)
    for time_s, points_m in record.waypoints:
        yield time_s, SCENE, _scene([_waypoints(record, time_s, points_m)])
    for time_s, points_m in record.paths:
        yield time_s, SCENE, _scene([_path(record, time_s, points_m)])
    yield from _frames(record)
    yield from _joints(record)
    yield from _imu(record)
    yield from _remaining_rows(record)
    for event in record.events:
        message = {
            "timestamp": _time(event.time_s),
            "level": _LEVELS[event.level],
            "message": f"{event.kind}: {event.text}",
            "name": "snakewalk",
            "file": "",
            "line": 0,
        }
        yield event.time_s, FOXGLOVE_LOG, message


def _remaining_rows(record: RunRecord) -> Iterator[Row]:
    """Rows of the log without the fields that other messages contain."""
    yield 0.0, ConfigTable.topic.name, record.header.row()
    for table, columns in remaining_fields(record, SHOWN):
        for k, time_s in enumerate(table.time_s.tolist()):
            values = {
                name: json_value(column, getattr(table, name)[k])
                for name, column in columns.items()
            }
            yield time_s, table.topic.name, {TIME: time_s, **values}


def _frames(record: RunRecord) -> Iterator[Row]:
    frames = body_frames(record)
    translations = floats(frames.translation_m)
    turns = floats(frames.quaternion)
    for time_s, ats, rotations in zip(frames.time_s.tolist(), translations, turns, strict=True):
        now = _time(time_s)
        transforms = [
            {
                "timestamp": now,
                "parent_frame_id": parent,
                "child_frame_id": name,
                "translation": _xyz(place),
                "rotation": _quaternion(turn),
            }
            for parent, name, place, turn in zip(
                frames.parents, frames.names, ats, rotations, strict=True
            )
        ]
        yield time_s, FRAMES, {"transforms": transforms}
        if len(record.pose.time_s):
            pose = _pose(ats[0], rotations[0])
            yield time_s, HEAD_POSE, {"timestamp": now, "frame_id": WORLD, "pose": pose}


def _imu(record: RunRecord) -> Iterator[Row]:
    """The link's axes as the device reports them, at the link: next to its frame, drift shows."""
    readings = imu_readings(record)
    rows = zip(
        readings.time_s.tolist(),
        floats(readings.link_m),
        floats(readings.quaternion),
        strict=True,
    )
    for time_s, place, turn in rows:
        pose = _pose(place, turn)
        yield time_s, IMU, {"timestamp": _time(time_s), "frame_id": WORLD, "pose": pose}


def _joints(record: RunRecord) -> Iterator[Row]:
    rows = record.cycle
    names = record.header.robot.joint_names
    effort_n_m = rows.current_a * record.header.torque_constant_n_m_a
    measured = np.stack([rows.measured_rad, rows.velocity_rad_s, effort_n_m], axis=2)
    for time_s, states, goals in zip(
        rows.time_s.tolist(), floats(measured), floats(rows.sent_rad), strict=True
    ):
        now = _time(time_s)
        yield (
            time_s,
            JOINT_STATES,
            {
                "timestamp": now,
                "joints": [
                    {"name": name} | _known_schemas(position=q, velocity=v, effort=e)
                    for name, (q, v, e) in zip(names, states, strict=True)
                ],
            },
        )
        yield (
            time_s,
            JOINT_GOALS,
            {
                "timestamp": now,
                "joints": [
                    {"name": name} | _known_schemas(position=goal)
                    for name, goal in zip(names, goals, strict=True)
                ],
            },
        )


def _body(record: RunRecord) -> Iterator[Json]:
    """A cylinder for each link of spine and legs, which moves with its frame."""
    robot = record.header.robot
    for link, color in zip(range(robot.link_count), cycle(_LINKS), strict=False):
        length_m, width_m = robot.link_lengths_m[link], 2.0 * robot.link_radii_m[link]
        if length_m == 0.0:
            continue
        cylinder = {
            "pose": _pose([0.0 if link == 0 else -0.5 * length_m, 0.0, 0.0], _TURN_TO_X),
            "size": _xyz([width_m, width_m, 0.94 * length_m]),  # a gap shows the joint
            "bottom_scale": 1.0,
            "top_scale": 1.0 if link else 0.6,  # the head's tip
            "color": _color(_HEAD if link == 0 else color),
        }
        yield _entity(f"link{link}", 0.0, frame=f"link{link}", locked=True, cylinders=[cylinder])
    for link, joint in enumerate(robot.limb_joints, robot.link_count):
        pair = robot.limbs[joint.pair]
        side = joint.outward
        length_m, width_m = pair.segments_m[joint.place], 2.0 * pair.foot_radius_m
        cylinder = {
            "pose": _pose([0.0, 0.5 * side * length_m, 0.0], _TURN_TO_Y),
            "size": _xyz([width_m, width_m, length_m]),
            "bottom_scale": 1.0,
            "top_scale": 1.0,
            "color": _color(_LINKS[joint.place % 2]),
        }
        yield _entity(f"link{link}", 0.0, frame=f"link{link}", locked=True, cylinders=[cylinder])


def _ground(record: RunRecord) -> Json:
    """The ground's triangles, the same as those of the physics, coloured by height."""
    field = _drawn_ground(record)
    corners_m, faces = surface(field)
    height = corners_m[:, 2]
    share = (height - height.min()) / max(np.ptp(height), 1e-9)
    low, high = np.array(_GROUND)
    triangles = {
        "pose": _pose([0.0, 0.0, 0.0], _UPRIGHT),
        "points": _points(corners_m),
        "color": _color(_GROUND[1]),
        "colors": [_color(level) for level in floats(low + share[:, None] * (high - low))],
        "indices": faces.ravel().tolist(),
    }
    return _entity("ground", 0.0, triangles=[triangles])


def _water(record: RunRecord) -> Iterator[Json]:
    surface_m = water_surface_m(record.header.world, record.header.ground)
    if surface_m is not None:
        middle_m, size_m = surface_m
        pose = _pose(middle_m.tolist(), _UPRIGHT)
        size = _xyz([*size_m.tolist(), 0.002])
        cube = {"pose": pose, "size": size, "color": _color(_WATER)}
        yield _entity("water", 0.0, cubes=[cube])


def _obstacle(record: RunRecord) -> Iterator[Json]:
    """Pole, pipe, pegs or walls, of the parts that the body touches."""
    thing = record.header.world.obstacle
    if thing is None:
        return
    cubes = []
    cylinders = []
    for part in solids(thing):
        turn = Rotation.from_matrix(part.axes).as_quat().tolist()
        drawn = {"pose": _pose(part.centre_m.tolist(), turn), "color": _color(part.colour)}
        if part.kind == "box":
            cubes.append(drawn | {"size": _xyz(2.0 * np.array(part.half_m))})
        else:
            radius_m, half_m = part.half_m
            size = _xyz([2.0 * radius_m, 2.0 * radius_m, 2.0 * half_m])
            cylinders.append(drawn | {"size": size, "bottom_scale": 1.0, "top_scale": 1.0})
    yield _entity("obstacle", 0.0, cubes=cubes, cylinders=cylinders)


def _drawn_ground(record: RunRecord) -> HeightField:
    """The log's height field, or a flat floor of four corners around path and body."""
    if record.header.ground is not None:
        return record.header.ground
    places = [points[:, :2] for _, points in record.paths] + [record.pose.head_m[:, :2]]
    places_m = np.concatenate([*places, np.zeros((1, 2))])
    low = np.nanmin(places_m, axis=0) - _MARGIN_M
    size_m = float(np.max(np.nanmax(places_m, axis=0) + _MARGIN_M - low))
    return HeightField(np.zeros((2, 2)), size_m, float(low[0]), float(low[1]))


def _waypoints(record: RunRecord, time_s: float, points_m: Floats) -> Json:
    size_m = 2.0 * (number(record.header.plan.waypoint_radius_m) or 0.0)
    spheres = [
        {
            "pose": _pose(place, _UPRIGHT),
            "size": _xyz([size_m, size_m, size_m]),
            "color": _color(_WAYPOINT),
        }
        for place in floats(_on_ground(record, points_m))
    ]
    return _entity("waypoints", time_s, spheres=spheres)


def _path(record: RunRecord, time_s: float, points_m: Floats) -> Json:
    raised = _on_ground(record, points_m) + np.array([0.0, 0.0, _PATH_HEIGHT_M])
    line = {
        "type": 0,  # a strip
        "pose": _pose([0.0, 0.0, 0.0], _UPRIGHT),
        "thickness": _WIDTH_PX,
        "scale_invariant": True,
        "points": _points(raised),
        "color": _color(_PATH),
        "colors": [],
        "indices": [],
    }
    return _entity("path", time_s, lines=[line])


def _on_ground(record: RunRecord, points_m: Floats) -> Floats:
    """(n, 3) points; those on paper, (n, 2), at the ground's height."""
    if points_m.shape[1] == 3:
        return points_m
    ground = record.header.ground
    height = 0.0 if ground is None else ground.elevation_m(points_m[:, 0], points_m[:, 1])
    return np.column_stack([points_m, np.broadcast_to(height, len(points_m))])


def _scene(entities: list[Json]) -> Json:
    return {"deletions": [], "entities": entities}


def _entity(
    name: str, time_s: float, *, frame: str = WORLD, locked: bool = False, **shapes: list[Json]
) -> Json:
    """Something that is drawn until another of its name replaces it."""
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    return {
        "timestamp": _time(time_s),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": locked,
        "metadata": [],
        **{kind: shapes.get(kind, []) for kind in kinds},
    }


def _time(time_s: float) -> Json:
    seconds, nanoseconds = divmod(round(time_s * 1e9), 1_000_000_000)
    return {"sec": seconds, "nsec": nanoseconds}


def _xyz(values: Any) -> Json:
    x, y, z = map(float, values)
    return {"x": x, "y": y, "z": z}


def _quaternion(values: Any) -> Json:
    x, y, z, w = values
    return {"x": x, "y": y, "z": z, "w": w}


def _pose(place: Any, turn: Any) -> Json:
    return {"position": _xyz(place), "orientation": _quaternion(turn)}


def _points(values: Floats) -> list[Json]:
    return [_xyz(point) for point in floats(values)]


def _color(values: Any) -> Json:
    r, g, b, a = values
    return {"r": r, "g": g, "b": b, "a": a}


def _known_schemas(**values: float | None) -> Json:
    return {name: value for name, value in values.items() if value is not None}
