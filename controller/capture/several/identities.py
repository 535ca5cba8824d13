"""Identities of several animals: which tracklets belong to the same animal.

Ends of tracklets are assigned to later starts at least cost (linear assignment; gap closing as in
u-track, Jaqaman et al. 2008, Nature Methods 5:695). The cost compares the motion before and after
the gap, and the shape: length, width and contrast. An assignment is uncertain if an exchange with
another animal costs hardly more.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.several.tracklets import Tracklet, linked_groups

SURE = 10.0
"""Additional cost of the best exchange from which an assignment is certain (ours; measured on
rendered crossings, seeds 500 to 519)."""
_MOTION_FRAMES = 8  # frames of a tracklet next to a gap that say how the animal moves
_PLACE = 0.06  # of the length: error of a predicted place, in addition to that of its motion
_TURNS = 0.3  # of the distance travelled in the gap: error of a predicted place
_LEAST_SPREAD = (0.03, 0.05, 0.03)  # of the logarithms of length, width and contrast
_CORRELATED_FRAMES = 10.0  # frames whose shapes differ from the animal's usual one in the same way
_MOST_GAP = 30  # frames for which an animal without a crossing may be unseen
_REACH = 1.0  # body lengths that it may move while it is unseen
_LARGEST_COST = 60.0  # cost of ending a tracklet that was not seen to enter a crossing
_CROSSING = 1e4  # cost of leaving a tracklet of a crossing without a successor
_ROUNDS = 3
_PERSISTS = 0.5  # of the film: how long an animal must be followed
_LEAST_SPAN = 0.25  # of the film: how long one must be alone that is in contact for the rest
_MOST_FRAMES = 2000  # frames that show an animal's shape


@dataclass(frozen=True, slots=True)
class Identity:
    """One animal of a film."""

    tracklets: tuple[Tracklet, ...]
    uncertain_after: tuple[int, ...]
    """Frames after which it may be another animal: the last one before a gap."""
    bridged: int
    """Gaps that were bridged, crossings or not."""

    @property
    def frames(self) -> int:
        """Frames in which the animal is alone."""
        return sum(len(tracklet.frames) for tracklet in self.tracklets)

    @property
    def span(self) -> int:
        """Frames from the first to the last one in which the animal is alone."""
        return self.tracklets[-1].frames[-1] + 1 - self.tracklets[0].frames[0]

    def is_animal(self, frames: int) -> bool:
        """Whether it is followed through half of a film of some frames, or into a last contact.

        An animal that is alone in a quarter of the film and then in contact until the end (or from
        the beginning) counts with its contact.
        """
        first, last = self.tracklets[0], self.tracklets[-1]
        span = self.span
        if span >= _LEAST_SPAN * frames:
            if last.ends_in is not None and first.begins_in is None:
                span = frames - first.frames[0]
            elif first.begins_in is not None and last.ends_in is None:
                span = last.frames[-1] + 1
        return span >= _PERSISTS * frames


@dataclass(frozen=True, slots=True)
class _Link:
    before: int
    after: int
    margin: float
    """Additional cost of the best exchange; infinite without another possibility."""


_Costs = dict[int, dict[int, float]]
"""Costs by the numbers of two tracklets, end and later start; a missing pair cannot be the same
animal."""


def identities_of(tracklets: Sequence[Tracklet]) -> list[Identity]:
    """All identities of a film; the one that is followed for most frames first."""
    links: list[_Link] = []
    for _ in range(_ROUNDS):
        links = _links(tracklets, links)
    after = {identity_link.before: identity_link for identity_link in links}
    later = {identity_link.after for identity_link in links}
    out = []
    for first in range(len(tracklets)):
        if first in later:
            continue
        chain = [tracklets[first]]
        unsure = []
        k = first
        while k in after:
            link = after[k]
            if link.margin < SURE:
                unsure.append(tracklets[k].frames[-1])
            k = link.after
            chain.append(tracklets[k])
        out.append(Identity(tuple(chain), tuple(unsure), len(chain) - 1))
    return sorted(out, key=lambda identity: -identity.span)


def _links(tracklets: Sequence[Tracklet], links: Sequence[_Link]) -> list[_Link]:
    """Assign ends to starts; shapes are those of all tracklets that certain links join."""
    cost = _costs(tracklets, links)
    out = []
    pairs = np.array([(old, new) for old, starts in cost.items() for new in starts], dtype=int)
    for olds, news in linked_groups(*pairs.reshape(-1, 2).T):
        old_indices, new_indices = olds.tolist(), news.tolist()
        some = np.array(
            [[cost[old].get(new, np.inf) for new in new_indices] for old in old_indices]
        )
        least = min(_LARGEST_COST, _CROSSING)
        alone = np.array(
            [_CROSSING if tracklets[k].ends_in is not None else least for k in old_indices]
        )
        for row, column in _assigned_pairs(some, alone):
            margin = _margin(some, row, column, _assigned_pairs(some, alone), alone)
            out.append(_Link(old_indices[row], new_indices[column], margin))
    return out


def _assigned_pairs(cost: Floats, alone: Floats) -> list[tuple[int, int]]:
    """Pairs (row, column) of least cost; a row may stay alone at a cost of its own."""
    rows, columns = cost.shape
    padded_cost = np.full((rows, columns + rows), 1e9)
    padded_cost[:, :columns] = np.where(np.isfinite(cost), cost, 1e9)
    padded_cost[np.arange(rows), columns + np.arange(rows)] = alone
    pairs = zip(*linear_sum_assignment(padded_cost), strict=True)
    return [(int(r), int(c)) for r, c in pairs if c < columns and np.isfinite(cost[r, c])]


def _margin(
    cost: Floats, row: int, column: int, pairs: list[tuple[int, int]], alone: Floats
) -> float:
    """Additional cost if the animal of a row continued elsewhere: exchanged, or in a free start."""
    best = float("inf")
    taken = {c for _, c in pairs}
    for other, other_column in pairs:
        if other != row:
            swapped = cost[row, other_column] + min(cost[other, column], 1e9)
            best = min(best, float(swapped - cost[row, column] - cost[other, other_column]))
    for column_index in range(cost.shape[1]):
        if column_index not in taken:
            best = min(best, float(cost[row, column_index] - cost[row, column]))
    for other in set(range(cost.shape[0])) - {r for r, _ in pairs}:
        if np.isfinite(cost[other, column]):
            best = min(best, float(cost[other, column] - cost[row, column]))
    return best


def _later_starts(tracklets: Sequence[Tracklet]) -> Iterator[tuple[int, int]]:
    """Pairs of an end and a later start in the same crossing or soon after."""
    begins: dict[int | None, list[int]] = {}
    for k, tracklet in enumerate(tracklets):
        begins.setdefault(tracklet.begins_in, []).append(k)
    first = np.array([tracklet.frames[0] for tracklet in tracklets])
    order = np.argsort(first, kind="stable")
    for k, earlier_tracklet in enumerate(tracklets):
        last = earlier_tracklet.frames[-1]
        low, high = np.searchsorted(first[order], (last + 1, last + _MOST_GAP + 1)).tolist()
        near = set(order[low:high].tolist())
        if earlier_tracklet.ends_in is not None:
            near |= {j for j in begins.get(earlier_tracklet.ends_in, ()) if first[j] > last}
        for j in sorted(near):
            yield k, j


def _costs(tracklets: Sequence[Tracklet], links: Sequence[_Link]) -> _Costs:
    """Cost of each start as the continuation of an end."""
    cost: _Costs = {}
    if not tracklets:
        return cost
    spread = _spread(tracklets)
    length = float(
        np.exp(np.median([np.median(tracklet.shapes, axis=0)[0] for tracklet in tracklets]))
    )
    before, after = _shapes(tracklets, links)
    out = [_motion(tracklet, last=True) for tracklet in tracklets]
    into = [_motion(tracklet, last=False) for tracklet in tracklets]
    speed = float(np.median([np.hypot(*velocity) for _, velocity in (*out, *into)]))
    for i, j in _later_starts(tracklets):
        old, new = tracklets[i], tracklets[j]
        gap = new.frames[0] - old.frames[-1]
        if not _may_follow(old, new, gap, out[i][0], into[j][0], length):
            continue
        (place, velocity), (later, velocity_later) = out[i], into[j]
        moved = max(speed, 0.5 * float(np.hypot(*velocity) + np.hypot(*velocity_later)))
        error = _PLACE * length + _TURNS * moved * gap
        off = (
            np.sum((place + gap * velocity - later) ** 2)
            + np.sum((later - gap * velocity_later - place) ** 2)
        ) / 2.0
        (mean, number), (mean_later, number_later) = before[i], after[j]
        variance = spread**2 * _CORRELATED_FRAMES * (1.0 / number + 1.0 / number_later)
        variance = np.minimum(variance, 4.0 * spread**2) + np.square(_LEAST_SPREAD)
        shape = float(np.sum((mean - mean_later) ** 2 / variance))
        cost.setdefault(i, {})[j] = float(off) / error**2 + shape
    return cost


def _may_follow(
    old: Tracklet, new: Tracklet, gap: int, place: Floats, later: Floats, length: float
) -> bool:
    if old.ends_in is not None and new.begins_in is not None:
        return old.ends_in == new.begins_in
    near = float(np.hypot(*(later - place))) < _REACH * length
    return gap <= _MOST_GAP and near


def _spread(tracklets: Sequence[Tracklet]) -> Floats:
    """(3,) usual spread of an animal's shape from frame to frame."""
    deviations = [
        np.abs(tracklet.shapes - np.median(tracklet.shapes, axis=0))
        for tracklet in tracklets
        if len(tracklet.frames) >= _MOTION_FRAMES
    ]
    if not deviations:
        return np.array(_LEAST_SPREAD)
    return np.asarray(1.4826 * np.median(np.concatenate(deviations), axis=0))


