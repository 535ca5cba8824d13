"""A robot for other programs: URDF and MJCF text with the masses and the kinematics of ours."""

import math
from collections.abc import Mapping
from typing import Literal
from xml.etree import ElementTree as ET

from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig, WorldConfig
from snakewalk.sim.servo.motor import gears_of, motors_of, p_gain_per_rad

Ros2Control = Literal["topic", "dynamixel"]
"""Hardware that ros2_control drives: our ROS node, or the servos themselves."""
Actuators = Literal["dcmotor"]
"""MuJoCo's actuators that stand for the servos."""
Contact = Literal["rollers", "isotropic", "none"]
"""Friction of an exported body."""
CONTACT_NOTES: dict[Contact, str] = {
    "rollers": "friction: a passive roller under each link, 1.06 to 1.22 of the speed in snakewalk",
    "isotropic": "friction: equal in all directions, 0.00 to 1.19 of the speed in snakewalk",
    "none": "friction: none, 0.00 to 0.01 of the speed in snakewalk",
}
"""Remaining difference of the friction, measured by ``benchmarks.exported_body``."""
_ROLLER_OUT_M = 5e-4
"""Distance by which a roller stands out of the belly (ours)."""
_ROLLER_SHARE = 0.01
"""Share of a link's mass that its roller has (ours)."""
_DEVICE = "/dev/ttyUSB0"
_POSITION_MODE = 3


def urdf_text(robot: RobotConfig, ros2_control: Ros2Control | None = None) -> str:
    """URDF of a robot; link 0 is the head, whose frame is its centre; x forward, z up.

    Joint j turns what is behind it, so the axis of a yaw joint points down: a positive angle bends
    the head side to the left. Inertia is a solid cylinder's.

    With ``ros2_control`` it has that tag as well.

    Raises:
        InputError: the robot has legs, or what the tag cannot say.

    """
    if robot.limbs:
        raise InputError(f"{robot.name}: has legs; a URDF is written of a chain only: give --mjcf")
    root = ET.Element("robot", name=robot.name)
    rows = zip(robot.link_lengths_m, robot.link_radii_m, robot.link_masses_kg, strict=True)
    for link, sizes in enumerate(rows):
        root.append(ET.fromstring(_link_text(link, *sizes)))
    for joint in range(len(robot.joint_axes)):
        root.append(ET.fromstring(_joint_text(robot, joint)))
    if ros2_control is not None:
        _add_ros2_control(root, robot, ros2_control)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _link_text(link: int, length_m: float, radius_m: float, mass_kg: float) -> str:
    across = mass_kg * (3.0 * radius_m**2 + length_m**2) / 12.0
    centre = f"{0.0 if link == 0 else -0.5 * length_m!r} 0 0"
    shape = f"""
        <origin xyz="{centre}" rpy="0 1.5707963267948966 0"/>
        <geometry><cylinder radius="{radius_m!r}" length="{length_m!r}"/></geometry>"""
    shapes = f"<visual>{shape}</visual><collision>{shape}</collision>" if length_m else ""
    return f"""
        <link name="link{link}">
          <inertial>
            <origin xyz="{centre}" rpy="0 0 0"/>
            <mass value="{mass_kg!r}"/>
            <inertia ixx="{0.5 * mass_kg * radius_m**2!r}" iyy="{across!r}" izz="{across!r}"
                     ixy="0" ixz="0" iyz="0"/>
          </inertial>
          {shapes}
        </link>"""


def _joint_text(robot: RobotConfig, joint: int) -> str:
    limit = robot.limit_rad[joint]
    back = -(0.5 if joint == 0 else 1.0) * robot.link_lengths_m[joint]
    axis = "0 0 -1" if robot.joint_axes[joint] == "y" else "0 1 0"
    return f"""
        <joint name="{robot.joint_names[joint]}" type="revolute">
          <origin xyz="{back!r} 0 0" rpy="0 0 0"/>
          <parent link="link{joint}"/>
          <child link="link{joint + 1}"/>
          <axis xyz="{axis}"/>
          <limit lower="{-limit!r}" upper="{limit!r}" effort="{robot.torque_limit_n_m!r}"
                 velocity="{robot.joint_speed_limit_rad_s!r}"/>
          <dynamics damping="{robot.gear_drags_n_m_s[joint]!r}" friction="0"/>
        </joint>"""


