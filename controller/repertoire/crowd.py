"""Many bodies at once, compiled: body frames, link centres, bridges, level of detail ([YT] 4)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats, Indices, Int32s, Singles
from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.replay import bridge_frames, tip_travel_m
from snakewalk.drivers.compiling import compiled, inlined

LANES = 8
"""Links are padded to a multiple of this, so that vector units process them without a remainder."""
_LARGEST_TIP_M = 0.02
"""Largest motion of a tip in a frame of a bridge (ours)."""
_ROWS = "float64[:, ::1]"
_LINKS = "float32[:, :, ::1]"


class Crowd:
    """N bodies of one repertoire, each with its own place, segment, frame and size.

    ``link_m(k)`` of a body that is not ``visible`` is stale: only its body frame goes on.
    """

    def __init__(
        self,
        repertoire: Repertoire,
        bodies: int,
        *,
        balance_rad: float = 0.0,
    ) -> None:
        """Put all bodies at the origin, at the beginning of the first segment.

        ``balance_rad``: by how much a body that has come to lean rolls upright in a frame, at most
        ([YT] 4.2); 0 replays exactly what was recorded.
        """
        self._balance_rad = balance_rad
        segments = repertoire.segments
        lengths = np.array([segment.frames for segment in segments])
        self._first = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.int32)
        self._last = (np.cumsum(lengths) - 1).astype(np.int32)
        self._turn = np.concatenate([segment.turn for segment in segments]).reshape(-1, 9)
        self._move = np.concatenate([segment.move_m for segment in segments])
        shape = np.concatenate([segment.link_m for segment in segments])
        self._links = shape.shape[1]
        padded = -(-self._links // LANES) * LANES
        self._shape = np.zeros((len(shape), 3, padded), dtype=np.float32)
        self._shape[:, :, : self._links] = shape.transpose(0, 2, 1)
        self._bridge_length = np.array(
            [
                [
                    bridge_frames(tip_travel_m(a.link_m[-1], b.link_m[0]), _LARGEST_TIP_M)
                    for b in segments
                ]
                for a in segments
            ],
            dtype=np.int32,
        )
        self.rotation: Floats = np.tile(np.eye(3).ravel(), (bodies, 1))
        """(N, 9) row-major axes of the body frames."""
        self.origin_m: Floats = np.zeros((bodies, 3))
        """(N, 3) origins of the bodies, m."""
        self.scale: Floats = np.ones(bodies)
        """(N,) size of each body, divided by the recorded body's."""
        self.visible: Bools = np.ones(bodies, dtype=np.bool_)
        """(N,) whether a body is visible."""
        self.segment: Int32s = np.zeros(bodies, dtype=np.int32)
        """(N,) requested: begins when the cycle ends."""
        self.cycles: Int32s = np.zeros(bodies, dtype=np.int32)
        """(N,) cycles of the segment since it began."""
        self._playing: Int32s = np.zeros(bodies, dtype=np.int32)
        self._next: Int32s = np.zeros(bodies, dtype=np.int32)
        self._ended: Bools = np.zeros(bodies, dtype=np.bool_)
        self._bridge_from: Int32s = np.zeros(bodies, dtype=np.int32)
        self._bridge_frames: Int32s = np.zeros(bodies, dtype=np.int32)
        self._bridge_remaining: Int32s = np.zeros(bodies, dtype=np.int32)
        self._points = np.zeros((bodies, 3, padded), dtype=np.float32)

    @property
    def playing(self) -> Int32s:
        """(N,) segment of each body now."""
        return self._playing

    @property
    def ended(self) -> Bools:
        """(N,) whether the last frame was the end of a cycle."""
        return self._ended

    def place(self, body: int, frame: Frame, *, segment: int = 0, scale: float = 1.0) -> None:
        """Place a body so that its next frame is the first of ``segment``."""
        self.rotation[body] = frame.rotation.ravel()
        self.origin_m[body] = frame.origin_m
        self.scale[body] = scale
        self.segment[body] = self._playing[body] = segment
        self._next[body] = self._first[segment]
        self._bridge_remaining[body] = self.cycles[body] = 0
        self._ended[body] = False

    def stagger(self, seed: int = 0) -> None:
        """Give each body a random moment of its cycle."""
        first, last = self._first[self._playing], self._last[self._playing]
        self._next[:] = np.random.default_rng(seed).integers(first, last + 1)

    def link_m(self, body: int) -> Floats:
        """(L, 3) centres of a body's links in the world, single precision."""
        return np.asarray(self._points[body, :, : self._links].T, dtype=np.float64)

    @property
    def points_m(self) -> Singles:
        """(N, 3, links and padding) of the links."""
        return self._points

    def shift(self, body: int, move_m: Floats) -> None:
        """Move a body by (2,) in the plane, with its links."""
        self.origin_m[body, :2] += move_m
        self._points[body, :2] += move_m[:, None].astype(np.float32)

    def interrupt(self, body: int, segment: int) -> None:
        """Begin another segment at once, at the moment whose shape is nearest to the body's.

        The body frame rests until a bridge has reached this shape.
        """
        first, last = self._first[segment], self._last[segment]
        now = self._next[body]
        off = self._shape[first : last + 1] - self._shape[now]
        travel = np.linalg.norm(off[:, :2, self._links - 1], axis=1)
        nearest = int(np.sqrt((off[:, :2] ** 2).sum(axis=(1, 2))).argmin())
        self._bridge_from[body] = now
        self._bridge_frames[body] = self._bridge_remaining[body] = bridge_frames(
            float(travel[nearest]), _LARGEST_TIP_M
        )
        self.segment[body] = self._playing[body] = segment
        self._next[body] = first + nearest
        self.cycles[body], self._ended[body] = 0, False

    def snapshot(self) -> tuple[NDArray[Any], ...]:
        """Return a copy of the state of all bodies, for ``restore``."""
        return tuple(array.copy() for array in self._state)

    def restore(self, state: tuple[NDArray[Any], ...], bodies: Indices) -> None:
        """Return some bodies to a state from ``snapshot``."""
        for array, old in zip(self._state, state, strict=True):
            array[bodies] = old[bodies]

    @property
    def _state(self) -> tuple[NDArray[Any], ...]:
        """Arrays (N, ...) that a step changes."""
        return (
            self.rotation,
            self.origin_m,
            self.cycles,
            self._playing,
            self._next,
            self._ended,
            self._bridge_from,
            self._bridge_frames,
            self._bridge_remaining,
            self._points,
        )

    def step(self, frames: int = 1) -> None:
        """Go on by ``frames`` frames."""
        for _ in range(frames):
            _step(
                self._turn,
                self._move,
                self._shape,
                self._first,
                self._last,
                self._bridge_length,
                self._balance_rad,
                self.scale,
                self.visible,
                self.segment,
                *self._state,
            )