def _shapes(
    tracklets: Sequence[Tracklet], links: Sequence[_Link]
) -> tuple[list[tuple[Floats, int]], list[tuple[Floats, int]]]:
    """Shape and number of frames of each animal up to each tracklet, and from it on."""
    earlier = {link.after: link.before for link in links if link.margin >= SURE}
    later = {link.before: link.after for link in links if link.margin >= SURE}
    return (
        [_shape_along(tracklets, k, earlier) for k in range(len(tracklets))],
        [_shape_along(tracklets, k, later) for k in range(len(tracklets))],
    )


def _shape_along(
    tracklets: Sequence[Tracklet], k: int, following: dict[int, int]
) -> tuple[Floats, int]:
    shapes = [tracklets[k].shapes]
    number = len(tracklets[k].frames)
    while k in following and number < _MOST_FRAMES:
        k = following[k]
        shapes.append(tracklets[k].shapes)
        number += len(tracklets[k].frames)
    return np.median(np.concatenate(shapes), axis=0), number


def _motion(tracklet: Tracklet, *, last: bool) -> tuple[Floats, Floats]:
    """Place at the end or start of a tracklet, px, and velocity there, px a frame."""
    some = slice(-_MOTION_FRAMES, None) if last else slice(None, _MOTION_FRAMES)
    places = tracklet.middles[some]
    end = places[-1] if last else places[0]
    if len(places) < 2:
        return end, np.zeros(2)
    time = np.array(tracklet.frames[some], dtype=float)
    time -= time.mean()
    velocity = (time[:, None] * (places - places.mean(axis=0))).sum(axis=0) / (time**2).sum()
    return end, np.asarray(velocity)
