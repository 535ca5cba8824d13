"""What the robot is: links, joints and servos of one chain, head first."""

import math
from collections import Counter
from collections.abc import Mapping
from functools import cache
from itertools import accumulate, pairwise
from typing import Literal, NamedTuple, Self, TypeVar

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from snakewalk.config.base import Name, Strict
from snakewalk.config.camera import StereoHeadConfig
from snakewalk.config.joint_names import JOINT_NAME_PATTERN, default_joint_names, joint_label
from snakewalk.config.motor import MotorConfig

N = TypeVar("N", int, float, str)
Baud = Literal[9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000]
STALL_CURRENT_A: Mapping[str, float] = {
    "XL330-M077": 1.47,
    "XL330-M288": 1.47,
    "XC330-M181": 1.8,
    "XC330-M288": 1.8,
    "XC330-T181": 0.8,
    "XC330-T288": 0.8,
    "XL430-W250": 1.3,
    "2XL430-W250": 1.3,
    "XH430-W210": 1.3,
    "XH430-W350": 1.3,
    "XD430-T210": 1.3,
    "XD430-T350": 1.3,
    "XW430-T333": 1.3,
    "XC430-W150": 1.4,
    "XC430-W240": 1.4,
    "2XC430-W250": 1.4,
    "XM430-W210": 2.3,
    "XM430-W350": 2.3,
    "XH430-V210": 0.7,
    "XH430-V350": 0.7,
    "XM540-W150": 4.4,
    "XM540-W270": 4.4,
    "XH540-W150": 4.9,
    "XH540-W270": 4.9,
    "XD540-T150": 4.9,
    "XD540-T270": 4.9,
    "XW540-T140": 4.9,
    "XW540-T260": 4.9,
    "XH540-V150": 2.4,
    "XH540-V270": 2.4,
    "XW540-H260": 2.4,
}
"""What a servo draws when it is held fast at its recommended voltage: the e-manual's page of each
model of the X series, "Specifications"; XD models as their XH twins."""
_LIMIT_SHARE = 2.0 / 2.3
"""Of the stall current, up to which a run goes on (ours): 2 A of an XM430."""
LAST_ID = 252
SIMULATED = "sim"
"""The port of servos that are simulated while the others of the chain are real."""
_PROTOCOL_1 = ("AX-", "RX-", "EX-", "DX-")


class ServoConfig(Strict):
    """One servo type, the same along the chain."""

    model: str = Field("XM430-W350", description="name as printed on the servo")
    first_id: int = Field(1, ge=0, le=LAST_ID, description="ID of the joint next to the head")
    baud: Baud = 1_000_000
    supply_v: float = Field(12.0, ge=3.0, le=26.0)
    supply_min_v: float | None = Field(
        None, gt=0.0, description="a run stops below; default: 10/12 of supply_v"
    )
    supply_max_v: float | None = Field(
        None, gt=0.0, description="a run stops above; default: 14.8/12 of supply_v"
    )
    over_current_a: float | None = Field(
        None, gt=0.0, description="a run stops above; default: 20/23 of the model's stall current"
    )
    position_p_gain: int = Field(800, ge=0, le=16383, description="register 84")
    position_i_gain: int = Field(0, ge=0, le=16383, description="register 82")
    position_d_gain: int = Field(0, ge=0, le=16383, description="register 80")
    pitch_p_gain: int = Field(
        400, ge=0, le=16383, description="register 84 of the pitch joints: softer follows ground"
    )
    pitch_lead_s: float = Field(
        0.25, ge=0.0, le=2.0, description="how early pitch goals are sent: filter and servo lag"
    )
    pitch_current_limit_a: float = Field(
        0.1, gt=0.0, description="goal current of the pitch joints: current-based position mode"
    )
    armature_kg_m2: float = Field(
        0.045, ge=0.0, le=1.0, description="inertia of rotor and gears at the shaft, in simulation"
    )
    gear_drag_n_m_s: float = Field(
        0.03, ge=0.0, le=10.0, description="viscous loss of the gears at the shaft, in simulation"
    )
    motor: MotorConfig | None = Field(
        None,
        description="a table [servo.motor]; default: the catalogue's constants, and no friction",
    )

    @model_validator(mode="after")
    def _supply_is_within_its_limits(self) -> Self:
        low_v, high_v = self.supply_limits_v
        if not low_v <= self.supply_v <= high_v:
            raise ValueError(
                f"supply_v = {self.supply_v:g} is not within supply_min_v = {low_v:g} and "
                f"supply_max_v = {high_v:g}"
            )
        return self

    @property
    def supply_limits_v(self) -> tuple[float, float]:
        """Least and greatest supply of a run that gives none of its own."""
        low_v, high_v = self.supply_min_v, self.supply_max_v
        return (
            self.supply_v * 10.0 / 12.0 if low_v is None else low_v,
            self.supply_v * 14.8 / 12.0 if high_v is None else high_v,
        )


