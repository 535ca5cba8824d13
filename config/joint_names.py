"""Names of joints, and their labels in messages.

A name identifies one joint in messages, tables, ROS, URDF and MJCF. Names follow ROS: letters,
digits and underscores, a letter first.
"""

from collections.abc import Sequence

JOINT_NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_]*$"
_AXES = {"y": "yaw", "p": "pitch", "r": "roll"}


def default_joint_names(axes: str, sides: Sequence[str]) -> tuple[str, ...]:
    """Names such as ``yaw_03`` or ``left_roll_12``: axis, and place from 1 at the head.

    ``sides`` are the legs' sides of the last joints.
    """
    digits = max(2, len(str(len(axes))))
    spine = len(axes) - len(sides)
    prefixes = [""] * spine + [f"{side}_" for side in sides]
    return tuple(
        f"{prefix}{_AXES[axis]}_{place:0{digits}d}"
        for place, (prefix, axis) in enumerate(zip(prefixes, axes, strict=True), 1)
    )


def numbered_joint_names(count: int) -> tuple[str, ...]:
    """Names that a ROS graph may also use; ``joint0`` is next to the head."""
    return tuple(f"joint{k}" for k in range(count))


def joint_label(name: str, servo_id: int, port: str | None = None) -> str:
    """Label of a joint in messages: name and servo ID, and the port if there are several."""
    on = "" if port is None else f" on {port}"
    return f"joint {name} (ID {servo_id}{on})"
