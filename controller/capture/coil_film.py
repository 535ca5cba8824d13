"""Frames of a film in which the body lies on itself, solved from the good frames on both sides.

Each stretch of such frames is followed forward from its first frame and back from its last one,
with the body of the good frames. Both solutions are then fitted to all frames of the stretch at
once. A frame is solved where they agree and explain the silhouette; else no picture shows which
strand goes where, and the status says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.coil_fit import (
    COIL_BENDS,
    COILS,
    PARAMETERS,
    UNCLEAR_STATUSES,
    CoilBody,
    Normal,
    Outline,
    Shape,
    curve,
    fit_coil,
    left_over,
    line_slopes,
    normal_of,
)
from snakewalk.controller.capture.staged_film import StagedFilm
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, in_equal_chords, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_SAMPLE = 40  # good frames from which the body and its usual residual are learnt
_FEWEST = 5  # good frames
_MOST_BETWEEN = 4  # good frames between two coils that are also solved
_LONGEST_STRETCH = 400  # frames of a stretch
_CHANGE = 2.0  # times the usual change from frame to frame, while a body coils
_LEAST_CHANGE = (0.3, 0.3, 0.004, *[0.05] * COIL_BENDS)  # working px, log, rad
_ROUNDS = 10
_AGREE = 0.02  # of the length: solutions further apart are two
_RIVAL = 150.0  # squares of the usual residual: a solution of higher cost is rejected
_OF_FIT, _OF_MODEL = 3.0, 2.5  # weight of the fit's own error and of its body's error
_STEP = 100.0  # the same of a step from frame to frame
_NEIGHBOURS = 3  # frames on both sides of a frame with two solutions, equally doubtful
_MOST_UNEXPLAINED = 0.015  # of the body's area, or
_MOST_OVER_USUAL = 3.0  # times what good frames leave
COIL_LEAST = 1.4
"""Least error, relative to the usual expected error of the other frames."""


@dataclass(frozen=True, slots=True)
class CoilFilm:
    """A film's skeletons after its coils were solved."""

    skeletons: tuple[Skeleton, ...]
    expected_px: Floats
    """(T,) expected mean error of a point in solved frames; NaN in others."""


@dataclass(frozen=True, slots=True)
class _Solution:
    """A stretch followed from one side, then fitted as a whole."""

    values: Floats
    """(K, PARAMETERS) parameters of the body in each frame."""
    left: Floats
    """(K,) unexplained part of each frame (``left_over``)."""
    error: Floats
    """(K,) expected mean error of a point by the fit alone, working px."""
    cost: float
    """Cost of all frames and of the steps between them, in squares of the usual residual."""
    apart: Floats
    """(K,) distance of another solution of about the same cost, working px."""
    steps: Floats
    """(K + 1,) of the steps alone."""


class Repair:
    """Stage that solves coils by the body of the film."""

    def run(self, film: StagedFilm) -> StagedFilm:
        """Return the film with solved coils, and the errors of all detected frames."""
        detections = film.detections
        coils = solve_coils(film.skeletons, detections.outlines, np.array(detections.axis_error_px))
        solved = np.isfinite(coils.expected_px)
        expected = np.where(solved, coils.expected_px, detections.expected_px)
        return replace(film, skeletons=coils.skeletons, expected_px=expected, solved=solved)


