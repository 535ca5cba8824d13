"""What each topic of the log holds, as JSON schemas: Foxglove and other readers take them as is.

NaN is written as null. Times are the clock of the run (simulated or monotonic), never the date.
"""

import json
from typing import Any, Final

FORMAT: Final = 1
"""Counted up when a topic changes its meaning."""
Json = dict[str, Any]


def _of(kind: str, description: str) -> Json:
    return {"type": kind, "description": description}


def _list(description: str, items: str = "number") -> Json:
    return {"type": "array", "items": {"type": [items, "null"]}, "description": description}


def _maybe(description: str) -> Json:
    return {"type": ["number", "null"], "description": description}


_TIME = _of("number", "clock of the run, s")
TOPICS: Final[dict[str, Json]] = {
    "/config": {
        "format": _of("integer", "version of this format"),
        "software": _of("string", "snakewalk's version"),
        "backend": _of("string", "'sim', or the serial port of the metal"),
        "config_hash": _of("string", "digest of run, robot and world"),
        "seed": _of("integer", "of every random choice"),
        "run": _of("object", "RunConfig"),
        "robot": _of("object", "RobotConfig"),
        "world": _of("object", "WorldConfig"),
        "torque_constant_n_m_a": _maybe("at the output shaft"),
        "winding": {"type": ["object", "null"], "description": "resistance_ohm, back_emf_v_s"},
        "laid": {"type": ["object", "null"], "description": "heading_rad of the head, joint_rad"},
        "plan": _of("object", "path_m, waypoints_m, waypoint_radius_m, predicted_speed_m_s, ..."),
        "ground": {"type": ["object", "null"], "description": "thinned height field; null: flat"},
    },
    "/cycle": {
        "time_s": _TIME,
        "asked_rad": _list("(J,) what the motion wanted, exact"),
        "sent_rad": _list("(J,) what safety let through, exact"),
        "yield_rad": {"type": ["array", "null"], "description": "(J,) by compliance, in asked_rad"},
        "measured_rad": _list("(J,)"),
        "velocity_rad_s": _list("(J,)"),
        "current_a": _list("(J,)"),
        "age_s": _list("(J,) since last read"),
        "valid": _list("(J,) whether this cycle's read succeeded", "boolean"),
        "error": _list("(J,) error byte of the last status packet", "integer"),
        "deadline_s": _of("number", "when the cycle was due"),
        "lateness_s": _of("number", "how late it began"),
        "wire_busy_s": _maybe("time its bytes took on the wire"),
        "electrical_j": _maybe("taken in by all motors so far; what they give back is lost"),
        "mechanical_j": _maybe("net work at all shafts so far"),
        "verdict": {"enum": ["pass", "clamp", "veto"]},
        "reason": _of("string", "of a clamp or veto"),
        "joints": _list("joints it concerns", "integer"),
    },
    "/slow": {
        "time_s": _TIME,
        "temperature_c": _list("(J,)"),
        "voltage_v": _list("(J,)"),
        "hardware_error": _list("(J,) register 70", "integer"),
    },
    "/shadow": {
        "time_s": _TIME,
        "position_rad": _list("(J,) of a simulated chain that gets the same goals"),
        "current_a": _list("(J,) of it"),
    },
    "/imu": {
        "time_s": _TIME,
        "rotation": _list("(9,) rows of the rotation matrix of the link of the IMU; any heading"),
        "rate_rad_s": _list("(3,) about the link's forward, left and up axes"),
        "age_s": _of("number", "since it was measured"),
    },
    "/pose": {
        "time_s": _TIME,
        "head_m": _list("(3,) centre of the head link in the world"),
        "rotation": _list("(9,) rows of the rotation matrix of the head link"),
        "links_m": {"type": ["array", "null"], "description": "(L, 3) centres of the links"},
        "centre_m": _list("(3,) centre of mass"),
        "speed_m_s": _maybe("forward speed of the links, mean over the body"),
        "predicted_speed_m_s": _maybe("by the velocity model"),
        "pulse_m_s": _maybe("speed u at which the shape travels along the body"),
        "path_s_m": _maybe("arc length reached on the path"),
        "target": _of("integer", "index of the next waypoint"),
    },
    "/path": {"time_s": _TIME, "points_m": _of("array", "(n, 2 or 3) a path laid again")},
    "/waypoints": {
        "time_s": _TIME,
        "waypoints_m": _of("array", "(w, 2) in force from now on, those reached first"),
    },
    "/walk": {
        "time_s": _TIME,
        "state": _of("integer", "index into the library"),
        "visited": _of("integer", "distinct states so far"),
        "heading_error_rad": _maybe("before the ramp"),
        "ramp_rad": _maybe("bend added to cancel it"),
        "candidates": _of("integer", "states within the heading tolerance"),
        "eta_q": _maybe("quasi-static gain of the state"),
    },
    "/friction": {
        "time_s": _TIME,
        "along": _of("number", "friction along the body, forward, as found so far"),
        "across": _of("number", "across it"),
        "along_95": _list("(2,) interval of 95 %"),
        "across_95": _list("(2,)"),
    },
    "/event": {
        "time_s": _TIME,
        "level": {"enum": ["info", "warning", "error"]},
        "kind": _of("string", "start, stop, waypoint, trip, alarm, fallback, ..."),
        "text": _of("string", "for people"),
    },
    "/qpos": {"time_s": _TIME, "qpos": _list("generalised position of the simulation")},
}


def schema_name(topic: str) -> str:
    """Name under which a topic's schema is registered."""
    return f"snakewalk.{topic[1:].capitalize()}"


def schema_json(topic: str) -> bytes:
    """JSON schema (draft 7) of a topic."""
    return json.dumps(
        {"title": schema_name(topic), "type": "object", "properties": TOPICS[topic]},
        separators=(",", ":"),
    ).encode()
