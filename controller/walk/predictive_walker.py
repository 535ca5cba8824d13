"""The predictive snake walk: W proposes shapes, and a rollout predicts where each carries the body.

[PT] 2.6.2 with additions for slopes. A state is walked for a part of its length. Every tenth of a
body the part ahead of the head is bent again. W orders the states, so the walk never repeats
itself; the rollout (``Steering``) chooses among the first of them.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats, Indices
from snakewalk.config.run import WalkConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.rotations import wrap
from snakewalk.controller.mechanics.rollout import Rolled
from snakewalk.controller.motion.path_progress import Decision
from snakewalk.controller.shape.star import StarVisits
from snakewalk.controller.walk.angle_track import AngleTrack
from snakewalk.controller.walk.bend_search import FAR, SCREEN, UNLIKE, hexagon, vertex
from snakewalk.controller.walk.serpenoid import SERPENOID, SerpenoidParameters, phase_at_end
from snakewalk.controller.walk.steering import PathPose, Steering
from snakewalk.drivers.compiling import compiled

PIECES = 10
"""Decisions per body length."""
CLIMBING = (
    SerpenoidParameters(amplitude_rad=1.1, waves=1.1),
    SerpenoidParameters(amplitude_rad=1.3, waves=1.0),
)
"""Carriers of states uphill. The predicted progress of the first at 15 degrees is 0.27 of that
without slip, of the second at 18 degrees 0.17."""
SERPENOIDS = (SerpenoidParameters(), *CLIMBING)
"""Carriers that the walk falls back on."""
_JOIN = 0.1
"""Share of a body over which a repeated state blends from its head angle to its tail angle."""
_RECENT_DECISIONS = 20
"""Decisions in which no state comes again."""
_BATCH = 6
"""Rollouts in a cycle: 1 to 3 ms of a processor of 2020."""
_ASTRAY_M2 = 0.08
"""Cost from which bends all over are judged (ours): 0.2 m off the path at both ends."""
_TROUBLE_M2 = 0.2
"""Cost on a simulated body from which other pieces are tried: 0.3 m off the path at the end."""


@dataclass(frozen=True, slots=True)
class _Option:
    """A wave that may come next, without its bend."""

    state: int
    near: int
    """States within tolerance of the aim, including this one."""
    base_rad: float
    """Angle of the state's mean line at its begin."""
    wave_rad: Floats
    """(n,) the continuation about the mean line, oldest first; a body length is rolled out."""
    carrier: SerpenoidParameters | None = None
    """Wide wave under the state uphill; None on easier ground."""
    carrier_at: int = 0
    """Sample of the carrier at the begin."""


class _TriedPiece(NamedTuple):
    """A piece of track and the cost of its rollout."""

    cost_m2: float
    progress: float
    """Progress of the rollout, divided by the progress at the wanted pulse without slip."""
    option: _Option
    bends: Floats
    """(2,) of the mean line over the first and second half body, relative to the limit."""
    piece_rad: Floats


