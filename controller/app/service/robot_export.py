"""A robot for other programs: URDF and MJCF text with the masses and the kinematics of ours."""

from xml.etree import ElementTree as ET

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig


def urdf_text(robot: RobotConfig) -> str:
    """URDF of a robot; link 0 is the head, whose frame is its centre; x forward, z up.

    Joint j turns what is behind it, so the axis of a yaw joint points down: a positive angle bends
    the head side to the left. Inertia is a solid cylinder's.

    Raises:
        InputError: the robot has legs.

    """
    if robot.limbs:
        raise InputError(f"{robot.name}: has legs; a URDF is written of a chain only: give --mjcf")
    root = ET.Element("robot", name=robot.name)
    rows = zip(robot.link_lengths_m, robot.link_radii_m, robot.link_masses_kg, strict=True)
    for link, (length, radius, mass) in enumerate(rows):
        across = mass * (3.0 * radius**2 + length**2) / 12.0
        centre = f"{0.0 if link == 0 else -0.5 * length!r} 0 0"
        body = ET.SubElement(root, "link", name=f"link{link}")
        inertial = ET.SubElement(body, "inertial")
        ET.SubElement(inertial, "origin", xyz=centre, rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=repr(mass))
        ET.SubElement(
            inertial,
            "inertia",
            ixx=repr(0.5 * mass * radius**2),
            iyy=repr(across),
            izz=repr(across),
            ixy="0",
            ixz="0",
            iyz="0",
        )
        for kind in ("visual", "collision") if length else ():
            shape = ET.SubElement(body, kind)
            ET.SubElement(shape, "origin", xyz=centre, rpy="0 1.5707963267948966 0")
            geometry = ET.SubElement(shape, "geometry")
            ET.SubElement(geometry, "cylinder", radius=repr(radius), length=repr(length))
    for joint, axis in enumerate(robot.joint_axes):
        limit = robot.limit_rad[joint]
        back = -(0.5 if joint == 0 else 1.0) * robot.link_lengths_m[joint]
        hinge = ET.SubElement(root, "joint", name=f"joint{joint}", type="revolute")
        ET.SubElement(hinge, "origin", xyz=f"{back!r} 0 0", rpy="0 0 0")
        ET.SubElement(hinge, "parent", link=f"link{joint}")
        ET.SubElement(hinge, "child", link=f"link{joint + 1}")
        ET.SubElement(hinge, "axis", xyz="0 0 -1" if axis == "y" else "0 1 0")
        ET.SubElement(
            hinge,
            "limit",
            lower=repr(-limit),
            upper=repr(limit),
            effort=repr(robot.torque_limit_n_m),
            velocity=repr(robot.joint_speed_limit_rad_s),
        )
        ET.SubElement(hinge, "dynamics", damping=repr(robot.gear_drags_n_m_s[joint]), friction="0")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def mjcf_text(robot: RobotConfig) -> str:
    """MuJoCo model of a robot on a level floor, as the simulator builds it.

    Its contacts have no friction: the simulator adds its own, which knows a direction along the
    body.
    """
    from snakewalk.sim.physics.body import mjcf  # noqa: PLC0415  an extra
    from snakewalk.sim.physics.plant import FLOOR_STEP_S  # noqa: PLC0415

    return mjcf(robot, WorldConfig(name="floor"), None, FLOOR_STEP_S) + "\n"