@inlined
def _orthonormalise(r: Floats) -> None:
    """Remove rounding from the axes: x keeps its direction, y and z are computed again."""
    size = 1.0 / np.sqrt(r[0] * r[0] + r[3] * r[3] + r[6] * r[6])
    r[0], r[3], r[6] = r[0] * size, r[3] * size, r[6] * size
    along = r[0] * r[1] + r[3] * r[4] + r[6] * r[7]
    r[1], r[4], r[7] = r[1] - along * r[0], r[4] - along * r[3], r[7] - along * r[6]
    size = 1.0 / np.sqrt(r[1] * r[1] + r[4] * r[4] + r[7] * r[7])
    r[1], r[4], r[7] = r[1] * size, r[4] * size, r[7] * size
    r[2] = r[3] * r[7] - r[6] * r[4]
    r[5] = r[6] * r[1] - r[0] * r[7]
    r[8] = r[0] * r[4] - r[3] * r[1]


@inlined
def _balance(r: Floats, most: float) -> None:
    """Roll about the body's x, by ``most`` at most, towards where its z points up the most."""
    roll = min(max(np.arctan2(-r[7], r[8]), -most), most)
    c, s = np.cos(roll), np.sin(roll)
    for k in range(3):
        y, z = r[3 * k + 1], r[3 * k + 2]
        r[3 * k + 1], r[3 * k + 2] = c * y + s * z, c * z - s * y