class PredictiveWalker:
    """Grows an ``AngleTrack`` from a library of shapes (S, N), head first."""

    def __init__(
        self,
        shapes_rad: Floats,
        walk: WalkConfig,
        make_steering: Callable[[AngleTrack], Steering],
        joints: int,
        accept: Callable[[Floats], bool] = lambda body: True,
    ) -> None:
        """Start on the first shape of the library, whose means are zero.

        ``walk`` limits the proposed states. ``make_steering`` is called with this walker's track.
        ``accept`` returns whether a body (N,) is within joint limits and does not touch itself.
        """
        self._shapes = shapes_rad
        self._walk = walk
        self._accept = accept
        self._star = StarVisits(len(shapes_rad))
        self.track = AngleTrack(shapes_rad[0])
        self.steering = make_steering(self.track)
        points = self.track.points
        self._piece_points = max(1, round(points / PIECES))
        self._span = max(2, round(points / (joints + 1)))
        self._walked = max(1, round(walk.decision_fraction * points))
        self._at = self._until = 0
        self._option: _Option | None = None
        self._carrier_rad = 0.0
        self._base_rad = 0.0
        self._bends = np.zeros(2)
        self._tried: list[_TriedPiece] = []
        self._thinking: Iterator[bool] | None = None
        self._lost = False
        self.try_piece: Callable[[PathPose, Floats], Rolled] | None = None
        """Tries a piece (n,) on a simulated body; None without a twin."""
        self.ask: Callable[[PathPose, Sequence[Floats]], None] | None = None
        """Asks a simulated body elsewhere about pieces (n,), or None."""
        self.answers: Callable[[], Mapping[int, Rolled | None]] = dict
        """Returns the results that have arrived, by the number of the piece."""
        self._asked: list[_TriedPiece] = []
        self._is_in_trouble = False
        self.outlook = 1.0
        """Predicted progress of the last decision, relative to the wanted pulse without slip.

        Where the piece was tried on a simulated body, it is that body's.
        """

    def restart(self, body_rad: Floats) -> None:
        """Continue with another state from a body (N,) that did not follow the track."""
        self.track.restart(body_rad)
        self.steering.forget()
        self._option = None
        self._bends = np.zeros(2)
        self.restart_decision()

    def restart_decision(self) -> None:
        """Discard the current thoughts and state."""
        self._thinking = None
        self._until = self._at

    def use_friction(self, friction: FrictionConfig) -> None:
        """Roll out with this friction from the next decision."""
        self.steering.use_friction(friction)

    def fall_back(self, lost: bool) -> None:
        """Set whether to continue as a steered serpenoid, the last resort."""
        if lost != self._lost:
            self._lost = lost
            self.restart_decision()

    def think(self, look: Callable[[], PathPose]) -> bool:
        """Prepare the next decision for a cycle; only the first call calls ``look``.

        Returns:
            Whether more thinking is useful.

        """
        if self._thinking is None:
            pose = look()
            self.steering.observe(pose)
            self._tried = []
            self._asked = []
            self._thinking = self._judge(pose)
        return next(self._thinking, False)

    def decide(self, pose: PathPose) -> Decision:
        """Append the best piece so far; at rest, the best of all."""
        if self._thinking is None:
            self.think(lambda: pose)
        while self.track.end == self.track.points and self.think(lambda: pose):
            pass
        self._thinking = None
        best = self._best_answer(self._best_on_twin(pose, self._best_piece()))
        self.outlook = best.progress
        option = best.option
        piece_points = self._piece_points
        if self._state_is_new:
            if option.state != SERPENOID:
                self._star.take(option.state)
            self._at = 0
            self._option = option
            wide = option.carrier if option.carrier in CLIMBING else None
            self._carrier_rad = 0.0 if wide is None else wide.amplitude_rad
            self._until = self._walked
        self.track.append(best.piece_rad[:piece_points])
        bend = best.bends[0] * self._walk.bend_limit_rad
        self._base_rad = option.base_rad + bend * piece_points / self.track.points
        self._at += piece_points
        self._bends = best.bends
        error = float(wrap(self._base_rad + pose.offset_rad - pose.aim_rad))
        near = option.near
        distinct = self._star.distinct
        return Decision(option.state, error, float(bend), near, distinct, self._carrier_rad)

    @property
    def _state_is_new(self) -> bool:
        return self._at >= self._until

    def _best_piece(self) -> _TriedPiece:
        """Cheapest piece with an accepted body; else the cheapest of all."""
        ranked = sorted(self._tried, key=lambda trial: trial.cost_m2)
        return next(filter(self._may_be_made, ranked), ranked[0])

    def _may_be_made(self, tried: _TriedPiece) -> bool:
        old = self.track.body_rad(self.track.end)[: self.track.points - self._piece_points]
        return self._accept(np.concatenate([tried.piece_rad[: self._piece_points][::-1], old]))

    def _best_on_twin(self, pose: PathPose, best: _TriedPiece) -> _TriedPiece:
        """On steep ground try the best piece on a simulated body; if it fails, try others."""
        if not self.try_piece or self._walk.tries == 0 or not self.steering.is_steep(pose):
            return best
        on_twin = self._on_twin(pose, best)
        if on_twin.cost_m2 <= _TROUBLE_M2 or self._lost:
            return on_twin
        for other in self._dissimilar_pieces(pose, best):
            tried = self._on_twin(pose, other)
            if tried.cost_m2 < on_twin.cost_m2:
                on_twin = tried
        if on_twin.option is not best.option:
            self._until = self._at  # another state begins
        return on_twin

    def _on_twin(self, pose: PathPose, piece: _TriedPiece) -> _TriedPiece:
        """Return the piece with its cost and progress on the simulated body."""
        assert self.try_piece is not None
        cost_m2, progress = self.steering.cost(self.try_piece(pose, piece.piece_rad))
        return piece._replace(cost_m2=float(cost_m2[0]), progress=float(progress[0]))

    def _best_answer(self, best: _TriedPiece) -> _TriedPiece:
        """Return the best piece among the answers of the remote twin.

        Without an answer about the best piece on paper, another one must be good.
        """
        best_answered: _TriedPiece | None = None
        has_best_answer = False
        for number, rolled in self.answers().items():
            if rolled is not None and number < len(self._asked):
                cost_m2, progress = self.steering.cost(rolled)
                tried = self._asked[number]
                tried = tried._replace(cost_m2=float(cost_m2[0]), progress=float(progress[0]))
                has_best_answer = has_best_answer or tried.piece_rad is best.piece_rad
                if best_answered is None or tried.cost_m2 < best_answered.cost_m2:
                    best_answered = tried
        self._asked = []
        if best_answered is None:
            return best
        self._is_in_trouble = best_answered.cost_m2 > _TROUBLE_M2
        if self._is_in_trouble and not has_best_answer:
            return best
        if best_answered.option is not best.option:
            self._until = self._at  # another state begins
        return best_answered

    def _ask_about(self, pose: PathPose) -> Iterator[bool]:
        best = self._best_piece()
        if self.ask is None or self._lost or self._walk.tries == 0 or not best.cost_m2 < np.inf:
            return
        if not self.steering.is_steep(pose):
            return
        if self._is_in_trouble:
            yield from self._screen(pose, [best.option], FAR)
        chosen = [best, *self._differing_pieces(best)]
        self._asked = [*chosen[1:2], best, *chosen[2:]] if self._is_in_trouble else chosen
        self.ask(pose, [trial.piece_rad for trial in self._asked])

    def _dissimilar_pieces(self, pose: PathPose, best: _TriedPiece) -> list[_TriedPiece]:
        """Dissimilar pieces, cheapest first: of the current state, and of others."""
        self._roll(pose, [(best.option, bends) for bends in FAR])
        if not self._state_is_new:
            options = self._new_options(pose)
            for carrier in CLIMBING:
                options += self._new_options(pose, carrier)[:3]
            for option in options:
                self._roll(pose, [(option, bends) for bends in UNLIKE])
        return self._differing_pieces(best)

    def _differing_pieces(self, best: _TriedPiece) -> list[_TriedPiece]:
        """Judged pieces that differ from the best and each other, cheapest first."""
        chosen = [best]
        for trial in sorted(self._tried, key=lambda option_trial: option_trial.cost_m2):
            if len(chosen) == self._walk.tries:
                break
            bends_of_option = [other.bends for other in chosen if other.option is trial.option]
            if (
                len(bends_of_option) < 3
                and all(np.abs(trial.bends - bends).max() >= 0.7 for bends in bends_of_option)
                and self._may_be_made(trial)
            ):
                chosen.append(trial)
        return chosen[1:]

    def _judge(self, pose: PathPose) -> Iterator[bool]:
        """Judge options and bends in batches, the most likely first."""
        bends = self._bends[None]
        if self._state_is_new:
            bends = np.append(SCREEN, bends, axis=0)
        yield from self._screen(pose, self._options(pose), bends)
        if (
            self._state_is_new
            and not self._lost
            and self._best_piece_so_far().progress < self._walk.climb_progress
        ):
            for carrier in CLIMBING:
                yield from self._screen(pose, self._options(pose, carrier), bends)
        yield from self._narrow_search(pose)
        best = self._best_piece_so_far()
        if best.cost_m2 > _ASTRAY_M2:
            yield from self._screen(pose, [best.option], FAR)
            yield from self._narrow_search(pose)
        yield from self._ask_about(pose)

    def _narrow_search(self, pose: PathPose) -> Iterator[bool]:
        """Judge bends about the best, and the minimum of a parabola through them.

        If the minimum may lie outside, repeat.
        """
        for _ in range(2):
            middle = self._best_piece_so_far()
            yield from self._screen(pose, [middle.option], hexagon(middle.bends))
            costs_m2 = [trial.cost_m2 for trial in self._tried[-6:]]
            minimum = vertex(middle.bends, middle.cost_m2, costs_m2)
            yield from self._screen(pose, [middle.option], minimum.bends[None])
            best = self._best_piece_so_far()
            if minimum.enclosed and (best is middle or best is self._tried[-1]):
                break

    def _screen(self, pose: PathPose, options: list[_Option], bends: Floats) -> Iterator[bool]:
        """Roll out every option with every row of ``bends`` (C, 2)."""
        tried = [(option, bend) for option in options for bend in bends]
        for k in range(0, len(tried), _BATCH):
            self._roll(pose, tried[k : k + _BATCH])
            yield True

    def _best_piece_so_far(self) -> _TriedPiece:
        return min(self._tried, key=lambda trial: trial.cost_m2)

    def _roll(self, pose: PathPose, tried: list[tuple[_Option, Floats]]) -> None:
        points = self.track.points
        pieces = np.empty((len(tried), points))
        for row, (option, _) in zip(pieces, tried, strict=True):
            row[:] = option.wave_rad[:points]
        bases = np.array([option.base_rad for option, _ in tried])
        bends = np.array([bend for _, bend in tried])
        _bend(pieces, bases, bends, self._walk.bend_limit_rad, points)
        cost_m2, progress = self.steering.judge(pose, pieces)
        self._tried += [
            _TriedPiece(cost, on, option, bend, piece)
            for cost, on, (option, bend), piece in zip(
                cost_m2.tolist(), progress.tolist(), tried, pieces, strict=True
            )
        ]

    def _options(self, pose: PathPose, carrier: SerpenoidParameters | None = None) -> list[_Option]:
        """Possible next pieces: the rest of the current state, or new states."""
        if self._option is not None and not self._state_is_new:
            state = self._option.state
            wave_continuation = self._option.wave_rad[self._at :]
            return [_Option(state, self._option.near, self._base_rad, wave_continuation)]
        return self._new_options(pose, carrier)

    def _new_options(
        self, pose: PathPose, carrier: SerpenoidParameters | None = None
    ) -> list[_Option]:
        """Other states: the smoothest of the first of W; serpenoids as a fallback."""
        points = self.track.points
        walk = self._walk
        if self._lost:
            return [self._serpenoid(serpenoid) for serpenoid in SERPENOIDS]
        share, phase = (1.0, 0) if carrier is None else (walk.climb_share, self._phase(carrier))
        carried = np.zeros(self._walked + points + 1)
        if carrier is not None:
            carried = carrier.wave_rad(phase - 1 + np.arange(len(carried)), points)
        placed = self.track.last_rad - share * self._shapes[:, -1] - carried[0]
        error = wrap(placed + pose.offset_rad - pose.aim_rad)
        ranks, near = self._star.order(
            error, walk.heading_tolerance_rad, walk.nearest_count, _RECENT_DECISIONS
        )
        states = np.array(list(islice(ranks, walk.proposals)))
        waves = share * self._waves_rad(states) + carried[1:]
        rough = self._roughness(placed[states, None] + waves[:, : self._walked])
        return [
            _Option(int(states[k]), near, float(placed[states[k]]), waves[k], carrier, phase)
            for k in np.argsort(rough, kind="stable")[: walk.candidates]
        ]

    def _serpenoid(self, carrier: SerpenoidParameters) -> _Option:
        points = self.track.points
        phase = self._phase(carrier)
        waves = carrier.wave_rad(phase - 1 + np.arange(self._walked + points + 1), points)
        base = self.track.last_rad - waves[0]
        return _Option(SERPENOID, 1, float(base), waves[1:], carrier, phase)

    def _phase(self, carrier: SerpenoidParameters) -> int:
        """Next sample of a carrier: it continues, or begins as the track bends."""
        option = self._option
        if option is not None and option.carrier is carrier:
            return option.carrier_at + self._at
        return phase_at_end(self.track, carrier)[1]

    def _waves_rad(self, states: Indices) -> Floats:
        """(n, m) angles after the tails', oldest first; a state repeats itself."""
        shapes = self._shapes[states][:, ::-1]
        join = round(_JOIN * shapes.shape[1]) + 2
        joined = np.linspace(shapes[:, -1], shapes[:, 0], join, axis=1)
        curves_rad = np.concatenate([shapes, joined[:, 1:-1]], axis=1)
        count = self._walked + self.track.points
        return np.take(curves_rad, np.arange(1, count + 1), axis=1, mode="wrap")

    def _roughness(self, angles_rad: Floats) -> Floats:
        """Mean square (n,) of the joints' accelerations on angles (n, m), arbitrary units."""
        tail_rad = self.track.samples(self.track.end - 2 * self._span)
        rough = np.empty(len(angles_rad))
        _roughness(tail_rad, angles_rad, self._span, rough)
        return rough


