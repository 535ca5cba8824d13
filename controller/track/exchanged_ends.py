"""Frames in which a tracker took the tail for the head, put right by the frames before them.

Such a body lies where the one before lay, but the other way round. An animal that turns does not.
"""

from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Bools, Floats, Ints

_SAMPLES = 16  # points along a body at which two frames are compared
_CLEARLY = 0.5  # a body that runs the other way is nearer reversed, by this factor at least
_STILL_SHARE = 0.02  # of the body's length: as much may it move between frames that are compared
_USUAL_MOTIONS = 5.0  # times the median motion between frames, likewise
_GAP = 3  # missing frames after which the place says nothing
_SHORTER_SHARE = (
    0.7  # of its length, by which a polyline ends where labels of the ends are exchanged
)
_UNSURE = 0.4  # share of exchanged frames from which the majority is not clear


def with_ends_in_place(points: Floats, number: Ints) -> tuple[Floats, tuple[str, ...]]:
    """Turn round the frames whose ends were exchanged.

    Args:
        points: (T, P, 2) whole bodies, head first.
        number: (T,) their frame numbers.

    Returns:
        The points, and a line on each kind of exchange that was found.

    """
    if len(points) < 2 or points.shape[1] < 2:
        return points, ()
    notes = []
    points = points.copy()
    labels = _exchanged_labels(points)
    points[labels] = _with_ends_exchanged(points[labels])
    if labels.any():
        notes.append(
            f"only the end points were exchanged in {_frames(labels, number)}; put in place"
        )
    bodies = _exchanged_bodies(points, number)
    points[bodies] = points[bodies, ::-1]
    if bodies.any():
        notes.append(
            f"head and tail were exchanged in {_frames(bodies, number)}, where the body lies as in "
            "the frame before, but the other way round; turned to the direction of the others"
        )
    if bodies.mean() > _UNSURE:
        notes.append(
            f"the head may be the other end: {bodies.mean():.0%} of the frames contradict the "
            "others; correct the labels"
        )
    return points, tuple(notes)


def _exchanged_labels(points: Floats) -> Bools:
    """(T,) frames whose polyline becomes much shorter with its end points exchanged."""
    one_length, other_length = (
        np.hypot(*np.diff(labelled_points, axis=1).transpose(2, 0, 1)).sum(axis=1)
        for labelled_points in (points, _with_ends_exchanged(points))
    )
    return np.asarray(other_length < _SHORTER_SHARE * one_length)


def _with_ends_exchanged(points: Floats) -> Floats:
    return np.concatenate([points[:, -1:], points[:, 1:-1], points[:, :1]], axis=1)


def _exchanged_bodies(points: Floats, number: Ints) -> Bools:
    """(T,) frames that run against most of the others, between gaps."""
    step = np.hypot(*np.diff(points, axis=1).transpose(2, 0, 1))
    length = float(np.median(step.sum(axis=1)))
    bodies = np.stack(
        [_resampled_body(*body_and_step) for body_and_step in zip(points, step, strict=True)]
    )
    same_order = _distance(bodies[1:], bodies[:-1])
    reverse = _distance(bodies[1:, ::-1], bodies[:-1])
    moved = np.minimum(same_order, reverse)
    near = reverse <= max(_USUAL_MOTIONS * float(np.median(moved)), _STILL_SHARE * length)
    changes = np.concatenate([[False], near & (reverse < _CLEARLY * same_order)])
    against = np.cumsum(changes) % 2 == 1
    gaps = np.flatnonzero(np.diff(number) > _GAP) + 1
    for first, end in pairwise((0, *gaps.tolist(), len(points))):
        part = against[first:end]
        if part.mean() > 0.5:
            part[:] = ~part
    return np.asarray(against)


def _resampled_body(body: Floats, step: Floats) -> Floats:
    """``_SAMPLES`` points (S, 2) evenly along the polyline through (P, 2) with steps (P - 1,)."""
    along = np.concatenate([[0.0], np.cumsum(step)])
    station = np.linspace(0.0, along[-1], _SAMPLES)
    return np.stack([np.interp(station, along, axis) for axis in body.T], axis=-1)


def _distance(first: Floats, other: Floats) -> Floats:
    """(T,) root of the mean square distance of the points of bodies (T, S, 2)."""
    return np.asarray(np.sqrt(((first - other) ** 2).sum(axis=2).mean(axis=1)))


def _frames(which: Bools, number: Ints) -> str:
    """``"120 of 400 frames, the first of them 18"``."""
    return (
        f"{which.sum()} of {len(which)} frames, the first of them frame {number[np.argmax(which)]}"
    )