class BellyConfig(Strict):
    """What of a link meets the ground: a ball, a capsule along it, or two capsules as rails."""

    shape: Literal["ball", "capsule", "rails"] = "capsule"
    width_m: float | None = Field(
        None, gt=0.002, le=1.0, description="of rails, from outside to outside"
    )

    @model_validator(mode="after")
    def _rails_are_wide(self) -> Self:
        if self.shape == "rails" and self.width_m is None:
            raise ValueError("width_m: rails need their width")
        if self.shape != "rails" and self.width_m is not None:
            raise ValueError(
                f"width_m is of rails; a {self.shape} is as wide as body_radius_m says"
            )
        return self


LinkShape = Literal["ball", "capsule", "rails", "none"]


class LinkConfig(Strict):
    """What one link has of its own, `[[links]]` from the head; the rest is the chain's."""

    length_m: float | None = Field(
        None,
        ge=0.0,
        le=1.0,
        description="joint axis to joint axis, 0 between the two axes of a two-axis module; of the "
        "head and the tail, to the tip; default: link_length_m",
    )
    mass_kg: float | None = Field(None, gt=0.0001, le=20.0, description="default: link_mass_kg")
    radius_m: float | None = Field(None, gt=0.002, le=0.5, description="default: body_radius_m")
    shape: LinkShape | None = Field(
        None,
        description="what of it meets the ground; default: belly.shape, of a link of no length "
        "none",
    )

    @model_validator(mode="after")
    def _is_as_long_as_its_shape(self) -> Self:
        if self.length_m is not None and 0.0 < self.length_m <= 0.005:
            raise ValueError("length_m: 0, or over 0.005")
        if self.length_m == 0.0 and self.shape in ("capsule", "rails"):
            raise ValueError(f"shape: a {self.shape} needs a length; ball or none")
        return self