def _add_ros2_control(root: ET.Element, robot: RobotConfig, kind: Ros2Control) -> None:
    """Add the tag ``ros2_control`` to a URDF."""
    system = ET.SubElement(root, "ros2_control", name=robot.name, type="system")
    hardware = ET.SubElement(system, "hardware")
    plugin = ET.SubElement(hardware, "plugin")
    if kind == "topic":
        plugin.text = "joint_state_topic_hardware_interface/JointStateTopicSystem"
        topics = {
            "joint_commands_topic": "/robot_joint_command",
            "joint_states_topic": "/robot_joint_states",
        }
        _add_params(hardware, topics)
    else:
        plugin.text = "dynamixel_hardware_interface/DynamixelHardware"
        _add_params(hardware, _dynamixel_params(robot))
    for joint in range(len(robot.limit_rad)):
        system.append(ET.fromstring(_interfaces_text(robot, joint)))
        if kind != "topic":
            system.append(ET.fromstring(_servo_text(robot, joint)))


def _interfaces_text(robot: RobotConfig, joint: int) -> str:
    limit = robot.limit_rad[joint]
    senses = robot.servo_records[joint].measures_current
    return f"""
        <joint name="{robot.joint_names[joint]}">
          <command_interface name="position">
            <param name="min">{-limit!r}</param>
            <param name="max">{limit!r}</param>
          </command_interface>
          <state_interface name="position"/>
          <state_interface name="velocity"/>
          {'<state_interface name="effort"/>' if senses else ""}
        </joint>"""


def _servo_text(robot: RobotConfig, joint: int) -> str:
    number = robot.servo_ids[joint]
    senses = robot.servo_records[joint].measures_current
    return f"""
        <gpio name="dxl{number}">
          <param name="type">dxl</param>
          <param name="ID">{number}</param>
          <command_interface name="Goal Position"/>
          <state_interface name="Present Position"/>
          <state_interface name="Present Velocity"/>
          {'<state_interface name="Present Current"/>' if senses else ""}
          <param name="Operating Mode">{_POSITION_MODE}</param>
          <param name="Position P Gain">{robot.position_p_gains[joint]}</param>
        </gpio>"""


def _dynamixel_params(robot: RobotConfig) -> dict[str, str]:
    """Parameters of ROBOTIS's plugin; it knows signs of joints, but no zero of theirs.

    Raises:
        InputError: the robot has zeros, or several ports.

    """
    for joint, zero in enumerate(robot.zeros_rad):
        if zero:
            raise InputError(
                f"{robot.name}: {robot.joint_label(joint)} has zero_rad {zero:g}, which "
                "dynamixel_hardware_interface does not know: write it into Homing Offset "
                "(snakewalk bus calibrate), or give --ros2-control topic"
            )
    if len(robot.ports) > 1:
        raise InputError(
            f"{robot.name}: its segments are on {len(robot.ports)} ports; "
            "dynamixel_hardware_interface drives one: give --ros2-control topic"
        )
    count = robot.joint_count
    signs = [[robot.signs[j] if j == k else 0 for k in range(count)] for j in range(count)]
    matrix = ", ".join(str(value) for row in signs for value in row)
    return {
        "port_name": robot.ports[0].port if robot.ports else _DEVICE,
        "baud_rate": str(robot.servo.baud),
        "dynamixel_model_folder": "/param/dxl_model",
        "number_of_joints": str(count),
        "number_of_transmissions": str(count),
        "disable_torque_at_init": "true",
        "error_timeout_ms": "500",
        "transmission_to_joint_matrix": matrix,
        "joint_to_transmission_matrix": matrix,
        "dynamixel_state_pub_msg_name": "dynamixel_hardware_interface/dxl_state",
        "get_dynamixel_data_srv_name": "dynamixel_hardware_interface/get_dxl_data",
        "set_dynamixel_data_srv_name": "dynamixel_hardware_interface/set_dxl_data",
        "reboot_dxl_srv_name": "dynamixel_hardware_interface/reboot_dxl",
        "set_dxl_torque_srv_name": "dynamixel_hardware_interface/set_dxl_torque",
    }


def _add_params(parent: ET.Element, values: Mapping[str, str]) -> None:
    for name, value in values.items():
        ET.SubElement(parent, "param", name=name).text = value


