"""Tracklets: consecutive frames in which a blob is one animal; and the crossings between them.

Blobs of consecutive frames that share pixels are linked. Where several blobs become one, or one
becomes several, a crossing lies between the tracklets, and only ``identities`` says which
tracklets belong to the same animal.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from snakewalk.config.arrays import Bools, Floats, Indices, Int32s
from snakewalk.controller.capture.several.blobs import Blobs

_LEAST_OVERLAP = 0.15  # of the smaller blob's pixels: the blobs show the same animal
_SAME_OVERLAP = 0.5  # of the smaller blob's pixels: for sure the same, whatever else is shared
_SINGLE_AREA_RATIO = (0.65, 1.5)  # of the tracklet's area: the blob is still that animal alone
_JOINED_AREA = 1.6  # of the usual area: the blob is more than one animal
_PART = 0.6  # of the usual area: the blob is a part of an animal
_REACH = 0.6  # of the body's length: how far a blob without shared pixels may have moved
_MOST_SHAPES = 2000  # of a tracklet that are kept
_FEWEST = 3  # frames; shorter tracklets between crossings belong to the crossing


@dataclass(slots=True)
class Tracklet:
    """One animal alone, in consecutive frames."""

    begins_in: int | None
    """Crossing from which the tracklet comes; None: it appears."""
    ends_in: int | None = None
    """Crossing to which the tracklet goes; None: it vanishes."""
    first: int = 0
    """First frame of the tracklet; its frames have no gap."""
    blobs: "array[int]" = field(default_factory=lambda: array("H"))
    """Number of the blob in each of these frames, from 0."""
    area_px: float = 0.0
    """Running mean of the blob's area."""
    _middles: "array[float]" = field(default_factory=lambda: array("f"))
    _shapes: "array[float]" = field(default_factory=lambda: array("f"))
    _step: int = 1
    """Frames between two shapes that are kept."""

    def add(self, frame: int, blobs: Blobs, number: int) -> None:
        """Add the blob of the next frame."""
        self.place(frame, number, blobs.middle_px[number], blobs.shape[number])
        weight = 1.0 / min(len(self.blobs), 20)
        self.area_px += weight * (float(blobs.area_px[number]) - self.area_px)

    def place(self, frame: int, number: int, middle_px: Floats, shape: Floats) -> None:
        """Add the place (2,) and the shape (3,) of the blob of the next frame."""
        if not self.blobs:
            self.first = frame
        if len(self.blobs) % self._step == 0:
            self._shapes.extend(shape)
        self.blobs.append(number)
        self._middles.extend(middle_px)
        if len(self._shapes) > _MOST_SHAPES * len(shape):
            self._shapes = array("f", self.shapes[::2].ravel())
            self._step *= 2

    @property
    def frames(self) -> range:
        """Numbers of its frames."""
        return range(self.first, self.first + len(self.blobs))

    @property
    def middles(self) -> Floats:
        """(frames, 2) centroids, px."""
        return np.array(self._middles, dtype=float).reshape(-1, 2)

    @property
    def shapes(self) -> Floats:
        """(n, 3) ``Blobs.shape`` of frames at equal steps; of all frames of a short tracklet."""
        return np.array(self._shapes, dtype=float).reshape(-1, 3)


@dataclass(slots=True)
class _Crossing:
    """Animals in contact: a blob of several animals, or a part of one."""

    number: int
    count: int


_Node = Tracklet | _Crossing