def solve_coils(
    skeletons: Sequence[Skeleton], outlines: Mapping[int, Outline], expected_px: Floats
) -> CoilFilm:
    """Solve the frames in which the body lies on itself.

    Args:
        skeletons: (T) the same end first in all.
        outlines: silhouettes by frame, of coils and good frames.
        expected_px: (T,) of the good frames; NaN where unknown.

    """
    out = list(skeletons)
    expected = np.full(len(out), np.nan)
    good = [k for k in sorted(outlines) if out[k].status is FrameStatus.GOOD]
    coils = [k for k in sorted(outlines) if out[k].status in COILS]
    if len(good) < _FEWEST or not coils:
        return CoilFilm(tuple(out), expected)
    film = _Film.of(out, outlines, good)
    known_errors_px = expected_px[good]
    own_px = float(np.nanmedian(known_errors_px)) if np.isfinite(known_errors_px).any() else 0.0
    for stretch in _stretches(coils, set(good)):
        if len(stretch) > _LONGEST_STRETCH:
            continue
        solved = film.solved(stretch, out, own_px)
        if solved.turned:  # the later frames have the other end first
            out[stretch[-1] + 1 :] = [skeleton.reversed() for skeleton in out[stretch[-1] + 1 :]]
        for k, body, error in zip(stretch, solved.skeletons, solved.expected_px, strict=True):
            out[k], expected[k] = body, error
    return CoilFilm(tuple(out), expected)


def _stretches(coils: Sequence[int], good: set[int]) -> list[list[int]]:
    """Runs of consecutive frames: coils, and the good frames among and next to them.

    A coil may pass for a body that does not touch itself for a few frames.
    """
    out: list[list[int]] = []
    for k in coils:
        between = range(out[-1][-1] + 1, k) if out else range(0)
        if out and len(between) <= _MOST_BETWEEN and good.issuperset(between):
            out[-1] += [*between, k]
        else:
            out.append([k])
    for run in out:
        if {run[0] - 1, run[0] - 2} <= good:
            run.insert(0, run[0] - 1)
        if {run[-1] + 1, run[-1] + 2} <= good:
            run.append(run[-1] + 1)
    return out


@dataclass(frozen=True, slots=True)
class _End:
    """A good frame next to a stretch."""

    values: Floats
    turned: Floats
    """Solution of the stretch with the body's other end first."""


@dataclass(frozen=True, slots=True)
class _SolvedStretch:
    """Result for the frames of a stretch."""

    skeletons: list[Skeleton]
    expected_px: list[float]
    """Expected error; NaN where the frame is not solved, or was good before."""
    turned: bool
    """Whether the ends changed places in the stretch."""


