"""A walk and a run of a person: poses by sines and cosines, legs from the feet ([GC] 2.2.2).

Eq. 9 and 10 place the feet, and inverse kinematics gives hips, knees and ankles. The pelvis keeps
the height at which both legs reach their feet. Turns of pelvis, chest and arms are sines of the
cycle; their amplitudes, and the pitch of the feet, are ours.

The feet of a cycle by [GC] Eq. 9 and 10: as printed, with separate phases, and planted.

    T_y = sin(w t),  T_z = cos(w t);   R_Fy = T_y (H + H_R) + H_RF,  R_Fz = -T_z (L + L_R)

The left foot has no minus sign. As printed both feet use one ``T_y``: both are in the air at the
same time, and the left one travels backwards while it is lifted. Each foot is also below its
initial height for half of the cycle.

``FeetLaw.PHASES`` delays the left foot's height by half a cycle, and stops both feet at the ground.
``FeetLaw.PLANTED`` also chooses the share of the cycle on the ground, where a foot keeps its place.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.legged.leg import triangle_m
from snakewalk.controller.animals.people.feet_law import FeetLaw, MotionName
from snakewalk.controller.animals.people.skeleton import (
    ABDUCTION_RAD,
    BALL,
    HEEL,
    INDEX,
    PersonSkeleton,
)
from snakewalk.controller.gaits import footfall
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.track.bone_motion import BoneMotion


@dataclass(frozen=True, slots=True)
class FootParameters:
    """Parameters of Eq. 10, metres; those of one foot are zero by default, as in the paper."""

    height_m: float
    """Height H of a step."""
    length_m: float
    """L, half the length of a step over the trunk."""
    duty: float
    """Share of a cycle on the ground, of planted feet (ours)."""
    right_height_m: float = 0.0
    """Step height H_R of the right foot."""
    left_height_m: float = 0.0
    right_initial_m: float = 0.0
    """Initial height H_RF of the right foot."""
    left_initial_m: float = 0.0
    right_length_m: float = 0.0
    """Step length L_R of the right foot."""
    left_length_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Feet:
    """Ways of the left and the right foot over T moments; index 0 is the left foot."""

    ahead_m: Floats
    """(T, 2) ahead of the trunk, z of the paper."""
    height_m: Floats
    """(T, 2) over the ground, y of the paper."""
    at: Floats
    """(T, 2) cycles since each foot came down, 0 to 1."""
    on_ground: Floats
    """(T, 2) 1 for a foot on the ground, 0 for a foot in the air."""
    duty: float
    """Share of a cycle in which a foot is on the ground."""


def feet(law: FeetLaw, given: FootParameters, phase: Floats) -> Feet:
    """Return the feet at phases (T,) of the cycle, ``w t`` in cycles."""
    wt = TURN * np.asarray(phase, dtype=float)
    high = given.height_m + np.array([given.left_height_m, given.right_height_m])
    low = np.array([given.left_initial_m, given.right_initial_m])
    half = given.length_m + np.array([given.left_length_m, given.right_length_m])
    # a foot comes down where its way along z turns back: at w t = pi the right one, at 0 the left
    down = np.array([0.0, 0.5])
    foot_phase = (np.asarray(phase)[:, None] - down) % 1.0
    if law is FeetLaw.PLANTED:
        ahead = half * footfall.swing(foot_phase, given.duty)
        air = np.clip((foot_phase - given.duty) / (1.0 - given.duty), 0.0, 1.0)
        # Eq. 9 runs from 0 to pi in the air
        height = np.maximum(high * np.sin(0.5 * TURN * air) + low, 0.0)
        return Feet(ahead, height, foot_phase, (foot_phase < given.duty).astype(float), given.duty)
    ahead = half * np.stack([np.cos(wt), -np.cos(wt)], axis=-1)
    if law is FeetLaw.PRINTED:
        height = high * np.sin(wt)[:, None] + low
    else:
        height = np.maximum(high * np.stack([-np.sin(wt), np.sin(wt)], axis=-1) + low, 0.0)
    return Feet(ahead, height, foot_phase, (height <= low).astype(float), 0.5)


REACH = 0.998
"""Largest extension of a leg over its length (ours)."""
FRAMES = 24
"""Poses of a cycle ([GC] 3)."""


@dataclass(frozen=True, slots=True)
class PersonGait:
    """A cyclic motion of a person; lengths in shares of the stature, angles in degrees."""

    name: str
    cycle_s: float
    height: float
    """Step height H of Eq. 10."""
    length: float
    """Step length L of Eq. 10."""
    duty: float
    middle: float
    """Middle of the steps, ahead of the hips."""
    side: float
    """Distance of the feet from the middle plane."""
    bob: float
    """Rise of the pelvis over its mean; above 0 it is highest with the feet farthest apart."""
    lean: float
    """Pitch of the trunk, forward."""
    turn: float
    """Yaw of the pelvis to either side; the chest turns against it."""
    drop: float
    """Roll of the pelvis towards the foot in the air."""
    arm: tuple[float, float]
    """Mean of the upper arms, back above 0, and their swing to either side."""
    elbow: tuple[float, float]
    """Mean bend of the elbows, and its swing."""
    spread: float
    """Angle of the arms from the trunk."""
    pitch: tuple[tuple[float, float], ...]
    """Share of the cycle since a foot came down, and its pitch; above 0 the toes are up."""


WALK = PersonGait(
    name="walk", cycle_s=1.08, height=0.022, length=0.228, duty=0.62, middle=-0.046, side=0.036,
    bob=-0.0075, lean=2.0, turn=6.0, drop=3.5, arm=(4.0, 19.0), elbow=(17.0, 9.0), spread=8.0,
    pitch=((0.0, 18.0), (0.09, 0.0), (0.34, 0.0), (0.41, -0.7), (0.50, -10.0), (0.62, -58.0),
           (0.72, -46.0), (0.86, 2.0), (0.94, 17.0)),
)  # fmt: skip
"""A walk at 1.2 m/s. A foot is on the ground for 62 % of a cycle (Perry, Gait Analysis).

