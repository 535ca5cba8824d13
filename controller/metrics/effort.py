"""Effort of a run from its log: energy, cost of transport; climb and slip of a gait.

Only the simulation integrates energy. A real servo has samples of Present Current, just before the
next goal. The current between them follows from goals and angles
(``docs/gaits.md``).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.metrics.displacement import full_rate_span_s
from snakewalk.controller.metrics.ground_contact import CLEAR_M
from snakewalk.controller.metrics.travel import Travel, travel
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose

EnergySource = Literal["integrated", "sampled", "unknown"]
PARTS = 3
"""Steps in which the current is computed before and after the goals of a cycle arrive."""
WRITTEN_SHARE = 0.25
"""Part of a cycle before its goals arrive, if its time on the wire is not known (ours)."""


@dataclass(frozen=True, slots=True)
class EnergyTrack:
    """Energy of all motors at the cycles of a run, since its first one or earlier; T cycles."""

    time_s: Floats
    """(T,) times of the cycles, s."""
    electrical_j: Floats
    """(T,) consumed; energy that a motor returns is lost. Without the servos' electronics."""
    mechanical_j: Floats
    """(T,) net work at the shafts."""
    source: EnergySource
    """Source of the energy: ``integrated`` in every physics step, or ``sampled``: from readings and
    goals of cycles."""

    def between(self, from_s: float, to_s: float) -> tuple[float, float]:
        """Electrical and mechanical energy from one time to another, J; NaN where not known."""
        if len(self.time_s) == 0:
            return float("nan"), float("nan")
        ends = [from_s, to_s]
        return (
            float(np.diff(np.interp(ends, self.time_s, self.electrical_j))[0]),
            float(np.diff(np.interp(ends, self.time_s, self.mechanical_j))[0]),
        )


def energy_track(record: RunRecord) -> EnergyTrack:
    """Return the energy as the log has it, else from samples of current and speed."""
    cycle = record.cycle
    if np.isfinite(cycle.electrical_j).any():
        return EnergyTrack(cycle.time_s, cycle.electrical_j, cycle.mechanical_j, "integrated")
    return sampled_energy(record)


def sampled_energy(record: RunRecord) -> EnergyTrack:
    """Return the energy from the current and speed that each cycle read, and the course between.

    A reading comes just before the next goal, when the error of the last one has decayed. In
    between the output follows the error; the reading corrects its course for supply and friction.
    """
    header = record.header
    cycle = record.cycle
    winding = header.winding
    if winding is None or not np.isfinite(cycle.current_a).any():
        unknown = np.full(len(cycle.time_s), np.nan)
        return EnergyTrack(cycle.time_s, unknown, unknown, "unknown")
    servos = header.robot.servo_records
    stall_a = np.array([facts.stall_current_a or 0.0 for facts in servos])
    full_rad = np.array([facts.full_output_rad for facts in servos])
    per_rad = np.array(header.robot.position_p_gains) / np.where(full_rad > 0.0, full_rad, np.inf)
    limit_a = np.array(header.robot.current_limits_a)

    def driven_a(goal_rad: Floats, at_rad: Floats, turning: Floats) -> Floats:
        share = np.clip(per_rad * (goal_rad - at_rad), -1.0, 1.0)
        emf_a = np.where(stall_a > 0.0, winding.back_emf_v_s / winding.resistance_ohm, 0.0)
        return np.asarray(np.clip(share * stall_a - emf_a * turning, -limit_a, limit_a))

    wire_s = cycle.wire_busy_s[np.isfinite(cycle.wire_busy_s)]
    late = float(np.median(wire_s)) / record.period_s if len(wire_s) else WRITTEN_SHARE

    def between(step_s: Floats, *columns: Floats) -> Floats:
        """Energy (n, 2) between readings and the next ones, with their goals."""
        position, next_position, speed, next_speed, next_current, before, goal = (
            np.nan_to_num(column) for column in columns
        )
        off_a = next_current - driven_a(goal, next_position, next_speed)
        energy_j = np.zeros((len(step_s), 2))
        for part in (np.arange(PARTS) + 0.5) / PARTS:
            for goal_rad, begin, end in ((before, 0.0, late), (goal, late, 1.0)):
                at = begin + part * (end - begin)
                turning = speed + at * (next_speed - speed)
                at_rad = position + at * (next_position - position)
                amps = np.clip(driven_a(goal_rad, at_rad, turning) + off_a, -limit_a, limit_a)
                # i^2 R is heat, k_e w i is work at the shaft with the losses of the gears
                input_w = winding.resistance_ohm * amps**2 + winding.back_emf_v_s * turning * amps
                shaft_w = header.torque_constant_n_m_a * turning * amps
                for k, watts in enumerate((np.clip(input_w, 0.0, None), shaft_w)):
                    energy_j[:, k] += (watts * step_s).sum(axis=1) * (end - begin) / PARTS
        return energy_j

    def steps_j(rows: slice, after: slice, before: slice) -> Floats:
        columns = (
            np.diff(cycle.time_s)[rows, None],
            *(
                column[chosen]
                for column in (cycle.measured_rad, cycle.velocity_rad_s)
                for chosen in (rows, after)
            ),
            cycle.current_a[after],
            cycle.sent_rad[before],
            cycle.sent_rad[rows],
        )
        return np.asarray(by_rows(between, *columns))

    first_j = steps_j(slice(0, 1), slice(1, 2), slice(0, 1))
    count = len(cycle.time_s)
    other_j = steps_j(slice(1, count - 1), slice(2, count), slice(0, count - 2))
    energy_j = np.concatenate([np.zeros((1, 2)), first_j, other_j])[:count]
    electrical_j, mechanical_j = np.cumsum(energy_j, axis=0).T
    return EnergyTrack(cycle.time_s, electrical_j, mechanical_j, "sampled")