class JointConfig(Strict):
    """What one joint has of its own, `[[joints]]` from the head; the rest is the chain's."""

    name: str | None = Field(
        None,
        max_length=60,
        pattern=JOINT_NAME_PATTERN,
        description="in messages, tables and ROS: letters, digits and _; default: axis and place "
        "from the head, such as yaw_03",
    )
    axis: Literal["y", "p"] | None = Field(
        None, description="y = yaw, p = pitch; in every joint, unless joint_axes says it"
    )
    id: int | None = Field(
        None, ge=0, le=LAST_ID, description="of its servo; default: counted from servo.first_id"
    )
    model: str | None = Field(None, description="default: servo.model")
    sign: Literal[1, -1] = Field(
        1, description="-1: its servo is mounted the other way round, and counts backwards"
    )
    zero_rad: float = Field(
        0.0,
        ge=-math.pi,
        le=math.pi,
        description="where its servo stands, from its own zero, when the joint is straight; taken "
        "to the nearest position that the servo knows",
    )
    limit_rad: float | None = Field(
        None, gt=0.05, le=3.1, description="default: yaw_limit_rad or pitch_limit_rad"
    )
    position_p_gain: int | None = Field(
        None, ge=0, le=16383, description="default: servo.position_p_gain or servo.pitch_p_gain"
    )
    position_i_gain: int | None = Field(
        None, ge=0, le=16383, description="default: servo.position_i_gain"
    )
    position_d_gain: int | None = Field(
        None, ge=0, le=16383, description="default: servo.position_d_gain"
    )
    current_limit_a: float | None = Field(
        None, gt=0.0, description="of a pitch joint; default: servo.pitch_current_limit_a"
    )
    armature_kg_m2: float | None = Field(
        None, ge=0.0, le=1.0, description="default: servo.armature_kg_m2"
    )
    gear_drag_n_m_s: float | None = Field(
        None, ge=0.0, le=10.0, description="default: servo.gear_drag_n_m_s"
    )

    @model_serializer(mode="wrap")
    def _without_a_default_name(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Leave out a name that is not set: the configuration in a log keeps its bytes."""
        keys: dict[str, object] = handler(self)
        if self.name is None:
            keys.pop("name", None)
        return keys


ImuModel = Literal["imu_to_dxl", "FFW-G40-IMU"]
Degrees3 = tuple[float, float, float]


class ImuConfig(Strict):
    """An IMU on the bus of the servos, in a link of the spine (docs/imu.md).

    The noise and the bias are those of the simulated device; on servos they are what they are.
    """

    model: ImuModel = Field("imu_to_dxl", description="which of the two public tables it has")
    id: int = Field(200, ge=0, le=LAST_ID, description="its ID on the bus")
    link: int = Field(0, ge=0, description="of the spine, in which it sits; 0 is the head")
    mounting_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0),
        description="roll, pitch and yaw of its axes in the link's (forward, left, up), turned "
        "about the link's axes in this order",
    )
    gyro_range_dps: float | None = Field(
        None,
        gt=0.0,
        le=4000.0,
        description="rate of 32768 counts; required for FFW-G40-IMU, whose table leaves it open",
    )
    acceleration_range_g: float | None = Field(
        None,
        gt=0.0,
        le=64.0,
        description="acceleration of 32768 counts; required for FFW-G40-IMU",
    )
    gyro_bias_dps: float = Field(
        0.1, ge=0.0, le=10.0, description="standard deviation of a constant error, in simulation"
    )
    gyro_noise_dps: float = Field(
        0.05, ge=0.0, le=10.0, description="standard deviation of a reading, in simulation"
    )
    acceleration_noise_m_s2: float = Field(
        0.05, ge=0.0, le=10.0, description="standard deviation of a reading, in simulation"
    )

    @model_validator(mode="after")
    def _ranges_where_they_are_open(self) -> Self:
        ranges = {
            "gyro_range_dps": self.gyro_range_dps,
            "acceleration_range_g": self.acceleration_range_g,
        }
        for key, value in ranges.items():
            if self.model == "imu_to_dxl" and value is not None:
                raise ValueError(f"{key}: an imu_to_dxl has 500 dps, and shows no acceleration")
            if self.model != "imu_to_dxl" and value is None:
                raise ValueError(f"{key}: required for a {self.model}: as its board is set up")
        if not all(map(math.isfinite, self.mounting_deg)):
            raise ValueError("mounting_deg: three finite angles")
        return self


_SIDES: tuple[Literal["left"], Literal["right"]] = ("left", "right")


class PortConfig(Strict):
    """One adapter, and the segment of the chain that is behind it."""

    port: str = Field(
        min_length=1,
        description="a device such as /dev/ttyUSB0, a URL such as socket://host:5000, or sim: "
        "these servos are simulated, beside real ones",
    )
    ids: tuple[int, ...] = Field(
        min_length=1, description="of all servos on it, and of the IMU where it is on it"
    )


class PowerConfig(Strict):
    """Cables from servo to servo, and where leads of the supply end (docs/bus.md)."""

    inject_ids: tuple[int, ...] = Field(
        (), description="servos at which a lead of the supply ends; default: the first of the chain"
    )
    cable_ohm: float = Field(
        0.055,
        gt=0.0,
        le=100.0,
        description="of a cable between neighbours, both conductors and all four contacts: 180 mm "
        "of AWG 21, and contacts of 10 milliohm, the most that new ones have",
    )
    cables_ohm: tuple[float, ...] = Field(
        (), description="of each cable from the head, where they differ"
    )
    lead_ohm: float = Field(
        0.02, gt=0.0, le=100.0, description="of a lead from the supply, there and back"
    )

    @model_validator(mode="after")
    def _resistances_are_positive(self) -> Self:
        if any(not 0.0 < each <= 100.0 for each in self.cables_ohm):
            raise ValueError("cables_ohm: each over 0 and at most 100")
        return self


class LimbsConfig(Strict):
    """A pair of legs at one link of the spine, mirror images: left, then right.

    At zero angles a leg stands straight out to the side. On both sides a positive yaw joint swings
    the leg forward, and a positive roll joint lifts the foot.
    """

    link: int = Field(ge=0, description="of the spine, 0 is the head, at whose middle the legs are")
    joint_axes: str = Field(
        "yr",
        pattern=r"^[yr]{1,4}$",
        description="one letter a servo from the hip: y = yaw (swings), r = roll (lifts)",
    )
    hip_m: float = Field(0.03, ge=0.0, le=1.0, description="first joint beside the spine's axis")
    segments_m: tuple[float, ...] = Field(
        (0.035, 0.09), description="from joint to joint, the last to the middle of the foot"
    )
    segment_mass_kg: float = Field(0.09, gt=0.001, le=20.0)
    foot_radius_m: float = Field(0.012, gt=0.002, le=0.2)
    foot_friction: float = Field(0.8, gt=0.0, le=3.0, description="of rubber, in all directions")
    yaw_limit_rad: float = Field(1.2, gt=0.05, le=3.1)
    roll_limit_rad: float = Field(1.5, gt=0.05, le=3.1)

    @model_validator(mode="after")
    def _a_segment_a_joint(self) -> Self:
        if len(self.segments_m) != len(self.joint_axes):
            raise ValueError(
                f"segments_m: {len(self.joint_axes)} lengths, one a joint, not "
                f"{len(self.segments_m)}"
            )
        if any(not 0.002 < length <= 1.0 for length in self.segments_m):
            raise ValueError("segments_m: lengths over 0.002 and at most 1")
        return self


class LimbJoint(NamedTuple):
    """One joint of a leg; the link behind it has the joint's index plus one."""

    pair: int
    """Index in ``limbs``."""
    side: Literal["left", "right"]
    place: int
    """0 at the hip."""
    has_foot: bool
    """Whether the link behind it ends in the foot."""

    @property
    def outward(self) -> float:
        """Which way along the body's y the leg stands: 1 to the left, -1 to the right."""
        return 1.0 if self.side == "left" else -1.0


@cache
def _joints_about(axes: str, axis: str) -> tuple[int, ...]:
    """Indices of the joints with this axis; kept, for gaits ask in every cycle."""
    return tuple(i for i, other in enumerate(axes) if other == axis)


@cache
def _limb_joints(pairs: tuple[str, ...]) -> tuple[LimbJoint, ...]:
    """Joints of legs that have these axes, a word a pair."""
    return tuple(
        LimbJoint(index, side, place, place == len(axes) - 1)
        for index, axes in enumerate(pairs)
        for side in _SIDES
        for place in range(len(axes))
    )


@cache
def _even_ends(links: int) -> tuple[float, ...]:
    """Ends of links that are all alike, in their own length."""
    return tuple(float(k) for k in range(links + 1))


class RobotConfig(Strict):
    """A chain of links joined by servos, with or without legs; metres, index 0 is the head.

    The joints of the spine come first, head to tail, then those of the legs, pair by pair from the
    tail to the head, left before right and hip before foot: so stand the servos on the bus.
    """

    name: Name
    joint_axes: str = Field(
        "",
        pattern=r"^[yp]*$",
        description="required, unless every joint of `[[joints]]` has its axis: one letter a joint "
        "from the head, y = yaw, p = pitch",
    )
    joints: tuple[JointConfig, ...] = Field(
        (), description="one for each joint, or none: then all are alike"
    )
    links: tuple[LinkConfig, ...] = Field(
        (), description="one for each link of the spine, or none: then all are alike"
    )
    link_length_m: float = Field(0.07, gt=0.005, le=1.0, description="joint axis to joint axis")
    body_radius_m: float = Field(0.03, gt=0.002, le=0.5)
    body_profile: tuple[float, ...] | None = Field(
        None,
        min_length=2,
        max_length=200,
        description="radii over body_radius_m at equal stations, head to tail, each over "
        "0.05 and at most 1; for the look and the ground step (snakewalk body measures it)",
    )
    belly: BellyConfig = BellyConfig()
    link_mass_kg: float = Field(0.11, gt=0.001, le=20.0)
    yaw_limit_rad: float = Field(1.5, gt=0.05, le=3.1)
    pitch_limit_rad: float = Field(1.2, gt=0.05, le=3.1)
    joint_speed_limit_rad_s: float = Field(2.0, gt=0.0, description="what a plan may ask")
    joint_acceleration_limit_rad_s2: float = Field(25.0, gt=0.0, description="what a plan may ask")
    torque_limit_n_m: float = Field(2.0, gt=0.0, description="what a plan may ask of a joint")
    limbs: tuple[LimbsConfig, ...] = Field(
        (), description="pairs of legs, from the tail to the head: tables [[limbs]]"
    )
    servo: ServoConfig = ServoConfig()
    imu: ImuConfig | None = Field(None, description="a table [imu]; default: there is none")
    stereo_head: StereoHeadConfig | None = Field(
        None, description="a table [stereo_head]; default: there is none"
    )
    power: PowerConfig | None = Field(
        None, description="a table [power]; default: the cables between servos take nothing"
    )
    ports: tuple[PortConfig, ...] = Field(
        (),
        description="tables [[ports]], where segments of the chain are on adapters of their own, "
        "for --port robot; default: all servos are on the one port of --port",
    )

    @model_validator(mode="after")
    def _axes_of_the_joints(self) -> Self:
        """Take ``joint_axes`` from the joints where the file does not say them."""
        if not self.joint_axes:
            axes = [joint.axis for joint in self.joints]
            known = "".join(axis for axis in axes if axis is not None)
            if not known or len(known) < len(axes):
                raise ValueError(
                    "joint_axes: is required: a letter for each joint, or axis in each of joints"
                )
            object.__setattr__(self, "joint_axes", known)  # frozen from here on
        return self

    @model_validator(mode="after")
    def _joints_are_the_chains(self) -> Self:
        if not self.joints:
            return self
        if len(self.joints) != self.joint_count:
            raise ValueError(
                f"joints: {len(self.joints)} of them, but joint_axes has {self.joint_count}"
                if not self.limbs
                else f"joints: {len(self.joints)} of them, but spine and legs have "
                f"{self.joint_count}"
            )
        for k, (joint, axis) in enumerate(zip(self.joints, self.all_axes, strict=True)):
            label = self.joint_label(k)
            if joint.axis not in (None, axis):
                raise ValueError(f"joints: {label}: axis is {joint.axis}, joint_axes says {axis}")
            if joint.current_limit_a is not None and axis != "p":
                raise ValueError(f"joints: {label}: current_limit_a: only pitch joints have one")
        return self

    @model_validator(mode="after")
    def _joint_names_differ(self) -> Self:
        twice = [name for name, count in Counter(self.joint_names).items() if count > 1]
        if twice:
            raise ValueError(f"joints: {twice[0]} is the name of two joints; names must differ")
        return self

    @model_validator(mode="after")
    def _links_make_a_spine(self) -> Self:
        if not self.links:
            return self
        if len(self.links) != self.link_count:
            raise ValueError(
                f"links: {len(self.links)} of them, but a spine of {self.link_count - 1} joints "
                f"has {self.link_count}"
            )
        lengths_m, radii_m = self.link_lengths_m, self.link_radii_m
        if lengths_m[0] == 0.0 or lengths_m[-1] == 0.0:
            raise ValueError("links: length_m of the head and of the tail must be over 0")
        for k in range(1, self.link_count - 1):
            if lengths_m[k] == 0.0 and self.joint_axes[k - 1] == self.joint_axes[k]:
                raise ValueError(
                    f"links: length_m of link {k} is 0: the axes of the joints before and behind "
                    f"it must differ, both are {self.joint_axes[k]}"
                )
            if lengths_m[k] == 0.0 == lengths_m[k + 1]:
                raise ValueError(
                    f"links: length_m of links {k} and {k + 1} is 0: a module has two axes at most"
                )
        if self.body_profile is not None and len(set(radii_m)) > 1:
            raise ValueError("links: radius_m and body_profile: one of them says the radii")
        if self.body_radius_m != max(radii_m):
            raise ValueError(
                f"body_radius_m = {self.body_radius_m:g}: is the thickest link's, {max(radii_m):g}"
            )
        return self

    @model_validator(mode="after")
    def _limbs_stand_on_the_spine(self) -> Self:
        at = [pair.link for pair in self.limbs]
        if any(link >= self.link_count for link in at):
            raise ValueError(f"limbs: link {max(at)} of {self.link_count}: 0 is the head")
        if any(after >= before for before, after in pairwise(at)):
            raise ValueError(
                "limbs: each at a link of its own, from the tail to the head: "
                f"{sorted(set(at), reverse=True)}"
            )
        return self

    @model_validator(mode="after")
    def _ids_fit_the_bus(self) -> Self:
        ids = self.servo_ids
        if max(ids) > LAST_ID:
            raise ValueError(f"servo IDs would run to {max(ids)}; the bus has 0 to {LAST_ID}")
        twice = sorted(each for each, count in Counter(ids).items() if count > 1)
        if twice:
            raise ValueError(f"joints: ID {', '.join(map(str, twice))} is of more than one joint")
        return self

    @model_validator(mode="after")
    def _imu_is_on_the_spine(self) -> Self:
        if self.imu is not None and self.imu.link >= self.link_count:
            raise ValueError(f"imu: link {self.imu.link} of {self.link_count}: 0 is the head")
        if self.imu is not None and self.imu.id in self.servo_ids:
            raise ValueError(f"imu: id {self.imu.id} is a joint's")
        return self

    @model_validator(mode="after")
    def _stereo_head_is_on_the_spine(self) -> Self:
        if self.stereo_head is not None and self.stereo_head.link >= self.link_count:
            raise ValueError(
                f"stereo_head: link {self.stereo_head.link} of {self.link_count}: 0 is the head"
            )
        return self

    @model_validator(mode="after")
    def _power_is_for_the_chain(self) -> Self:
        if self.power is None:
            return self
        for each, count in Counter(self.power.inject_ids).items():
            if each not in self.servo_ids:
                raise ValueError(f"power: inject_ids: ID {each} is not of this robot")
            if count > 1:
                raise ValueError(f"power: inject_ids: ID {each} is named twice")
        cables = len(self.power.cables_ohm)
        if cables not in (0, self.joint_count - 1):
            raise ValueError(
                f"power: cables_ohm: {cables} of them; {self.joint_count} servos have "
                f"{self.joint_count - 1} cables between them"
            )
        return self

    @model_validator(mode="after")
    def _ports_have_every_id(self) -> Self:
        if not self.ports:
            return self
        needed = [*self.servo_ids, *(() if self.imu is None else (self.imu.id,))]
        told = Counter(each for port in self.ports for each in port.ids)
        names = Counter(port.port for port in self.ports)
        for what, wrong in (
            ("is on none of them", [each for each in needed if each not in told]),
            ("is on more than one", [each for each, count in told.items() if count > 1]),
            ("is not of this robot", [each for each in told if each not in needed]),
        ):
            if wrong:
                raise ValueError(f"ports: ID {', '.join(map(str, sorted(wrong)))} {what}")
        twice = [name for name, count in names.items() if count > 1]
        if twice:
            raise ValueError(f"ports: {twice[0]} is named twice: one table a port")
        bare = [port.port for port in self.ports if not set(port.ids) & set(self.servo_ids)]
        if bare:
            raise ValueError(f"ports: {bare[0]} has no servo: an IMU shares a segment's port")
        if len(self.ports) == 1:
            raise ValueError("ports: only one: leave the table out, and name it by --port")
        return self

    @model_validator(mode="after")
    def _models_can_run(self) -> Self:
        for model in dict.fromkeys(self.servo_models):
            if model.startswith(_PROTOCOL_1):
                raise ValueError(
                    f"servo: model {model} speaks Protocol 1.0, which has no group read and no "
                    "watchdog that a run could rely on; a run needs a servo of Protocol 2.0, such "
                    "as XL430-W250 (for programs of your own: snakewalk bus serve --servos "
                    "1-4:AX-12A)"
                )
            if self.servo.over_current_a is None and model not in STALL_CURRENT_A:
                raise ValueError(
                    f"servo: over_current_a is missing: the stall current of {model} is not known"
                )
        if self.servo.over_current_a is not None:
            self.check_over_current("servo: over_current_a", self.servo.over_current_a)
        return self

    def check_over_current(self, name: str, limit_a: float) -> None:
        """Refuse a limit that a servo cannot reach: it would watch nothing.

        Raises:
            ValueError: it is the stall current of a servo or more.

        """
        for model in dict.fromkeys(self.servo_models):
            stall_a = STALL_CURRENT_A.get(model, math.inf)
            if limit_a >= stall_a:
                raise ValueError(
                    f"{name} = {limit_a:g}: {model} draws {stall_a:g} A at most and would never "
                    f"trip; leave it out for {_LIMIT_SHARE * stall_a:.2f} A"
                )

    @property
    def over_current_a(self) -> float:
        """Current at which a run stops that says none: that of the weakest servo."""
        if self.servo.over_current_a is not None:
            return self.servo.over_current_a
        return round(_LIMIT_SHARE * min(STALL_CURRENT_A[m] for m in self.servo_models), 3)

    @model_validator(mode="after")
    def _ranges_are_within_a_turn(self) -> Self:
        """In position mode a servo knows one turn: positions 0 to 4095 of 4096."""
        most_rad = math.pi - math.tau / 4096
        for joint, limit_rad in enumerate(self.limit_rad):
            beyond = limit_rad + abs(self.zeros_rad[joint])
            if beyond > most_rad:
                raise ValueError(
                    f"{self.joint_label(joint)}: zero_rad {self.zeros_rad[joint]:g} with a limit "
                    f"of {limit_rad:g} rad leaves the servo's turn by {beyond - most_rad:.3f} rad: "
                    "mount the horn nearer to the servo's centre, or lower limit_rad"
                )
        return self

    @model_validator(mode="after")
    def _rails_hold_the_body(self) -> Self:
        width_m = self.belly.width_m
        if width_m is None and "rails" in self.link_shapes:
            raise ValueError('links: shape rails needs belly.shape = "rails" and its width_m')
        if width_m is not None and width_m <= 2.0 * self.body_radius_m:
            raise ValueError("belly.width_m must be over twice body_radius_m")
        return self

    @model_validator(mode="after")
    def _profile_is_relative(self) -> Self:
        if any(not 0.05 < radius <= 1.0 for radius in self.body_profile or ()):
            raise ValueError("body_profile must be over 0.05 and at most 1 everywhere")
        return self

    @property
    def joint_count(self) -> int:
        """Number of servos J, legs included; there are J + 1 links."""
        return len(self.all_axes)

    @property
    def link_count(self) -> int:
        """Links of the spine: the first of all links."""
        return len(self.joint_axes) + 1

    @property
    def limb_joints(self) -> tuple[LimbJoint, ...]:
        """Joints of the legs in the order of the bus, behind those of the spine."""
        return _limb_joints(tuple(pair.joint_axes for pair in self.limbs))

    @property
    def all_axes(self) -> str:
        """One letter a servo: spine, then legs."""
        return self.joint_axes + "".join(2 * pair.joint_axes for pair in self.limbs)

    @property
    def link_parents(self) -> tuple[int, ...]:
        """(J + 1,) link that each link hangs on: link i + 1 by joint i; -1 for the head."""
        parents = list(range(-1, self.link_count - 1))
        for joint in self.limb_joints:
            hip = joint.place == 0
            parents.append(self.limbs[joint.pair].link if hip else len(parents) - 1)
        return tuple(parents)

    @property
    def mass_kg(self) -> float:
        """Of all links."""
        legs = sum(2 * len(pair.joint_axes) * pair.segment_mass_kg for pair in self.limbs)
        masses_kg = self.link_masses_kg
        if len(set(masses_kg)) > 1:
            return math.fsum(masses_kg) + legs
        return masses_kg[0] * self.link_count + legs

    @property
    def length_m(self) -> float:
        """Body length: the links of the spine."""
        if not self.links:
            return self.link_length_m * self.link_count
        lengths_m = self.link_lengths_m
        if len(set(lengths_m)) > 1:
            return math.fsum(lengths_m)
        return lengths_m[0] * self.link_count

    @property
    def mean_link_length_m(self) -> float:
        """Body length over the number of links."""
        if not self.links:
            return self.link_length_m
        lengths_m = self.link_lengths_m
        if len(set(lengths_m)) > 1:
            return self.length_m / self.link_count
        return lengths_m[0]

    @property
    def mean_link_mass_kg(self) -> float:
        """Mass of the spine over the number of its links."""
        masses_kg = self.link_masses_kg
        if len(set(masses_kg)) > 1:
            return math.fsum(masses_kg) / self.link_count
        return masses_kg[0]

    @property
    def link_lengths_m(self) -> tuple[float, ...]:
        """Length of each link of the spine, head first."""
        return self._of_links("length_m", self.link_length_m)

    @property
    def link_masses_kg(self) -> tuple[float, ...]:
        """Mass of each link of the spine, head first, with what stands on it."""
        masses_kg = self._of_links("mass_kg", self.link_mass_kg)
        if self.stereo_head is None:
            return masses_kg
        at = self.stereo_head.link
        loaded_kg = masses_kg[at] + self.stereo_head.mass_kg
        return (*masses_kg[:at], loaded_kg, *masses_kg[at + 1 :])

    @property
    def link_radii_m(self) -> tuple[float, ...]:
        """Radius of each link of the spine, head first; ``body_profile`` is left out."""
        return self._of_links("radius_m", self.body_radius_m)

    @property
    def link_shapes(self) -> tuple[LinkShape, ...]:
        """What of each link of the spine meets the ground, head first."""
        if not self.links:
            return (self.belly.shape,) * self.link_count
        return tuple(
            link.shape or ("none" if link.length_m == 0.0 else self.belly.shape)
            for link in self.links
        )

    @property
    def link_ends(self) -> tuple[float, ...]:
        """(L + 1,) the head's tip, the spine's joints and the tail's end along the body.

        Counted in mean link lengths from the head: 0, 1, 2 ... of links that are all alike.
        """
        if not self.links:
            return _even_ends(self.link_count)
        lengths_m, mean_m = self.link_lengths_m, self.mean_link_length_m
        if len(set(lengths_m)) == 1:
            return _even_ends(self.link_count)
        inner = (run_m / mean_m for run_m in accumulate(lengths_m[:-1]))
        return (0.0, *inner, float(self.link_count))

    def _of_links(self, key: str, usual: float) -> tuple[float, ...]:
        """Values of a key of the links, ``usual`` where a link has none of its own."""
        if not self.links:
            return (usual,) * self.link_count
        own = (getattr(link, key) for link in self.links)
        return tuple(usual if o is None else o for o in own)

    def radii_m(self, stations: int) -> tuple[float, ...]:
        """Body radius at ``stations`` (1 or more) equal places from head tip to tail tip."""
        return self.radii_at_m(tuple(k / max(stations - 1, 1) for k in range(stations)))

    def radii_at_m(self, shares: tuple[float, ...]) -> tuple[float, ...]:
        """Body radius at places along the body: 0 is the head's tip, 1 the tail's."""
        if len(set(self.link_radii_m)) > 1:
            return tuple(self._radius_at_m(share * self.link_count) for share in shares)
        profile = self.body_profile or (1.0,)
        radii = []
        for share in shares:
            at = share * (len(profile) - 1)
            low = min(int(at), max(len(profile) - 2, 0))
            high = min(low + 1, len(profile) - 1)
            radii.append(profile[low] + (at - low) * (profile[high] - profile[low]))
        return tuple(self.body_radius_m * radius for radius in radii)

    def _radius_at_m(self, place: float) -> float:
        """Radius where links differ, of the thicker one at a joint; place as ``link_ends``."""
        ends = self.link_ends
        return max(
            radius_m
            for radius_m, front, back in zip(self.link_radii_m, ends, ends[1:], strict=False)
            if front <= place <= back
        )

    @property
    def servo_ids(self) -> tuple[int, ...]:
        """Bus IDs, head first."""
        first = self.servo.first_id
        if not self.joints:
            return tuple(range(first, first + self.joint_count))
        return tuple(first + k if j.id is None else j.id for k, j in enumerate(self.joints))

    @property
    def servo_models(self) -> tuple[str, ...]:
        """Model of each joint's servo, head first."""
        if not self.joints:
            return (self.servo.model,) * self.joint_count
        return tuple(joint.model or self.servo.model for joint in self.joints)

    @property
    def motors(self) -> tuple[MotorConfig | None, ...]:
        """Constants of each joint's servo, head first; None where they are the catalogue's."""
        own, of = self.servo.motor, self.servo.model
        return tuple(own if model == of else None for model in self.servo_models)

    @property
    def models_by_id(self) -> dict[int, str]:
        """Model of each servo by its bus ID."""
        return dict(zip(self.servo_ids, self.servo_models, strict=True))

    @property
    def signs(self) -> tuple[int, ...]:
        """-1 where a joint's servo is mounted the other way round, else 1; head first."""
        return tuple(j.sign for j in self.joints) or (1,) * self.joint_count

    @property
    def zeros_rad(self) -> tuple[float, ...]:
        """Where each servo stands, from its own zero, when its joint is straight; head first."""
        return tuple(j.zero_rad for j in self.joints) or (0.0,) * self.joint_count

    @property
    def position_p_gains(self) -> tuple[int, ...]:
        """Register 84 of each joint, head first."""
        stiff, soft = self.servo.position_p_gain, self.servo.pitch_p_gain
        usual = tuple(soft if axis == "p" else stiff for axis in self.all_axes)
        return self._own("position_p_gain", usual)

    @property
    def position_i_gains(self) -> tuple[int, ...]:
        """Register 82 of each joint, head first."""
        return self._own("position_i_gain", (self.servo.position_i_gain,) * self.joint_count)

    @property
    def position_d_gains(self) -> tuple[int, ...]:
        """Register 80 of each joint, head first."""
        return self._own("position_d_gain", (self.servo.position_d_gain,) * self.joint_count)

    @property
    def current_limits_a(self) -> tuple[float, ...]:
        """Goal current of each joint, head first; infinite where it does not lift the spine."""
        pitch_a = self.servo.pitch_current_limit_a
        usual = tuple(pitch_a if axis == "p" else math.inf for axis in self.all_axes)
        return self._own("current_limit_a", usual)

    @property
    def armatures_kg_m2(self) -> tuple[float, ...]:
        """Inertia of rotor and gears at each joint's shaft, head first."""
        return self._own("armature_kg_m2", (self.servo.armature_kg_m2,) * self.joint_count)

    @property
    def gear_drags_n_m_s(self) -> tuple[float, ...]:
        """Viscous loss of the gears at each joint's shaft, head first."""
        return self._own("gear_drag_n_m_s", (self.servo.gear_drag_n_m_s,) * self.joint_count)

    def _own(self, key: str, usual: tuple[N, ...]) -> tuple[N, ...]:
        """Values of a key of the joints, ``usual`` where a joint has none of its own."""
        if not self.joints:
            return usual
        own = (getattr(joint, key) for joint in self.joints)
        return tuple(u if o is None else o for o, u in zip(own, usual, strict=True))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Name of each joint, in the order of the bus; names are unique and valid in ROS."""
        usual = default_joint_names(self.all_axes, [each.side for each in self.limb_joints])
        return self._own("name", usual)

    def joint_label(self, joint: int) -> str:
        """Text by which every message calls a joint: name, servo ID, and port of a segment."""
        servo_id = self.servo_ids[joint]
        port = next((each.port for each in self.ports if servo_id in each.ids), None)
        return joint_label(self.joint_names[joint], servo_id, port)

    def label_of_servo(self, servo_id: int) -> str:
        """Text of ``joint_label`` for the joint of a servo."""
        return self.joint_label(self.servo_ids.index(servo_id))

    @property
    def yaw_joints(self) -> tuple[int, ...]:
        """Indices of the spine's joints that turn about the vertical."""
        return _joints_about(self.joint_axes, "y")

    @property
    def pitch_joints(self) -> tuple[int, ...]:
        """Indices of the spine's joints that lift."""
        return _joints_about(self.joint_axes, "p")

    @property
    def limit_rad(self) -> tuple[float, ...]:
        """Half range of each joint, rad, in the order of the bus."""
        spine = tuple(
            self.yaw_limit_rad if axis == "y" else self.pitch_limit_rad for axis in self.joint_axes
        )
        legs = (
            (pair.yaw_limit_rad if axis == "y" else pair.roll_limit_rad)
            for pair in self.limbs
            for axis in 2 * pair.joint_axes
        )
        return self._own("limit_rad", spine + tuple(legs))
