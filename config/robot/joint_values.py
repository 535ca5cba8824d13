"""Values of each joint and servo, derived from the parsed keys."""

import math
from collections.abc import Collection
from functools import cache
from typing import TypeVar

from snakewalk.config.joint_names import default_joint_names, joint_label
from snakewalk.config.motor import MotorConfig
from snakewalk.config.robot.keys import parsed
from snakewalk.config.robot.link_values import LinkValues
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.config.servo_model import ServoModel, wire_format

N = TypeVar("N", int, float, str)


class JointValues(LinkValues):
    """Robot with the values of its joints and servos, in the order of the bus."""

    @property
    def servo_ids(self) -> tuple[int, ...]:
        """Bus ID of each servo."""
        first = self.servo.first_id
        if not self.joints:
            return tuple(range(first, first + self.joint_count))
        return tuple(first + k if j.id is None else j.id for k, j in enumerate(self.joints))

    @property
    def servo_models(self) -> tuple[str, ...]:
        """Model of each servo."""
        if not self.joints:
            return (self.servo.model,) * self.joint_count
        return tuple(joint.model or self.servo.model for joint in self.joints)

    @property
    def servo_records(self) -> tuple[ServoModel, ...]:
        """Record of each servo's model.

        Raises:
            ConfigError: a model is unknown.

        """
        records = self.records_by_model
        return tuple(records[name] for name in self.servo_models)

    @property
    def is_feetech(self) -> bool:
        """Whether all servos speak Feetech's protocol."""
        return all(record.is_feetech for record in self.records_by_model.values())

    @property
    def is_mixed(self) -> bool:
        """Whether the ports have servos of different series, each its own."""
        return len({wire_format(record) for record in self.records_by_model.values()}) > 1

    @property
    def records_by_model(self) -> dict[str, ServoModel]:
        """Record of each model in the chain, in the order of the servos.

        Raises:
            ConfigError: a model is not known.

        """
        described = {
            described_model.model: described_model for described_model in self.described_models
        }
        models = dict.fromkeys(self.servo_models)
        return {name: described.get(name) or servo_model(name) for name in models}

    @property
    def motors(self) -> tuple[MotorConfig | None, ...]:
        """Motor constants of each servo; None: those of its model."""
        motor = self.servo.motor
        of = self.servo.model
        return tuple(motor if model == of else None for model in self.servo_models)

    @property
    def models_by_id(self) -> dict[int, ServoModel]:
        """Record of each servo's model by its bus ID."""
        return dict(zip(self.servo_ids, self.servo_records, strict=True))

    def models_on(self, ids: Collection[int] | None) -> dict[int, ServoModel]:
        """``models_by_id`` of the servos of a port; ``ids`` None: of all."""
        models = self.models_by_id
        return models if ids is None else {i: model for i, model in models.items() if i in ids}

    @property
    def signs(self) -> tuple[int, ...]:
        """-1 for each reversed servo, else 1."""
        return tuple(j.sign for j in self.joints) or (1,) * self.joint_count

    @property
    def zeros_rad(self) -> tuple[float, ...]:
        """Servo angle of each straight joint, from the servo's zero."""
        return tuple(j.zero_rad for j in self.joints) or (0.0,) * self.joint_count

    @property
    def position_p_gains(self) -> tuple[int, ...]:
        """Position P Gain of each servo."""
        stiff = self.servo.position_p_gain
        soft = self.servo.pitch_p_gain
        usual = tuple(soft if axis == "p" else stiff for axis in self.all_axes)
        return self._values_of_joints("position_p_gain", usual)

    @property
    def position_i_gains(self) -> tuple[int, ...]:
        """Position I Gain of each servo."""
        return self._values_of_joints(
            "position_i_gain", (self.servo.position_i_gain,) * self.joint_count
        )

    @property
    def position_d_gains(self) -> tuple[int, ...]:
        """Position D Gain of each servo."""
        return self._values_of_joints(
            "position_d_gain", (self.servo.position_d_gain,) * self.joint_count
        )

    @property
    def current_limits_a(self) -> tuple[float, ...]:
        """Goal current of each joint; infinite for joints that do not lift the spine."""
        pitch_a = self.servo.pitch_current_limit_a
        usual = tuple(pitch_a if axis == "p" else math.inf for axis in self.all_axes)
        return self._values_of_joints("current_limit_a", usual)

    @property
    def armatures_kg_m2(self) -> tuple[float, ...]:
        """Inertia of rotor and gears at each joint's shaft."""
        return self._values_of_joints(
            "armature_kg_m2", (self.servo.armature_kg_m2,) * self.joint_count
        )

    @property
    def gear_drags_n_m_s(self) -> tuple[float, ...]:
        """Viscous loss of the gears at each joint's shaft."""
        return self._values_of_joints(
            "gear_drag_n_m_s", (self.servo.gear_drag_n_m_s,) * self.joint_count
        )

    def _values_of_joints(self, key: str, usual: tuple[N, ...]) -> tuple[N, ...]:
        """Value of a key for each joint, by default ``usual``."""
        if not self.joints:
            return usual
        joint_values = (getattr(joint, key) for joint in self.joints)
        return tuple(u if o is None else o for o, u in zip(joint_values, usual, strict=True))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Unique name of each joint, in the order of the bus; valid in ROS."""
        usual = default_joint_names(
            self.all_axes, [limb_joint.side for limb_joint in self.limb_joints]
        )
        return self._values_of_joints("name", usual)

    def joint_label(self, joint: int) -> str:
        """Label of a joint in messages: name, servo ID, and port of a segment."""
        servo_id = self.servo_ids[joint]
        port = next((segment.port for segment in self.ports if servo_id in segment.ids), None)
        return joint_label(self.joint_names[joint], servo_id, port)

    def label_of_servo(self, servo_id: int) -> str:
        """``joint_label`` of a servo's joint."""
        return self.joint_label(self.servo_ids.index(servo_id))

    @property
    def yaw_joints(self) -> tuple[int, ...]:
        """Indices of the spine's yaw joints."""
        return _joints_about(self.joint_axes, "y")

    @property
    def pitch_joints(self) -> tuple[int, ...]:
        """Indices of the spine's pitch joints."""
        return _joints_about(self.joint_axes, "p")

    @property
    def limit_rad(self) -> tuple[float, ...]:
        """Half range of each joint, rad."""
        yaw_rad, pitch_rad = parsed(self, "yaw_limit_rad"), parsed(self, "pitch_limit_rad")
        spine = tuple(yaw_rad if axis == "y" else pitch_rad for axis in self.joint_axes)
        legs = (
            (pair.yaw_limit_rad if axis == "y" else pair.roll_limit_rad)
            for pair in self.limbs
            for axis in 2 * pair.joint_axes
        )
        return self._values_of_joints("limit_rad", spine + tuple(legs))


@cache
def _joints_about(axes: str, axis: str) -> tuple[int, ...]:
    return tuple(i for i, other in enumerate(axes) if other == axis)