def mjcf_text(
    robot: RobotConfig, actuators: Actuators | None = None, contact: Contact = "rollers"
) -> str:
    """MuJoCo model of a robot on a level floor, as the simulator builds it.

    MuJoCo's friction cone has no direction along a body, and the simulator adds its own friction.
    The model has instead, with the coefficients of the default world:

    - ``rollers``: a passive ball under each link, which rolls along the link and slips across it;
    - ``isotropic``: bellies with the friction across the body in all directions;
    - ``none``: bellies without friction.

    With ``actuators`` each joint has one, whose control is the goal position in rad.

    Raises:
        InputError: the installed MuJoCo does not have these actuators, or a servo has no motor
            constants.

    """
    from snakewalk.sim.physics import body, plant  # noqa: PLC0415  an extra

    world = WorldConfig(name="floor")
    root = ET.fromstring(body.mjcf(robot, world, None, plant.FLOOR_STEP_S))  # our own text
    limits = dict(zip(robot.joint_names, robot.limit_rad, strict=True))
    for joint in root.iter("joint"):  # the simulator's stops are beyond the limits
        if (name := joint.get("name")) in limits:
            joint.set("range", f"{-limits[name]!r} {limits[name]!r}")
    _add_friction(root, robot, world.friction, contact)
    if actuators is not None:
        _add_dc_motors(root, robot)
    ET.indent(root)
    text = f"<!-- {CONTACT_NOTES[contact]} -->\n{ET.tostring(root, encoding='unicode')}\n"
    fault = body.load_fault(text) if actuators is not None else None
    if fault is not None:
        raise InputError(
            f"--actuators dcmotor: {fault}; install mujoco 3.17 or newer, or remove the option"
        )
    return text


def _add_friction(
    root: ET.Element, robot: RobotConfig, friction: FrictionConfig, contact: Contact
) -> None:
    """Give the model contacts with friction; the simulator's own have none."""
    if contact == "none":
        return
    for option in root.iter("option"):
        option.attrib.update({"cone": "elliptic", "impratio": "10"})
    grip = {"condim": "3", "friction": f"{friction.across!r} 0.005 0.0001"}
    if contact == "isotropic":
        for geom in root.iter("geom"):
            if geom.get("name", "").startswith("belly"):
                geom.attrib.update(grip)
        return
    bodies = {body.get("name"): body for body in root.iter("body")}
    rows = zip(
        robot.link_lengths_m,
        robot.link_radii_m,
        robot.link_masses_kg,
        robot.link_shapes,
        strict=True,
    )
    for link, (length_m, belly_m, mass_kg, shape) in enumerate(rows):
        if shape == "none":
            continue
        radius_m = belly_m + _ROLLER_OUT_M
        roller_kg = _ROLLER_SHARE * mass_kg
        for inertial in bodies[f"link{link}"].findall("inertial"):
            inertial.set("mass", repr(float(inertial.get("mass", "0")) - roller_kg))
        place = f"{0.0 if link == 0 else -0.5 * length_m!r} 0 0"
        roller = ET.SubElement(bodies[f"link{link}"], "body", name=f"roller{link}", pos=place)
        hinge = ET.SubElement(roller, "joint", name=f"roller{link}", axis="0 1 0")
        hinge.set("frictionloss", repr(friction.along * mass_kg * GRAVITY_M_S2 * radius_m))
        ball = ET.SubElement(roller, "geom", type="sphere", size=repr(radius_m))
        ball.attrib.update(grip | {"mass": repr(roller_kg), "contype": "0", "conaffinity": "1"})


def _add_dc_motors(root: ET.Element, robot: RobotConfig) -> None:
    """Add a ``dcmotor`` for each joint: the law of ``sim.plant.ServoDrive`` in MuJoCo's terms.

    MuJoCo has one constant K for torque and back-EMF, and a controller in N m/rad that compensates
    the back-EMF. With K = sqrt(k_t k_e), voltages times k_t / K and a derivative gain of
    k_t k_e / R, its torque is that of a servo whose volts are proportional to the error.
    """
    hinges = {joint.get("name"): joint for joint in root.iter("joint")}
    parent = ET.SubElement(root, "actuator")
    rows = zip(
        robot.joint_names,
        motors_of(robot),
        gears_of(robot),
        robot.position_p_gains,
        robot.current_limits_a,
        strict=True,
    )
    for name, motor, gear, gain, limit_a in rows:
        k_t = motor.torque_constant_n_m_a
        k_e = motor.back_emf_v_s
        ohm = motor.resistance_ohm
        constant = math.sqrt(k_t * k_e)
        most_v = robot.servo.supply_v * k_t / constant
        stiff = float(p_gain_per_rad(gain, motor)) * robot.servo.supply_v * k_t / ohm
        motor_element = ET.SubElement(parent, "dcmotor", name=name, joint=name, input="pos")
        motor_element.set("motorconst", f"{constant!r} {constant!r}")
        motor_element.set("resistance", repr(ohm))
        motor_element.set("controller", f"{stiff!r} 0 {k_t * k_e / ohm!r} 0 0 {most_v!r}")
        if math.isfinite(limit_a):
            motor_element.set("saturation", f"{k_t * limit_a!r} 0 0")
        hinges[name].set("damping", repr(float(gear.viscous_n_m_s)))
        if gear.dry_n_m:
            hinges[name].set("frictionloss", repr(float(gear.dry_n_m)))