@compiled(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64, int64)", makes_arrays=False
)
def _bend(
    pieces_rad: Floats, bases_rad: Floats, bends: Floats, limit_rad: float, points: int
) -> None:
    """Add mean lines to waves (C, n): bases (C,), turned by bends (C, 2) over two half bodies."""
    half = points // 2
    for c in range(len(pieces_rad)):
        for k in range(pieces_rad.shape[1]):
            first = min(k + 1, half) / points
            second = max(k + 1 - half, 0) / points
            turn = limit_rad * (bends[c, 0] * first + bends[c, 1] * second)
            pieces_rad[c, k] = bases_rad[c] + pieces_rad[c, k] + turn


@compiled("void(float64[::1], float64[:, ::1], int64, float64[::1])")
def _roughness(tail_rad: Floats, angles_rad: Floats, span: int, rough: Floats) -> None:
    """Write the roughness (n,) of the joints on angles (n, m) behind the track's last two spans.

    A joint is the difference of the mean angles over two spans; its roughness is the mean square of
    its second differences.
    """
    row = np.empty(len(tail_rad) + angles_rad.shape[1])
    row[: len(tail_rad)] = tail_rad
    for n in range(len(angles_rad)):
        row[len(tail_rad) :] = angles_rad[n]
        slope = 0.0
        total = 0.0
        for k in range(len(row) - 2 * span):
            step = row[k + 2 * span] - 2.0 * row[k + span] + row[k]  # of the joint
            total += (step - slope) ** 2 if k > 0 else 0.0
            slope = step
        rough[n] = total / (span * span * (len(row) - 2 * span - 1))