def weight_n(robot: RobotConfig) -> float:
    """Weight of a robot."""
    return robot.mass_kg * GRAVITY_M_S2


_LEAST_CARRIED_J = 1e-4


@dataclass(frozen=True, slots=True)
class Effort:
    """Means over the time at full rate; NaN if the log lacks the values for it."""

    power_w: float
    """Electrical, all motors, mean; returned energy is lost."""
    cost_of_transport: float
    """Power over weight times net speed; without the servos' own electronics."""
    mechanical_cost: float
    """Net work at the shafts over weight and distance."""
    climb_m_s: float
    slip: float
    """Sideways slide of touching links, divided by the centre's distance; flat floors only."""


def effort(record: RunRecord, moved: Travel | None = None) -> Effort:
    """Return the effort of a gait run while it runs at full rate; NaN for other runs.

    ``moved`` is its travel, where it was computed before.
    """
    pose = record.pose
    gait = record.header.run.gait
    unknown = Effort(*(float("nan"),) * 5)
    if gait is None or len(pose.time_s) == 0:
        return unknown
    from_s, end_s = full_rate_span_s(float(pose.time_s[0]), float(pose.time_s[-1]), gait.duration_s)
    steady = (pose.time_s >= from_s) & (pose.time_s <= end_s)
    if steady.sum() < 2 or not np.isfinite(pose.links_m[steady]).all():
        return unknown
    start_s, stop_s = float(pose.time_s[steady][0]), float(pose.time_s[steady][-1])
    energy = energy_track(record)
    electrical_j, _ = energy.between(start_s, stop_s)
    span_s = stop_s - start_s
    moved_m = pose.centre_m[steady][-1] - pose.centre_m[steady][0]
    return Effort(
        electrical_j / span_s,
        *costs_of_transport(record, energy, travel(record) if moved is None else moved),
        float(moved_m[2]) / span_s,
        _slip(record, steady),
    )


def costs_of_transport(
    record: RunRecord, energy: EnergyTrack, moved: Travel
) -> tuple[float, float]:
    """Return the electrical and mechanical cost of transport of a run, over its travel."""
    carried_j = weight_n(record.header.robot) * moved.distance_m
    electrical_j, mechanical_j = energy.between(moved.start_s, moved.end_s)
    return cost_of_transport(electrical_j, carried_j), cost_of_transport(mechanical_j, carried_j)


def cost_of_transport(energy_j: float, carried_j: float) -> float:
    """Energy over weight times distance; infinite without a distance, NaN if it is unknown."""
    if np.isnan(carried_j):
        return float("nan")
    return energy_j / carried_j if carried_j > _LEAST_CARRIED_J else float("inf")


def _slip(record: RunRecord, steady: Bools) -> float:
    """Sideways distance of the lowest point of touching links, over the centre's distance."""
    header = record.header
    pose = record.pose
    if header.world.ground.kind != "flat" or header.world.obstacle is not None:
        return float("nan")
    links = pose.links_m[steady]
    centre = pose.centre_m[steady]
    joints = record.cycle.measured_rad[np.searchsorted(record.cycle.time_s, pose.time_s[steady])]
    frames = _link_rotations(header.robot, pose.rotation[steady], joints)
    # the turn from one cycle to the next as a vector: half the skew part of R' R^T, for small turns
    turned = frames[1:] @ np.swapaxes(frames[:-1], -1, -2)
    skew = 0.5 * (turned - np.swapaxes(turned, -1, -2))
    turn = np.stack([skew[..., 2, 1], skew[..., 0, 2]], axis=-1)
    radius_m = np.array(header.robot.link_radii_m)
    # v + w x (-r z): the point under the centre
    rolled = np.stack([-turn[..., 1], turn[..., 0]], -1)
    move = np.diff(links[..., :2], axis=0) + radius_m[:, None] * rolled
    forward = frames[:-1, :, :2, 0]
    across = np.abs(forward[..., 0] * move[..., 1] - forward[..., 1] * move[..., 0])
    bears = np.array([shape != "none" for shape in header.robot.link_shapes])
    touches = bears & (links[:-1, :, 2] < radius_m + CLEAR_M)
    slid_m = float((across * touches).sum()) / links.shape[1]
    displacement_m = float(np.linalg.norm((centre[-1] - centre[0])[:2]))
    return slid_m / displacement_m if displacement_m > 1e-3 else float("nan")


def _link_rotations(robot: RobotConfig, head: Floats, joint_rad: Floats) -> Floats:
    """(T, L, 3, 3) axes of all links from the head's (T, 3, 3) and joint angles (T, J)."""
    poses = (BodyPose(0.0, np.zeros(3), rotation) for rotation in head)
    bodies = (body_in_world(robot, *row) for row in zip(poses, joint_rad, strict=True))
    return np.array([body.rotation for body in bodies])