@dataclass(slots=True)
class TrackletBuilder:
    """Makes tracklets of the blobs of a film, frame by frame."""

    usual_px: float
    """Usual area of an animal."""
    tracklets: list[Tracklet] = field(default_factory=list)
    _parents: list[int] = field(default_factory=list)
    _nodes: list[_Node] = field(default_factory=list)
    _previous_frame: Blobs | None = None
    _frame: int = 0

    def add(self, blobs: Blobs) -> None:
        """Link the blobs of the next frame to those of the frame before."""
        count = len(blobs.area_px)
        nodes: list[_Node | None] = [None] * count
        if self._previous_frame is not None and len(self._nodes):
            links = self._links(self._previous_frame, blobs)
            for old_indices, new_indices in linked_groups(*np.nonzero(links)):
                self._link(old_indices, new_indices, blobs, nodes)
        for number in range(count):
            if nodes[number] is None:
                nodes[number] = self._new_blob(blobs, number)
        self._nodes = [kept_node for kept_node in nodes if kept_node is not None]
        for number, node in enumerate(self._nodes):
            if isinstance(node, Tracklet):
                node.add(self._frame, blobs, number)
        self._previous_frame = blobs
        self._frame += 1

    def done(self) -> list[Tracklet]:
        """All tracklets, in order of their first frames; crossings have their final numbers."""
        kept = []
        for tracklet in self.tracklets:
            begins = tracklet.begins_in
            ends = tracklet.ends_in
            short = len(tracklet.frames) < _FEWEST
            if short and begins is not None and ends is not None:
                self._joined_crossing([begins, ends])
            elif not short or begins is not None or ends is not None:
                kept.append(tracklet)
        for kept_tracklet in kept:
            if kept_tracklet.begins_in is not None:
                kept_tracklet.begins_in = self._root(kept_tracklet.begins_in)
            if kept_tracklet.ends_in is not None:
                kept_tracklet.ends_in = self._root(kept_tracklet.ends_in)
        return sorted(kept, key=lambda kept_part: kept_part.frames[0])

    def _links(self, before: Blobs, blobs: Blobs) -> Bools:
        """(n, m) whether a blob of the frame before shows the same animal as one of this frame."""
        shared = _shared_pixels(before.label, blobs.label, len(before.area_px), len(blobs.area_px))
        smaller = np.minimum(before.area_px[:, None], blobs.area_px[None, :])
        part = shared / np.maximum(smaller, 1.0)
        links = part > _LEAST_OVERLAP
        for old, node in enumerate(self._nodes):
            if not isinstance(node, Tracklet) or not links[old].any():
                continue
            new = int(np.argmax(part[old]))
            alone = (
                _SINGLE_AREA_RATIO[0] < blobs.area_px[new] / node.area_px < _SINGLE_AREA_RATIO[1]
            )
            if alone and part[old, new] > _SAME_OVERLAP and int(np.argmax(part[:, new])) == old:
                near = part > _SAME_OVERLAP
                links[old] &= near[old] | (np.arange(links.shape[1]) == new)
                links[:, new] &= near[:, new] | (np.arange(links.shape[0]) == old)
        lost = np.asarray(~links.any(axis=1))
        fresh = np.asarray(~links.any(axis=0))
        if lost.any() and fresh.any():
            moved = before.middle_px[:, None] - blobs.middle_px[None]
            distance_px = np.hypot(moved[..., 0], moved[..., 1])
            reach = _REACH * np.exp(before.shape[:, :1])
            free: Bools = np.asarray(lost[:, None] & fresh[None, :] & (distance_px < reach))
            away: Floats = np.where(free, distance_px, np.inf)
            for lost_row in np.flatnonzero(free.any(axis=1)).tolist():
                nearest = int(np.argmin(away[lost_row]))
                if np.argmin(away[:, nearest]) == lost_row:
                    links[lost_row, nearest] = True
        return links

    def _link(
        self, old_indices: Indices, new_indices: Indices, blobs: Blobs, nodes: list[_Node | None]
    ) -> None:
        """Continue old nodes in the new blobs, which show the same animals."""
        before = [
            old_node for old in old_indices if not self._is_part(old_node := self._nodes[old])
        ]
        before = before or [self._nodes[old] for old in old_indices]
        if len(before) == len(new_indices) == 1:
            node = before[0]
            new = int(new_indices[0])
            area = float(blobs.area_px[new])
            if isinstance(node, Tracklet):
                if (
                    area < _SINGLE_AREA_RATIO[1] * max(node.area_px, 1.0)
                    or area < _SINGLE_AREA_RATIO[1] * self.usual_px
                ):
                    nodes[new] = node
                    return
            elif node.count > 1 or area < _PART * self.usual_px:
                nodes[new] = node
                return
        count = sum(1 if isinstance(old_node, Tracklet) else old_node.count for old_node in before)
        crossing = self._joined_crossing(
            [old_node.number for old_node in before if isinstance(old_node, _Crossing)]
        )
        for old_node in before:
            if isinstance(old_node, Tracklet):
                old_node.ends_in = crossing
        for new, share in zip(
            new_indices, self._shares(blobs.area_px[new_indices], count), strict=True
        ):
            is_whole = blobs.area_px[new] >= _PART * self.usual_px
            if share == 1 and is_whole:
                nodes[int(new)] = self._new_tracklet(crossing)
            else:
                nodes[int(new)] = _Crossing(crossing, share)

    def _is_part(self, node: _Node) -> bool:
        """Whether a blob is only a part of an animal, such as a tail that joins it again."""
        if not isinstance(node, Tracklet) or node.begins_in is not None:
            return False
        return len(node.frames) < _FEWEST and node.area_px < _PART * self.usual_px

    def _shares(self, areas: Floats, count: int) -> list[int]:
        """How many animals each of some blobs shows, ``count`` in all; at least one each."""
        shares = np.ones(len(areas), dtype=int)
        if len(areas) == 1:
            return [max(count, 1 if areas[0] < _JOINED_AREA * self.usual_px else 2)]
        for _ in range(count - len(areas)):
            shares[int(np.argmax(areas / self.usual_px - shares))] += 1
        return [int(share) for share in shares]

    def _new_blob(self, blobs: Blobs, number: int) -> _Node:
        """A blob that shows nothing of the frame before."""
        times = float(blobs.area_px[number]) / self.usual_px
        if times < _JOINED_AREA:
            return self._new_tracklet(None)
        return _Crossing(self._joined_crossing([]), round(times))

    def _new_tracklet(self, crossing: int | None) -> Tracklet:
        tracklet = Tracklet(crossing)
        self.tracklets.append(tracklet)
        return tracklet

    def _joined_crossing(self, crossings: Sequence[int]) -> int:
        """The number of some crossings that are one; of a new one without any."""
        roots = {self._root(crossing) for crossing in crossings}
        if not roots:
            self._parents.append(len(self._parents))
            return len(self._parents) - 1
        first = min(roots)
        for root in roots:
            self._parents[root] = first
        return first

    def _root(self, crossing: int) -> int:
        while self._parents[crossing] != crossing:
            crossing = self._parents[crossing]
        return crossing


def _shared_pixels(before: Int32s, label: Int32s, old_indices: int, new_indices: int) -> Floats:
    """(n, m) pixels that two blobs of two frames share."""
    both = (before > 0) & (label > 0)
    pair = (before[both] - 1) * new_indices + (label[both] - 1)
    return (
        np.bincount(pair, minlength=old_indices * new_indices)
        .reshape(old_indices, new_indices)
        .astype(float)
    )


def linked_groups(olds: Indices, news: Indices) -> list[tuple[Indices, Indices]]:
    """Groups of old and new numbers that pairs link, each with at least one of both.

    Args:
        olds: (P,) old number of each pair.
        news: (P,) new number of each pair.

    """
    first_new = int(olds.max(initial=-1)) + 1
    count = first_new + int(news.max(initial=-1)) + 1
    graph = coo_array((np.ones(len(olds)), (olds, first_new + news)), shape=(count, count))
    _, group = connected_components(graph, directed=False)
    return [
        (np.flatnonzero(group[:first_new] == number), np.flatnonzero(group[first_new:] == number))
        for number in np.unique(group[olds])
    ]