@compiled(
    f"void({_ROWS}, {_ROWS}, {_LINKS}, int32[::1], int32[::1], int32[:, ::1], float64,"
    f" float64[::1], boolean[::1], int32[::1], {_ROWS}, {_ROWS}, int32[::1], int32[::1],"
    f" int32[::1], boolean[::1], int32[::1], int32[::1], int32[::1], {_LINKS})",
    divides_by_zero=True,
    makes_arrays=False,
    fastmath=True,
)
def _step(  # noqa: C901  a compiled loop
    turn: Floats,
    move: Floats,
    shape: Singles,
    first: Int32s,
    last: Int32s,
    bridge: Int32s,
    balance: float,
    scale: Floats,
    visible: Bools,
    requested: Int32s,
    rotation: Floats,
    origin: Floats,
    cycles: Int32s,
    playing: Int32s,
    following: Int32s,
    ended: Bools,
    bridge_from: Int32s,
    bridge_frames_of: Int32s,
    bridge_remaining: Int32s,
    points: Singles,
) -> None:
    """One frame of every body; plain numbers, for a slice in this loop costs more than its work."""
    lanes = shape.shape[2]
    for b in range(len(following)):
        if balance > 0.0:
            _balance(rotation[b], balance)
        if ended[b]:
            ended[b] = False
            cycles[b] += 1
            _orthonormalise(rotation[b])
            new = requested[b]
            if new != playing[b]:
                bridge_from[b] = last[playing[b]]
                bridge_frames_of[b] = bridge_remaining[b] = bridge[playing[b], new]
                playing[b] = new
                cycles[b] = 0
                following[b] = first[new]
        last_move = following[b]
        shown = visible[b]
        a = last_move
        share = 0.0
        if shown and bridge_remaining[b] > 0:  # the shape goes over, the body frame stays
            a = bridge_from[b]
            share = (bridge_frames_of[b] - bridge_remaining[b] + 1.0) / (bridge_frames_of[b] + 1.0)
            bridge_remaining[b] -= 1
        else:
            bridge_remaining[b] = 0
            for k in range(3):
                u, v, w = rotation[b, 3 * k], rotation[b, 3 * k + 1], rotation[b, 3 * k + 2]
                away = u * move[last_move, 0] + v * move[last_move, 1] + w * move[last_move, 2]
                origin[b, k] += scale[b] * away
                for j in range(3):
                    rotation[b, 3 * k + j] = (
                        u * turn[last_move, j]
                        + v * turn[last_move, 3 + j]
                        + w * turn[last_move, 6 + j]
                    )
            if last_move == last[playing[b]]:
                ended[b] = True
                following[b] = first[playing[b]]
            else:
                following[b] = last_move + 1
        if not shown:
            continue
        p, q = np.float32(1.0 - share), np.float32(share)
        for k in range(3):
            o = np.float32(origin[b, k])
            f = np.float32(scale[b] * rotation[b, 3 * k])
            g = np.float32(scale[b] * rotation[b, 3 * k + 1])
            h = np.float32(scale[b] * rotation[b, 3 * k + 2])
            for lane in range(lanes):
                x, y, z = shape[a, 0, lane], shape[a, 1, lane], shape[a, 2, lane]
                if share != 0.0:
                    x = p * x + q * shape[last_move, 0, lane]
                    y = p * y + q * shape[last_move, 1, lane]
                    z = p * z + q * shape[last_move, 2, lane]
                points[b, k, lane] = o + f * x + g * y + h * z
