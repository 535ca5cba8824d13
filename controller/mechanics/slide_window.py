"""Friction from noisy poses of the head over a window of time.

The joints give the body's shape in each cycle, and the balance of friction predicts its motion.
Each head pose has noise. The start of the body and the errors of the model are unknown too;
generalised least squares estimates them together with the friction, so that noise does not look
like friction.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.friction_filter import (
    STEP,
    SlideEvidence,
    ratio_evidence,
    slide_evidence,
)
from snakewalk.controller.mechanics.rigid_motion import planar_slide

BIN_S = 0.25
"""Time within which poses are averaged (ours)."""
NOISE_S = 0.1
"""Time after which the noise of a source is taken as independent (ours): averages of more poses
count no more."""
STRIDE = 5
"""Cycles in a step of the balance."""
MODEL_M2_S = 1e-4
MODEL_RAD2_S = 1e-3
"""Growth of the variances of the model's place and heading (ours): 10 mm and 1.8 degrees in a
second. With true poses the residuals of `flat-slalom` are about a quarter of that."""
START_M = 1.0
START_RAD = 0.5
"""Standard deviations of the body's start (ours): practically unknown."""
FEWEST = 6
"""Least number of bins that contain a pose (ours)."""


@dataclass(frozen=True, slots=True)
class HeadReadings:
    """Measured poses of the head link."""

    time_s: Floats
    """(N,) times of the poses, s."""
    place: Floats
    """(N, 3) x, y (m) and heading (rad)."""
    variance: Floats
    """(N, 3) variances of the poses."""

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True, slots=True)
class SlideWindow:
    """The shapes of a body in C cycles, head first, in the frame of its mean heading."""

    time_s: Floats
    """(C,) times of the shapes, s."""
    headings_rad: Floats
    """(C, L) of the links, about the mean heading."""
    points_m: Floats
    """(C, L, 2) centres of the links about the body's."""
    start: Floats
    """(3,) x, y and mean heading in the first cycle: a first estimate."""
    load: Floats | None = None
    """(C, L, 3) gravity on the links, as ``planar_slide`` accepts it; None on a level floor."""

    @property
    def knots(self) -> list[int]:
        """Cycles at the ends of the bins."""
        cycle_s = float(self.time_s[-1] - self.time_s[0]) / (len(self.time_s) - 1)
        every = max(1, round(BIN_S / cycle_s))
        return list(range(0, len(self.time_s), every))

    def track(self, friction: FrictionConfig) -> Floats:
        """Return centre and heading (K, 3) of the body at the knots, under a friction."""
        knots = self.knots
        rows = [self.start]
        for begin, end in pairwise(knots):
            knot_indices = np.array([*range(begin, end, STRIDE), end])
            x, y, heading = planar_slide(
                self.headings_rad[knot_indices],
                self.points_m[knot_indices],
                np.diff(self.time_s[knot_indices]),
                float(rows[-1][2]),
                friction,
                None if self.load is None else self.load[knot_indices],
            )
            rows.append(np.array([rows[-1][0] + x, rows[-1][1] + y, heading]))
        return np.array(rows)

    def heads(self, track: Floats, time_s: Floats) -> Floats:
        """Return x, y and heading (N, 3) of the head link at times, for a track of the body."""
        knots_s = self.time_s[self.knots]
        x, y, heading = (np.interp(time_s, knots_s, column) for column in track.T)
        ahead, left = (np.interp(time_s, self.time_s, self.points_m[:, 0, k]) for k in (0, 1))
        c, s = np.cos(heading), np.sin(heading)
        bend = np.interp(time_s, self.time_s, self.headings_rad[:, 0])
        return np.column_stack([x + c * ahead - s * left, y + s * ahead + c * left, heading + bend])

    def evidence(
        self, readings: HeadReadings, track: Floats, by_ratio: Floats, by_both: Floats | None = None
    ) -> SlideEvidence | None:
        """Return the readings' evidence about the friction; None if they are too few.

        Args:
            readings: within the window.
            track: from ``track``, under the friction that the filter estimates.
            by_ratio: from ``track``, one step along the filter's second axis.
            by_both: likewise along its first axis; None on a level floor, where it has no effect.

        """
        knots_s = self.time_s[self.knots]
        bins = np.clip(np.searchsorted(knots_s, readings.time_s, "right") - 1, 0, len(knots_s) - 2)
        counts = np.bincount(bins, minlength=len(knots_s) - 1)
        kept = np.flatnonzero(counts)
        tracks = [by_ratio] if by_both is None else [by_both, by_ratio]
        if len(kept) < FEWEST or not all(
            np.isfinite(head_track).all() for head_track in (track, *tracks)
        ):
            return None

        def averages(values: Floats) -> Floats:
            sums = [np.bincount(bins, column, len(counts))[kept] for column in values.T]
            return np.column_stack(sums) / counts[kept, None]

        current = self.heads(track, readings.time_s)
        off = readings.place - current
        off[:, 2] = np.angle(np.exp(1j * off[:, 2]))
        independent = np.minimum(counts[kept], BIN_S / NOISE_S)
        noise = averages(readings.variance) / independent[:, None]
        covariance = _model_covariance(averages(current), track[:-1], kept) + np.diag(noise.ravel())
        slopes = [
            averages((self.heads(head_track, readings.time_s) - current) / STEP).ravel()
            for head_track in tracks
        ]
        columns = np.column_stack([averages(off).ravel(), *slopes])
        products = columns.T @ np.linalg.solve(covariance, columns)
        square = float(products[0, 0])
        rows = len(columns) - 3
        if by_both is None:
            return ratio_evidence(float(products[1, 1]), float(products[1, 0]), square, rows)
        return slide_evidence(products[1:, 1:], products[1:, 0], square, rows)


def _model_covariance(heads: Floats, track: Floats, kept: np.ndarray) -> Floats:
    """Return the covariance (3 B, 3 B) of heads (B, 3) by errors of start and model.

    A model error in a bin moves or turns the body about its centre, in that bin and all later ones.

    Args:
        heads: predicted, mean of each bin that counts.
        track: (K - 1, 3) body at the start of each bin.
        kept: (B,) bins that count.

    """
    effects = []
    starts = [(-1, track[0], START_M, START_RAD)]
    steps = [
        (k, row, (MODEL_M2_S * BIN_S) ** 0.5, (MODEL_RAD2_S * BIN_S) ** 0.5)
        for k, row in enumerate(track)
    ]
    for begin, centre, move_m, turn_rad in starts + steps:
        since = (kept >= begin).astype(float)
        arm = heads[:, :2] - centre[:2]
        turned = np.column_stack([-arm[:, 1], arm[:, 0], np.ones(len(heads))])
        effects.append((turn_rad * since[:, None] * turned).ravel())
        for axis in (0, 1):
            moved = np.zeros((len(heads), 3))
            moved[:, axis] = move_m * since
            effects.append(moved.ravel())
    table = np.array(effects)
    return np.asarray(table.T @ table)
