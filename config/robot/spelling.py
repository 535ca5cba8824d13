"""The canonical spelling of a robot: files of the same robot give equal configurations.

The most frequent value of links or joints becomes the key of the chain; only different ones keep
their own. So a command cannot depend on the spelling of a file.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from snakewalk.config.joint_names import default_joint_names
from snakewalk.config.robot.joint_values import JointValues
from snakewalk.config.robot.joints import JointConfig
from snakewalk.config.robot.limbs import LimbsConfig
from snakewalk.config.robot.links import BellyConfig, LinkConfig
from snakewalk.config.robot.servo import LAST_ID

V = TypeVar("V", float, int, str)

_OF_EVERY_JOINT = {
    "position_i_gain": "position_i_gains",
    "position_d_gain": "position_d_gains",
    "armature_kg_m2": "armatures_kg_m2",
    "gear_drag_n_m_s": "gear_drags_n_m_s",
}
"""Keys of `[servo]` that hold for all joints, and the property with the value of each."""


def canonical_links(robot: JointValues) -> dict[str, Any]:
    """Canonical keys of the links."""
    if not robot.links:
        return {}
    lengths_m = robot.link_lengths_m
    masses_kg = robot.bare_link_masses_kg
    radii_m = robot.link_radii_m
    length_m = _commonest(length for length in lengths_m if length > 0.0)
    mass_kg = _commonest(masses_kg)
    radius_m = max(radii_m)
    belly = _belly(robot)
    links = []
    for length, mass, radius, shape in zip(
        lengths_m, masses_kg, radii_m, robot.link_shapes, strict=True
    ):
        usual = "none" if length == 0.0 else belly.shape
        links.append(
            LinkConfig(
                length_m=None if length == length_m else length,
                mass_kg=None if mass == mass_kg else mass,
                radius_m=None if radius == radius_m else radius,
                shape=None if shape == usual else shape,
            )
        )
    return {
        "links": () if all(link == LinkConfig() for link in links) else tuple(links),
        "link_length_m": length_m,
        "link_mass_kg": mass_kg,
        "body_radius_m": radius_m,
        "belly": belly,
    }


def canonical_joints(robot: JointValues) -> dict[str, Any]:
    """Canonical keys of the joints."""
    if not robot.joints:
        return {}
    axes = robot.all_axes
    spine = len(robot.joint_axes)
    usual = default_joint_names(axes, [limb_joint.side for limb_joint in robot.limb_joints])
    rows: list[dict[str, Any]] = [
        {"sign": sign, "zero_rad": zero_rad, "name": None if name == default else name}
        for sign, zero_rad, name, default in zip(
            robot.signs, robot.zeros_rad, robot.joint_names, usual, strict=True
        )
    ]
    pitch = [k for k, axis in enumerate(axes) if axis == "p"]
    others = [k for k, axis in enumerate(axes) if axis != "p"]
    servo: dict[str, Any] = _servo(robot, rows)
    for key, name in _OF_EVERY_JOINT.items():
        servo |= _fold(rows, range(len(rows)), key, getattr(robot, name), key)
    gains = robot.position_p_gains
    currents_a = robot.current_limits_a
    servo |= _fold(rows, others, "position_p_gain", gains, "position_p_gain")
    servo |= _fold(rows, pitch, "position_p_gain", gains, "pitch_p_gain")
    servo |= _fold(rows, pitch, "current_limit_a", currents_a, "pitch_current_limit_a")
    keys: dict[str, Any] = {}
    for axis, name in (("y", "yaw_limit_rad"), ("p", "pitch_limit_rad")):
        group = [k for k in range(spine) if axes[k] == axis]
        keys |= _fold(rows, group, "limit_rad", robot.limit_rad, name)
    limbs = _limbs(robot, rows)
    joints = tuple(JointConfig(**row) for row in rows)
    return keys | {
        "limbs": limbs,
        "servo": robot.servo.model_copy(update=servo),
        "joints": () if all(joint == JointConfig() for joint in joints) else joints,
    }


def _belly(robot: JointValues) -> BellyConfig:
    """Rails if any link has them, else the commonest shape."""
    shapes = [shape for shape in robot.link_shapes if shape != "none"]
    if "rails" in shapes:
        return robot.belly
    return BellyConfig(shape=_commonest(shapes)) if shapes else BellyConfig()


def _servo(robot: JointValues, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Fold IDs and models; motor constants are those of the model of `[servo]` only."""
    ids = robot.servo_ids
    models = robot.servo_models
    first = _commonest(i - k for k, i in enumerate(ids) if 0 <= i - k <= LAST_ID)
    model = robot.servo.model
    motor = robot.servo.motor
    if motor is None or model not in models:
        model = _commonest(models)
        motor = None
    for k, row in enumerate(rows):
        row["id"] = None if ids[k] == first + k else ids[k]
        row["model"] = None if models[k] == model else models[k]
    return {"first_id": first, "model": model, "motor": motor}


def _limbs(robot: JointValues, rows: list[dict[str, Any]]) -> tuple[LimbsConfig, ...]:
    """Fold the limits of the legs' joints into their pairs."""
    pairs = []
    spine = len(robot.joint_axes)
    for index, pair in enumerate(robot.limbs):
        changes: dict[str, Any] = {}
        for axis, name in (("y", "yaw_limit_rad"), ("r", "roll_limit_rad")):
            group = [
                spine + k
                for k, joint in enumerate(robot.limb_joints)
                if joint.pair == index and pair.joint_axes[joint.place] == axis
            ]
            changes |= _fold(rows, group, "limit_rad", robot.limit_rad, name)
        pairs.append(pair.model_copy(update=changes))
    return tuple(pairs)


def _fold(
    rows: list[dict[str, Any]],
    group: Iterable[int],
    key: str,
    values: tuple[V, ...],
    name: str,
) -> Mapping[str, V]:
    """Write ``key`` into the differing rows of a group; return the common value."""
    joints = list(group)
    if not joints:
        return {}
    usual = _commonest(values[k] for k in joints)
    for k in joints:
        rows[k][key] = None if values[k] == usual else values[k]
    return {name: usual}


def _commonest(values: Iterable[V]) -> V:
    return Counter(values).most_common(1)[0][0]
