"""The prototype: an animal with legs on a straight line over level ground ([KP] 4.2.2).

The body bends in a standing wave with its nodes at the girdles, each turned furthest when its legs
are; the head keeps its heading. A foot on the ground stays where it is. The feet of [GC] Eq. 9-10
as printed are ``printed_feet``. The height of the body follows from the legs.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.animal import AnimalConfig, LegPairConfig
from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.gaits.footfall import lift, swing
from snakewalk.controller.gaits.wave import TURN

SEGMENTS = 24
"""Number of segments of the spine."""
LEGS = ("front left", "front right", "hind left", "hind right")
_SIDES = np.array([1.0, -1.0])
_STRAIGHTENS = 0.06
"""Share of the body's length over which the heading changes from the head's to the body's."""
_TAIL_WAVES = 0.5
"""Waves on the tail, where it swings."""


@dataclass(frozen=True, slots=True)
class Prototype:
    """T frames; x along the line, y to its left, z above the ground, m."""

    time_s: Floats
    """(T,) times of the frames, s."""
    spine_m: Floats
    """(T, SEGMENTS + 1, 3) points of the spine, head first, m."""
    hip_m: Floats
    """(T, 4, 3) in the order of ``LEGS``."""
    foot_m: Floats
    """(T, 4, 3) positions of the feet, m."""
    on_ground: Bools
    """(T, 4) the time chart of contacts ([KP] Fig. 13)."""
    air: Floats
    """(T, 4) share of a foot's time in the air that has passed, 0 on the ground."""


def prototype(animal: AnimalConfig, time_s: Floats) -> Prototype:
    """Move an animal along a line for frames (T,); its head's tip is at x = 0 at t = 0."""
    length_m = animal.length_m
    cycles = time_s / animal.cycle_s
    along = np.linspace(0.0, 1.0, SEGMENTS + 1)
    phase = [((cycles[:, None] - [pair.left, pair.right]) % 1.0) for pair in animal.leg_pairs]
    foot = []
    hip = []
    contact = []
    air = []
    high = []
    for pair, pair_phase in zip(animal.leg_pairs, phase, strict=True):
        ahead, rise, on = footfall(animal, pair, pair_phase)
        high.append(_ride(animal, pair, ahead, pair_phase))
        air.append(
            np.where(on, 0.0, np.clip((pair_phase - pair.duty) / (1.0 - pair.duty), 0.0, 1.0))
        )
        if animal.feet == "gc-printed":
            ahead, rise, on = printed_feet(animal, pair, cycles)
        place = length_m * (pair.foot_ahead - pair.at) + animal.speed_m_s * time_s
        side = np.broadcast_to(_SIDES * pair.foot_side * length_m, pair_phase.shape)
        foot.append(np.stack([place[:, None] + ahead, side, rise], axis=-1))
        contact.append(on)
    spine = _spine_m(animal, time_s, np.stack(high, axis=1))
    for pair in animal.leg_pairs:
        turned = _spine_rad(animal, cycles, np.array([pair.at]))
        left = np.stack([-np.sin(turned), np.cos(turned), np.zeros_like(turned)], axis=-1)
        root = _points_along_body(spine, along, pair.at)[:, None] - [
            0.0,
            0.0,
            pair.hip_drop * length_m,
        ]
        hip.append(root + _SIDES[:, None] * pair.hip_side * length_m * left)
    return Prototype(
        time_s,
        spine,
        np.concatenate(hip, axis=1),
        np.concatenate(foot, axis=1),
        np.concatenate(contact, axis=1),
        np.concatenate(air, axis=1),
    )


def footfall(
    animal: AnimalConfig, pair: LegPairConfig, phase: Floats
) -> tuple[Floats, Floats, Bools]:
    """Feet ahead of the middle of their steps (...), above the ground (...), and on it (...).

    ``phase`` (...) are cycles since the foot came down, 0 to 1.
    """
    ahead_m = 0.5 * animal.stride * animal.length_m * pair.duty * swing(phase, pair.duty)
    return ahead_m, animal.length_m * pair.lift * lift(phase, pair.duty), phase < pair.duty


def printed_feet(
    animal: AnimalConfig, pair: LegPairConfig, cycles: Floats
) -> tuple[Floats, Floats, Bools]:
    """Left and right foot (T, 2) of a pair by [GC] Eq. 9-10 as printed.

    ``R_Fy = T_y (H + H_R) + H_RF`` and ``R_Fz = -T_z (L + L_R)``; the left foot has no minus sign.
    ``T_y = sin(omega t)`` is the same for both feet, so one of them goes forward while it is low.
    The paper leaves L and H open. Here L makes the right foot stand still at its lowest point, 2 H
    is the height of a step, and ``H_RF = H`` puts that point on the ground. H_R and L_R are 0. A
    foot counts as on the ground in the lower quarter of its height.
    """
    lowest = pair.right + 0.5 * pair.duty
    turn = TURN * (cycles - lowest) - 0.25 * TURN
    t_y, t_z = np.sin(turn), np.cos(turn)
    high_m = 0.5 * animal.length_m * pair.lift
    long_m = animal.stride * animal.length_m / TURN
    rise = np.repeat((t_y * high_m + high_m)[:, None], 2, axis=1)
    ahead = np.stack([t_z * long_m, -t_z * long_m], axis=-1)
    return ahead, rise, rise <= 0.5 * high_m


