"""A robot: one chain of links, joints and servos, with or without legs."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from snakewalk.config.errors import ConfigError
from snakewalk.config.robot.joint_values import JointValues
from snakewalk.config.robot.keys import READ_INSTEAD, Unreadable
from snakewalk.config.robot.register_bounds import (
    half_range_rad,
    initial_gains,
    initial_joint_gains,
    register_faults,
)
from snakewalk.config.robot.servo import LAST_ID
from snakewalk.config.robot.spelling import canonical_joints, canonical_links
from snakewalk.config.servo_model import protocol_name, wire_format

_LIMIT_SHARE = 2.0 / 2.3
"""Share of the stall current at which a run stops (ours): 2 A for an XM430."""


class RobotConfig(JointValues):
    """A chain of links joined by servos, with or without legs; metres, index 0 is the head.

    The order of the joints is that of the servos on the bus. The spine comes first, from head to
    tail. Then follow the legs, pair by pair from tail to head, left before right, hip before foot.
    """

    @model_validator(mode="after")
    def _axes_of_the_joints(self) -> Self:
        """Derive ``joint_axes`` from the joints if the file does not give it."""
        if not self.joint_axes:
            axes = [joint.axis for joint in self.joints]
            given_axes = "".join(axis for axis in axes if axis is not None)
            if not given_axes or len(given_axes) < len(axes):
                raise ValueError(
                    "joint_axes: is required: a letter for each joint, or axis in each of joints"
                )
            object.__setattr__(self, "joint_axes", given_axes)  # frozen from here on
        return self

    @model_validator(mode="after")
    def _joints_are_the_chains(self) -> Self:
        if not self.joints:
            return self
        if len(self.joints) != self.joint_count:
            raise ValueError(
                f"joints: {len(self.joints)} given, but joint_axes has {self.joint_count}"
                if not self.limbs
                else f"joints: {len(self.joints)} given, but spine and legs have {self.joint_count}"
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
                f"links: {len(self.links)} given, but a spine of {self.link_count - 1} joints "
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
            raise ValueError("links: radius_m and body_profile: both state the radii; remove one")
        if self.body_radius_m != max(radii_m):
            raise ValueError(
                f"body_radius_m = {self.body_radius_m:g}: the thickest link has radius_m = "
                f"{max(radii_m):g}; write body_radius_m = {max(radii_m):g}, and radius_m in each "
                "thinner link of [[links]]"
            )
        return self

    @model_validator(mode="after")
    def _limbs_stand_on_the_spine(self) -> Self:
        limb_links = [pair.link for pair in self.limbs]
        if any(link >= self.link_count for link in limb_links):
            raise ValueError(f"limbs: link {max(limb_links)} of {self.link_count}: 0 is the head")
        if any(after >= before for before, after in pairwise(limb_links)):
            raise ValueError(
                "limbs: each at a link of its own, from the tail to the head: "
                f"{sorted(set(limb_links), reverse=True)}"
            )
        return self

    @model_validator(mode="after")
    def _ids_fit_the_bus(self) -> Self:
        ids = self.servo_ids
        if max(ids) > LAST_ID:
            raise ValueError(f"servo IDs would run to {max(ids)}; the bus has 0 to {LAST_ID}")
        twice = sorted(servo_id for servo_id, count in Counter(ids).items() if count > 1)
        if twice:
            raise ValueError(f"joints: ID {', '.join(map(str, twice))} is the ID of several joints")
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
    def _tracked_body_is_on_the_spine(self) -> Self:
        if self.pose is not None and self.pose.link >= self.link_count:
            raise ValueError(f"pose: link {self.pose.link} of {self.link_count}: 0 is the head")
        for tag in () if self.tags is None else self.tags.on:
            if tag.link >= self.link_count:
                raise ValueError(
                    f"tags: tag {tag.id}: link {tag.link} of {self.link_count}: 0 is the head"
                )
        return self

    @model_validator(mode="after")
    def _power_is_for_the_chain(self) -> Self:
        if self.power is None:
            return self
        for servo_id, count in Counter(self.power.inject_ids).items():
            if servo_id not in self.servo_ids:
                raise ValueError(f"power: inject_ids: ID {servo_id} is not of this robot")
            if count > 1:
                raise ValueError(f"power: inject_ids: ID {servo_id} is named twice")
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
        count_by_id = Counter(servo_id for port in self.ports for servo_id in port.ids)
        names = Counter(port.port for port in self.ports)
        for what, wrong in (
            (
                "is on none of them",
                [servo_id for servo_id in needed if servo_id not in count_by_id],
            ),
            (
                "is on more than one",
                [servo_id for servo_id, count in count_by_id.items() if count > 1],
            ),
            (
                "is not of this robot",
                [servo_id for servo_id in count_by_id if servo_id not in needed],
            ),
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
        try:
            records = self.records_by_model
        except ConfigError as error:
            raise ValueError(f"servo: {error}") from None
        for ids in [port.ids for port in self.ports] or [self.servo_ids]:
            first, *others = self.models_on(ids).values()
            for facts in others:
                if wire_format(facts) != wire_format(first):
                    raise ValueError(
                        f"servo: {first.model} speaks {protocol_name(first)} and {facts.model} "
                        f"{protocol_name(facts)} or other words: one port has servos of one "
                        "series; name a port for each in [[ports]]"
                    )
        for model, facts in records.items():
            if facts.protocol == 1:
                raise ValueError(
                    f"servo: model {model} speaks Protocol 1.0, which lacks group reads and a "
                    "watchdog; choose a servo of Protocol 2.0, such as XL430-W250 (for your "
                    "own programs: snakewalk bus serve --servos 1-4:AX-12A)"
                )
            missing = facts.missing_for_a_run()
            if missing:
                raise ValueError(
                    f"servo: the file of {model} lacks {', '.join(missing)}, which a run needs"
                )
            if self.servo.over_current_a is None and facts.stall_current_a is None:
                raise ValueError(
                    f"servo: over_current_a is missing: the stall current of {model} is not known"
                )
        if self.servo.over_current_a is not None:
            self.check_over_current("servo: over_current_a", self.servo.over_current_a)
        return self

    @model_validator(mode="after")
    def _registers_hold_the_values(self) -> Self:
        by_joint = initial_joint_gains(self)
        gains = initial_gains(self)
        if by_joint:
            self.__dict__["joints"] = tuple(
                joint_config.model_copy(update=by_joint.get(joint, {}))
                for joint, joint_config in enumerate(self.joints)
            )
        if gains:
            self.__dict__["servo"] = self.servo.model_copy(update=gains)
        faults = register_faults(self)
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def check_over_current(self, name: str, limit_a: float) -> None:
        """Reject a limit that a servo cannot reach, which would never trip.

        Raises:
            ValueError: the limit is not below the stall current of each servo.

        """
        for facts in self.servo_records:
            stall_a = facts.stall_current_a
            if stall_a is not None and limit_a >= stall_a:
                raise ValueError(
                    f"{name} = {limit_a:g}: {facts.model} draws {stall_a:g} A at most and would "
                    f"never trip; leave it out for {_LIMIT_SHARE * stall_a:.2f} A"
                )

    @property
    def over_current_a(self) -> float:
        """Current at which a run without a limit stops: that of the weakest servo."""
        if self.servo.over_current_a is not None:
            return self.servo.over_current_a
        stall_a = [a for facts in self.servo_records if (a := facts.stall_current_a) is not None]
        return round(_LIMIT_SHARE * min(stall_a), 3)

    @model_validator(mode="after")
    def _ranges_are_within_a_turn(self) -> Self:
        for joint, (limit_rad, facts) in enumerate(
            zip(self.limit_rad, self.servo_records, strict=True)
        ):
            most_rad = half_range_rad(facts)
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

    @model_serializer(mode="wrap")
    def _without_empty_records(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Omit keys that most robots lack, in files and logs."""
        data: dict[str, Any] = handler(self)
        if not self.described_models:
            data.pop("described_models", None)
        for key in ("pose", "ros", "tags"):
            if data.get(key) is None:
                data.pop(key, None)
        return data

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Name the property that has the value of each link or joint."""
            if name in READ_INSTEAD:
                raise AttributeError(
                    f"{name} is not the value of every link or joint; read {READ_INSTEAD[name]}"
                )
            return super().__getattr__(name)

    @model_validator(mode="after")
    def _is_spelled_canonically(self) -> Self:
        for keys in (canonical_links(self), canonical_joints(self)):
            self.__dict__.update(keys)  # frozen from here on
        return self

    def with_link_masses(self, masses_kg: Sequence[float]) -> "RobotConfig":
        """Return the robot with other link masses (L,), without a stereo head's mast.

        Raises:
            ValidationError: a mass is out of range.

        """
        links = [
            {"length_m": length_m, "radius_m": radius_m, "shape": shape, "mass_kg": float(mass_kg)}
            for length_m, radius_m, shape, mass_kg in zip(
                self.link_lengths_m, self.link_radii_m, self.link_shapes, masses_kg, strict=True
            )
        ]
        return RobotConfig.model_validate(self.model_dump() | {"links": links})


for _key in READ_INSTEAD:
    setattr(RobotConfig, _key, Unreadable())