@dataclass(frozen=True, slots=True)
class _Film:
    """Properties of a film, from its good frames."""

    body: CoilBody
    outlines: Mapping[int, Outline]
    squares: float
    """Usual mean square of the residual."""
    left: float
    """Residual that nine of ten good frames do not exceed."""
    misfit: float
    """Distance of fits from skeletons that nine of ten good frames do not exceed, working px."""
    change: Floats
    """(PARAMETERS, PARAMETERS) information of one frame about the next."""

    @classmethod
    def of(
        cls, skeletons: Sequence[Skeleton], outlines: Mapping[int, Outline], good: list[int]
    ) -> "_Film":
        body = CoilBody.of([skeletons[k] for k in good])
        shapes = {k: Shape.of(outlines[k], body.scale) for k in good}
        values = {k: body.values_of(skeletons[k], shapes[k]) for k in good}
        squares = []
        left = []
        misfit = []
        for k in good[:: max(1, len(good) // _SAMPLE)]:
            fit, normal = fit_coil(values[k], body, shapes[k], 0.1, coarse=False)
            squares.append(normal.squares)
            left.append(left_over(fit, body, shapes[k]))
            off = body.line(fit, shapes[k]) - body.line(values[k], shapes[k])
            misfit.append(float(np.hypot(*off.T).mean()))
        steps = [
            _nearest_turns(values[k], values[k - 1]) - values[k - 1]
            for k in good
            if k - 1 in values
        ]
        floor = np.square(_LEAST_CHANGE)
        spread = np.diag(floor)
        if len(steps) > _FEWEST:
            moved = np.array(steps)
            spread = spread + _CHANGE**2 * (moved.T @ moved) / len(moved)
        return cls(
            body,
            outlines,
            max(float(np.median(squares)), 0.05),
            float(np.percentile(left, 90.0)),
            float(np.percentile(misfit, 90.0)),
            np.linalg.inv(spread),
        )

    def solved(
        self, stretch: list[int], skeletons: Sequence[Skeleton], own_px: float
    ) -> "_SolvedStretch":
        shapes = [Shape.of(self.outlines[k], self.body.scale) for k in stretch]
        before, after = (self._end(k, skeletons) for k in (stretch[0] - 1, stretch[-1] + 1))
        if before is None or after is None:
            return _SolvedStretch(
                [_unsolved_skeleton(skeletons[k], FrameStatus.COIL_ALONE) for k in stretch],
                [np.nan] * len(stretch),
                turned=False,
            )
        best, turned = self._solution(shapes, before, after)
        out = _SolvedStretch([], [], turned)
        for n, k in enumerate(stretch):
            solved_skeleton, status, error = skeletons[k], *self._check(n, best)
            body = _unsolved_skeleton(solved_skeleton, status)
            error_px = np.nan
            if status is FrameStatus.COIL:
                line = self.body.line(best.values[n], shapes[n], 4 * SEGMENTS)
                body = self._skeleton(shapes[n].to_px(line))
                error_px = float(np.hypot(error / self.body.scale, own_px))
            is_beside_end = n in {0, len(stretch) - 1} and status is not FrameStatus.COIL
            if solved_skeleton.status is FrameStatus.GOOD and (
                is_beside_end
                or float(np.hypot(*(solved_skeleton.points_px - body.points_px).T).mean())
                < error_px
            ):
                body = solved_skeleton
                error_px = np.nan  # the medial axis was right
            out.skeletons.append(body)
            out.expected_px.append(error_px)
        return out

    def _end(self, k: int, skeletons: Sequence[Skeleton]) -> "_End | None":
        if k not in self.outlines or skeletons[k].status is not FrameStatus.GOOD:
            return None
        shape = Shape.of(self.outlines[k], self.body.scale)
        first, other = (
            self.body.values_of(body, shape) for body in (skeletons[k], skeletons[k].reversed())
        )
        return _End(first, other)

    def _solution(
        self, shapes: Sequence[Shape], before: "_End", after: "_End"
    ) -> tuple[_Solution, bool]:
        """The stretch from both sides, and whether the ends changed places in it."""
        first, last = before.values, after.values
        ahead = self._fitted_from_previous(shapes, first)
        turned = False
        if self._distance(ahead[-1], after.turned) < 0.5 * self._distance(ahead[-1], last):
            back = self._fitted_from_previous(shapes[::-1], after.turned)[::-1]
            turned = self._distance(back[0], first) < 0.5 * self._distance(back[0], before.turned)
        if turned:
            last = after.turned
        else:
            back = self._fitted_from_previous(shapes[::-1], last)[::-1]
        chains = [ahead, back]
        both = first, last
        whole_paths = [self._fit_stretch(chain, shapes, both) for chain in chains]
        tried = [*chains, *(path.values for path in whole_paths)]
        choice = np.argmin(self._least_costs(tried, shapes, both), axis=1)
        joined = np.array([tried[source][n] for n, source in enumerate(choice)])
        whole_paths.append(self._fit_stretch(joined, shapes, both))
        whole_paths.sort(key=lambda whole_path: whole_path.cost)
        others = [*chains, *(path.values for path in whole_paths[1:])]
        rivals = self._rivals([whole_paths[0].values, *others], shapes, both)
        return replace(whole_paths[0], apart=rivals), turned

    def _rivals(
        self, chains: Sequence[Floats], shapes: Sequence[Shape], ends: tuple[Floats, Floats]
    ) -> Floats:
        """(K,) distance of another solution of about the same cost, working px."""
        path_costs = self._least_costs(chains, shapes, ends)
        out = np.zeros(len(shapes))
        for n, row in enumerate(path_costs):
            for chain, cost in zip(chains[1:], row[1:], strict=True):
                if cost < row[0] + _RIVAL:
                    out[n] = max(out[n], self._distance(chain[n], chains[0][n]))
        return out

    def _least_costs(
        self, chains: Sequence[Floats], shapes: Sequence[Shape], ends: tuple[Floats, Floats]
    ) -> Floats:
        """(K, chains) least cost of the stretch if a frame has its value from that chain.

        A chain that took a wrong way at some frame is right before it.
        """
        cost = np.array(
            [
                [normal_of(chain[n], self.body, shape, self.squares).cost for chain in chains]
                for n, shape in enumerate(shapes)
            ]
        )
        cost[0] += [self._step_cost(ends[0], chain[0]) for chain in chains]
        cost[-1] += [self._step_cost(chain[-1], ends[1]) for chain in chains]
        steps = [
            np.array(
                [[self._step_cost(shape, other) for other in later] for shape in current_shapes]
            )
            for current_shapes, later in pairwise(np.stack(chains, axis=1))
        ]
        before, after = [cost[0]], [cost[-1]]
        for n, step in enumerate(steps):
            before.append((before[-1][:, None] + step).min(axis=0) + cost[n + 1])
        for n in range(len(steps) - 1, -1, -1):
            after.append((steps[n] + after[-1]).min(axis=1) + cost[n])
        return np.asarray(np.array(before) + np.array(after[::-1]) - cost)

    def _step_cost(self, shape: Floats, other: Floats) -> float:
        step = _nearest_turns(other, shape) - shape
        return float(step @ self.change @ step)

    def _distance(self, shape: Floats, other: Floats) -> float:
        """Mean distance of two bodies, relative to the middles of their silhouettes."""
        ends = np.zeros(2)
        lines = [curve(values, self.body.length, ends) for values in (shape, other)]
        return float(np.hypot(*(lines[0] - lines[1]).T).mean())

    def _fitted_from_previous(self, shapes: Sequence[Shape], start: Floats) -> Floats:
        """(K, PARAMETERS) each frame fitted from the one before it."""
        before = start
        shape_now = start
        out = []
        for shape in shapes:
            tried = []
            for first in (shape_now, shape_now + 0.7 * (shape_now - before)):
                values, normal = fit_coil(
                    first, self.body, shape, self.squares, (shape_now, self.change)
                )
                off = values - shape_now
                tried.append((normal.cost + float(off @ self.change @ off), values))
            before, shape_now = shape_now, min(tried, key=lambda trial: trial[0])[1]
            out.append(shape_now)
        return np.array(out)

    def _fit_stretch(
        self, chain: Floats, shapes: Sequence[Shape], ends: tuple[Floats, Floats]
    ) -> _Solution:
        """Fit all frames of a stretch at once, tied to each other and to the good frames."""
        values = chain
        best = np.inf
        kept = chain
        damp = 1e-2
        best_path: tuple[list[Normal], Floats] | None = None
        for _ in range(_ROUNDS):
            normals = [
                normal_of(row, self.body, shape, self.squares)
                for row, shape in zip(values, shapes, strict=True)
            ]
            cost = sum(normal.cost for normal in normals) + float(self._ties(values, ends).sum())
            if cost < best:
                done = best - cost < 1e-4 * cost
                best = cost
                kept = values
                best_path = (normals, values)
                damp = 0.3 * damp
                if done:
                    break
            else:
                damp *= 8.0
            assert best_path is not None
            step, _ = self._step(best_path[0], best_path[1], ends, damp)
            values = kept + step
        assert best_path is not None
        _, covariance = self._step(best_path[0], kept, ends, 0.0)
        error = np.array(
            [
                self._error(row, row_covariance)
                for row, row_covariance in zip(kept, covariance, strict=True)
            ]
        )
        left = np.array(
            [left_over(row, self.body, shape) for row, shape in zip(kept, shapes, strict=True)]
        )
        return _Solution(
            kept, left, error, float(best), np.zeros(len(kept)), self._ties(kept, ends)
        )

    def _ties(self, values: Floats, ends: tuple[Floats, Floats]) -> Floats:
        """(K + 1,) cost of each step."""
        return np.array([self._step_cost(*pair) for pair in pairwise([ends[0], *values, ends[1]])])

    def _step(
        self, normals: Sequence[Normal], values: Floats, ends: tuple[Floats, Floats], damp: float
    ) -> tuple[Floats, Floats]:
        """Newton's step (K, PARAMETERS) of a chain of frames, and each frame's covariance.

        The frames are eliminated from both ends: a frame's information then contains that of all
        others.
        """
        count = len(values)
        systems = [
            normal.information + damp * np.diag(np.diag(normal.information)) for normal in normals
        ]
        push = [normal.push.copy() for normal in normals]
        tie = self.change
        for n, end in ((0, ends[0]), (count - 1, ends[1])):
            systems[n] = systems[n] + tie
            push[n] = push[n] + tie @ (_nearest_turns(end, values[n]) - values[n])
        for n in range(count - 1):
            off = tie @ (values[n + 1] - values[n])
            push[n] = push[n] + off
            push[n + 1] = push[n + 1] - off
        before = self._eliminated_frames(systems, push)
        after = self._eliminated_frames(systems[::-1], push[::-1])[::-1]
        steps = []
        covariance = []
        for n in range(count):
            full = systems[n] + before[n][0] + after[n][0]
            inverse = np.linalg.inv(full)
            covariance.append(inverse)
            steps.append(inverse @ (push[n] + before[n][1] + after[n][1]))
        return np.array(steps), np.array(covariance)

    def _eliminated_frames(
        self, systems: Sequence[Floats], push: Sequence[Floats]
    ) -> list[tuple[Floats, Floats]]:
        """Information and push that the frames before each frame add."""
        tie = self.change
        no_information = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS)
        out = [no_information]
        for n in range(len(systems) - 1):
            full = systems[n] + out[n][0] + tie
            ahead = np.linalg.solve(full, np.column_stack([tie, push[n] + out[n][1]]))
            out.append((tie - tie @ ahead[:, :-1], tie @ ahead[:, -1]))
        return out

    def _error(self, values: Floats, covariance: Floats) -> float:
        slopes = line_slopes(values, self.body.length)
        square = np.einsum("kij,jl,kil->k", slopes, covariance, slopes)
        return float(np.sqrt(np.maximum(square, 0.0)).mean())

    def _check(self, n: int, best: _Solution) -> tuple[FrameStatus, float]:
        """Whether all solutions of a frame agree, and their possible error, working px."""
        strange = best.left > max(_MOST_UNEXPLAINED, _MOST_OVER_USUAL * self.left)
        if strange[n]:
            return FrameStatus.COIL_UNLIKE, np.nan
        neighbour_gaps = best.apart[max(0, n - _NEIGHBOURS) : n + _NEIGHBOURS + 1]
        has_large_steps = best.steps > _STEP
        has_large_steps[:-1] |= strange
        tied = not has_large_steps[: n + 1].any() or not has_large_steps[n + 1 :].any()
        if neighbour_gaps.max() > _AGREE * self.body.length or not tied:
            return FrameStatus.COIL_TWO_WAYS, np.nan
        frame_error_px = np.hypot(_OF_FIT * best.error[n], _OF_MODEL * self.misfit)
        return FrameStatus.COIL, float(np.hypot(frame_error_px, best.apart[n]))

    def _skeleton(self, line_px: Floats) -> Skeleton:
        body = in_equal_chords(line_px, self.body.half_width / self.body.scale)
        return (
            no_skeleton(FrameStatus.BLOB)
            if body is None
            else replace(body, status=FrameStatus.COIL)
        )


def _unsolved_skeleton(skeleton: Skeleton, status: FrameStatus) -> Skeleton:
    """Skeleton of a frame that is not solved, with its own reason if it may not be a coil."""
    return skeleton if skeleton.status in UNCLEAR_STATUSES else no_skeleton(status)


def _nearest_turns(values: Floats, reference: Floats) -> Floats:
    """The body with its angles moved by full turns next to those of another body."""
    turns = np.rint((values[3:] - reference[3:]).mean() / (2.0 * np.pi))
    out = values.copy()
    out[3:] -= 2.0 * np.pi * turns
    return out