Middle, rise and pitch are fitted to the knee angles of the same book: the leg stretches behind the
hip until 50 % of a cycle, while the heel rises.
"""
RUN = PersonGait(
    name="run", cycle_s=0.72, height=0.060, length=0.215, duty=0.35, middle=-0.050, side=0.022,
    bob=0.020, lean=9.0, turn=8.0, drop=3.0, arm=(12.0, 34.0), elbow=(108.0, 14.0), spread=14.0,
    pitch=((0.0, 6.0), (0.05, 0.0), (0.16, 0.0), (0.26, -28.0), (0.35, -58.0), (0.50, -98.0),
           (0.66, -70.0), (0.82, -12.0), (0.93, 6.0)),
)  # fmt: skip
"""A run at 3 m/s: 35 % of a cycle on the ground."""
GAITS: dict[MotionName, PersonGait] = {"walk": WALK, "run": RUN}


@dataclass(frozen=True, slots=True)
class PersonMotion:
    """Bones of a person over T moments, and the feet."""

    bones: BoneMotion
    feet: Feet
    ankle_m: Floats
    """(T, 2, 3) the handles of the legs: left, right."""
    speed_m_s: float
    cycle_s: float


def animate(
    skeleton: PersonSkeleton,
    gait: PersonGait,
    law: FeetLaw = FeetLaw.PLANTED,
    *,
    cycles: int = 1,
    frames: int = FRAMES,
    in_place: bool = False,
) -> PersonMotion:
    """Return whole cycles of a gait; the last pose repeats the first, farther ahead.

    ``frames`` is the number of poses in a cycle; ``in_place`` is a walk on the spot.

    Raises:
        InputError: fewer than one cycle, or fewer than four poses in it.

    """
    if cycles < 1 or frames < 4:
        raise InputError("people: a motion needs one cycle or more, of four poses or more")
    size = skeleton.stature_m
    given = FootParameters(size * gait.height, size * gait.length, gait.duty)
    phase = np.arange(cycles * frames + 1) / frames
    foot_paths = feet(law, given, phase)
    speed_m_s = 2.0 * given.length_m / foot_paths.duty / gait.cycle_s
    time_s = phase * gait.cycle_s
    travel_m = np.zeros_like(time_s) if in_place else speed_m_s * time_s
    pitch, toes = _foot_pitch(gait, foot_paths)
    ankle_m = _ankles(skeleton, gait, foot_paths, pitch)
    pelvis, chest = _trunk_turns(gait, phase)
    hips = _hips(skeleton, pelvis)
    pelvis_m = _pelvis(skeleton, gait, phase, ankle_m, hips)
    shift = travel_m[:, None] * [1.0, 0.0, 0.0]
    pelvis_m += shift
    ankle_m += shift[:, None]
    turn = _turns(skeleton, gait, phase, (pelvis, chest), (pitch, toes))
    front = _joints(skeleton, pelvis_m, turn, ankle_m)
    bones = BoneMotion(time_s, front, turn, skeleton.length_m)
    return PersonMotion(bones, foot_paths, ankle_m, speed_m_s, gait.cycle_s)


def scaled(
    gait: PersonGait, height: float, length: float, cycle_s: float | None = None
) -> PersonGait:
    """Return a gait with other steps: factors on H and L, and another duration of the cycle."""
    return replace(
        gait,
        height=height * gait.height,
        length=length * gait.length,
        cycle_s=gait.cycle_s if cycle_s is None else cycle_s,
    )


def _foot_pitch(gait: PersonGait, foot_paths: Feet) -> tuple[Floats, Floats]:
    """(T, 2) pitch of feet and of toes, radians, toes up above 0."""
    place, angle = np.array(gait.pitch).T
    # the keys belong to the gait's duty; they stretch to that of the law
    place = np.where(
        place <= gait.duty,
        place / gait.duty * foot_paths.duty,
        1.0 - (1.0 - place) / (1.0 - gait.duty) * (1.0 - foot_paths.duty),
    )
    around = PchipInterpolator(
        np.concatenate([place - 1.0, place, place + 1.0]), np.radians(np.tile(angle, 3))
    )
    pitch = around(foot_paths.at)
    air = np.clip((foot_paths.at - foot_paths.duty) / (1.0 - foot_paths.duty), 0.0, 1.0)
    straight = np.clip(air / 0.45, 0.0, 1.0)
    straight = straight**2 * (3.0 - 2.0 * straight)
    return pitch, np.maximum(pitch, 0.0) + straight * np.minimum(pitch, 0.0)


def _ankles(skeleton: PersonSkeleton, gait: PersonGait, foot_paths: Feet, pitch: Floats) -> Floats:
    """(T, 2, 3) ankles: the foot rolls over heel and ball."""
    size = skeleton.stature_m
    high = float(skeleton.joint_m[INDEX["left foot"], 2])
    pivot = size * np.where(pitch > 0.0, HEEL, BALL)
    back = -pivot
    up = np.full_like(pivot, high)
    x = foot_paths.ahead_m + size * gait.middle + pivot + back * np.cos(pitch) - up * np.sin(pitch)
    z = foot_paths.height_m + back * np.sin(pitch) + up * np.cos(pitch)
    y = np.broadcast_to(size * gait.side * np.array([1.0, -1.0]), x.shape)
    return np.stack([x, y, z], axis=-1)


def _trunk_turns(gait: PersonGait, phase: Floats) -> tuple[Floats, Floats]:
    """(T, 3, 3) turns of pelvis and chest; the left foot comes down at phase 0."""
    wave = np.cos(TURN * phase)
    quarter = np.sin(TURN * phase)
    yaw = -gait.turn * wave
    roll = gait.drop * quarter
    lean = np.full_like(phase, gait.lean)
    pelvis = Rotation.from_euler("ZYX", np.stack([yaw, 0.5 * lean, roll], -1), degrees=True)
    chest = Rotation.from_euler("ZYX", np.stack([-yaw, lean, -0.3 * roll], -1), degrees=True)
    return pelvis.as_matrix(), chest.as_matrix()


def _hips(skeleton: PersonSkeleton, pelvis: Floats) -> Floats:
    """(T, 2, 3) hips, from the pelvis."""
    rest = skeleton.joint_m
    local = rest[[INDEX["left thigh"], INDEX["right thigh"]]] - rest[INDEX["pelvis"]]
    return np.asarray(np.einsum("tij,kj->tki", pelvis, local))


def _pelvis(
    skeleton: PersonSkeleton, gait: PersonGait, phase: Floats, ankle_m: Floats, hips: Floats
) -> Floats:
    """(T, 3) the pelvis, with two rises and one sway in a cycle."""
    size = skeleton.stature_m
    sway = 0.012 * size * np.sin(TURN * phase)
    flat = hips + np.stack([np.zeros_like(sway), sway, np.zeros_like(sway)], -1)[:, None]
    leg_m = REACH * float(
        skeleton.length_m[INDEX["left thigh"]] + skeleton.length_m[INDEX["left shank"]]
    )
    away = ankle_m - flat
    up = np.sqrt(np.maximum(leg_m**2 - (away[..., :2] ** 2).sum(axis=-1), 0.0))
    bob = gait.bob * size * np.cos(2.0 * TURN * (phase - 0.5 * (1.0 - gait.duty) * (gait.bob > 0)))
    most = (away[..., 2] + up).min(axis=1) - bob
    return np.stack([np.zeros_like(bob), sway, most.min() + bob], axis=-1)


def _turns(
    skeleton: PersonSkeleton,
    gait: PersonGait,
    phase: Floats,
    trunk: tuple[Floats, Floats],
    feet_rad: tuple[Floats, Floats],
) -> Floats:
    """(T, K, 3, 3) turns of the bones, without the legs: ``_joints`` adds them."""
    (pelvis, chest), (pitch, toes) = trunk, feet_rad
    frames = len(phase)
    turn = np.tile(np.eye(3), (frames, len(skeleton.parent), 1, 1))
    turn[:, 0] = pelvis
    pair = Rotation.from_matrix(np.stack([pelvis, chest], axis=1).reshape(-1, 3, 3))
    vectors = pair.as_rotvec().reshape(frames, 2, 3).mean(axis=1)
    turn[:, INDEX["waist"]] = Rotation.from_rotvec(vectors).as_matrix()
    turn[:, INDEX["chest"]] = chest
    half = Rotation.from_matrix(chest).as_rotvec() * 0.4
    turn[:, INDEX["neck"]] = Rotation.from_rotvec(half).as_matrix()
    for k, side in enumerate(("left", "right")):
        turn[:, INDEX[f"{side} foot"]] = _pitch_rotations(pitch[:, k])
        turn[:, INDEX[f"{side} toes"]] = _pitch_rotations(toes[:, k])
        for name, arm_turn in zip(
            ("upper arm", "forearm", "hand"), _arm(gait, phase, k), strict=True
        ):
            turn[:, INDEX[f"{side} {name}"]] = chest @ arm_turn
    return turn


def _joints(skeleton: PersonSkeleton, pelvis_m: Floats, turn: Floats, ankle_m: Floats) -> Floats:
    """(T, K, 3) joints; writes the turns of thighs and shanks by inverse kinematics."""
    rest = skeleton.joint_m
    parent = skeleton.parent
    frames = len(pelvis_m)
    front = np.empty((frames, len(rest), 3))
    front[:, 0] = pelvis_m
    legs = {INDEX[f"{side} {part}"] for side in ("left", "right") for part in ("shank", "foot")}
    for k in range(1, len(rest)):
        if k in legs:
            continue
        offset = rest[k] - rest[parent[k]]
        front[:, k] = front[:, parent[k]] + turn[:, parent[k]] @ offset
        if k in (INDEX["left thigh"], INDEX["right thigh"]):
            side = 0 if k == INDEX["left thigh"] else 1
            thigh = np.full(frames, skeleton.length_m[k], np.complex128)
            ahead = np.broadcast_to([1.0, 0.0, 0.0], (frames, 3))
            _, knee, ankle = triangle_m(
                front[:, k], ankle_m[:, side], ahead, [thigh], float(skeleton.length_m[k + 1]), []
            )
            front[:, k + 1], front[:, k + 2] = knee, ankle
            turn[:, k] = _hanging(knee - front[:, k])
            turn[:, k + 1] = _hanging(ankle - knee)
    return front


def _arm(gait: PersonGait, phase: Floats, side: int) -> tuple[Floats, Floats, Floats]:
    """(T, 3, 3) turns of upper arm, forearm and hand in the chest; side 0 is the left."""
    sign = 1.0 - 2.0 * side
    # an arm swings back with the leg of its side ahead
    wave = sign * np.cos(TURN * phase)
    hang = np.full_like(wave, sign * (gait.spread - np.degrees(ABDUCTION_RAD)))
    bend = gait.elbow[1] * wave - gait.elbow[0]
    swing = np.stack([gait.arm[0] + gait.arm[1] * wave, hang], axis=-1)
    upper = Rotation.from_euler("YX", swing, degrees=True)
    fore = upper * Rotation.from_euler("Y", bend[:, None], degrees=True)
    hand = fore * Rotation.from_euler("Y", -10.0, degrees=True)
    return upper.as_matrix(), fore.as_matrix(), hand.as_matrix()


def _pitch_rotations(angle: Floats) -> Floats:
    """(T, 3, 3) turns about the left axis; above 0 the front rises."""
    return Rotation.from_euler("Y", -angle[:, None]).as_matrix()


def _hanging(down: Floats) -> Floats:
    """(T, 3, 3) turns of a bone that hangs along -z at rest, with its front ahead."""
    z = -down / np.linalg.norm(down, axis=1, keepdims=True)
    y = np.cross(z, np.broadcast_to([1.0, 0.0, 0.0], z.shape))
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([np.cross(y, z), y, z], axis=-1)