def _spine_m(animal: AnimalConfig, time_s: Floats, high_m: Floats) -> Floats:
    """(T, SEGMENTS + 1, 3) points whose girdles are (T, 2) high; segments keep their length."""
    segment_m = animal.length_m / SEGMENTS
    along = np.linspace(0.0, 1.0, SEGMENTS + 1)
    front, hind = (pair.at for pair in animal.leg_pairs)
    share = np.clip((along - front) / (hind - front), 0.0, 1.0)
    z = high_m[:, :1] + (high_m[:, 1:] - high_m[:, :1]) * share
    angle = _spine_rad(animal, time_s / animal.cycle_s, 0.5 * (along[1:] + along[:-1]))
    level_m = np.sqrt(segment_m**2 - np.diff(z, axis=1) ** 2)
    steps = level_m[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    plan = np.concatenate([np.zeros((len(time_s), 1, 2)), -np.cumsum(steps, axis=1)], axis=1)
    plan -= (
        0.5
        * (_points_along_body(plan, along, front) + _points_along_body(plan, along, hind))[:, None]
    )
    middle_m = animal.speed_m_s * time_s - 0.5 * animal.length_m * (front + hind)
    plan[..., 0] += middle_m[:, None]
    return np.concatenate([plan, z[..., None]], axis=-1)


def spine_shares(girdle_places: tuple[float, float], along: Floats) -> Floats:
    """(S, 2) of the front and the hind girdle's turn in the headings of segments between places.

    Args:
        girdle_places: places of the girdles along the body.
        along: (S + 1,) of the segments' ends.

    """
    fine = along[:-1, None] + np.diff(along)[:, None] * (np.arange(8) + 0.5) / 8.0
    return np.asarray(_girdle_shares(girdle_places, fine).mean(axis=1))


def _girdle_shares(girdle_places: tuple[float, float], along: Floats) -> Floats:
    """(..., 2) of the girdles' turns in the heading of the spine at places (...)."""
    front, hind = girdle_places
    share = 0.5 * (1.0 - np.cos(np.pi * np.clip((along - front) / (hind - front), 0.0, 1.0)))
    beyond = np.maximum(front - along, 0.0) + np.maximum(along - hind, 0.0)
    fades = np.exp(-beyond / _STRAIGHTENS)
    return np.stack([(1.0 - share) * fades, share * fades], axis=-1)


def _spine_rad(animal: AnimalConfig, cycles: Floats, along: Floats) -> Floats:
    """(T, S) headings of the spine at places along it.

    A girdle is turned to the right furthest when its left foot comes down.
    """
    front, hind = animal.leg_pairs
    turned = np.stack(
        [-pair.turn_rad * np.cos(TURN * (cycles - pair.left)) for pair in animal.leg_pairs], axis=-1
    )
    tail = np.maximum(along - hind.at, 0.0) / (1.0 - hind.at)
    swung = (
        animal.tail_swing_rad
        * tail
        * np.sin(TURN * (cycles[:, None] - hind.left - _TAIL_WAVES * tail))
    )
    return turned @ _girdle_shares((front.at, hind.at), along).T + swung


def _ride(animal: AnimalConfig, pair: LegPairConfig, ahead_m: Floats, phase: Floats) -> Floats:
    """(T,) height of the body over a pair of legs: mean of the feet on the ground, and vault.

    A foot that comes down or leaves supports little. When one foot replaces the other, both are
    equally far from the hip, so the height has no step.
    """
    height_m = animal.height * animal.length_m
    bears = np.where(
        phase < pair.duty, np.sin(np.pi * np.clip(phase / pair.duty, 0.0, 1.0)) + 1e-9, 0.0
    )
    fall = np.sqrt(np.maximum(height_m**2 - ahead_m**2, 0.0)) - height_m
    total = bears.sum(axis=1)
    share = np.divide(bears, total[:, None], where=total[:, None] > 0.0, out=np.zeros_like(bears))
    return np.asarray(height_m + animal.vault * (share * fall).sum(axis=1))


def _points_along_body(points: Floats, along: Floats, place: float) -> Floats:
    """(T, D) of points (T, S + 1, D) at a place along the body."""
    k = min(int(np.searchsorted(along, place, side="right")) - 1, len(along) - 2)
    share = (place - along[k]) / (along[k + 1] - along[k])
    return np.asarray(points[:, k] + share * (points[:, k + 1] - points[:, k]))
