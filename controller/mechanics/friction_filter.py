"""Friction filter: estimate the friction under a body from its slides.

An extended Kalman filter on the logarithms of the friction along and across. It starts at the world
file's friction and returns to it without measurements. A model predicts each span of motion under
three hypotheses; the real motion corrects the estimate.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig

PRIOR = 0.4
"""Standard deviation of the logarithm about the file's (ours): half to twice it in 95 %."""
_MEMORY_S = 40.0
"""Time in which the estimate returns to the file by a factor of e (ours)."""
_STRAY = 0.1
"""Difference of the friction of one span from that of the ground (ours): no single span is more
accurate, however far the body slid."""
STEP = 0.1
"""Step of the logarithms, between the hypotheses (ours)."""
_LARGEST_CHANGE = 0.3
"""Largest change of an estimate by a span (ours)."""
_BOUND = math.log(4.0)
DOUBT_99, DOUBT_95 = 9.21, 5.99
"""Squared distance of the file from the estimate, in standard deviations, from which on the file is
out: 99 % and 95 % of chi square with two degrees of freedom."""
_ESTIMATED_VARIANCE = 0.6
"""Variance, divided by the prior's, below which a value counts as estimated (ours): 0.5 on a floor,
which shows only the ratio."""
_TRUST = 1.39
"""Squared distance of the file from the estimate below which the file holds again: 50 %."""
_NORMAL_95 = 1.96
_ROOT = math.sqrt(0.5)


class _Square(NamedTuple):
    """A symmetric 2 x 2 matrix; a fixed order of sums gives the same bits on every machine."""

    uu: float
    uv: float
    vv: float

    @property
    def inverse(self) -> "_Square":
        determinant = self.uu * self.vv - self.uv * self.uv
        return _Square(self.vv / determinant, -self.uv / determinant, self.uu / determinant)

    def plus(self, other: "_Square", times: float = 1.0) -> "_Square":
        """Return the sum with ``times`` another matrix."""
        return _Square(*(a + times * b for a, b in zip(self, other, strict=True)))

    def times(self, u: float, v: float) -> tuple[float, float]:
        return self.uu * u + self.uv * v, self.uv * u + self.vv * v

    def about(self, u: float, v: float) -> float:
        a, b = self.times(u, v)
        return u * a + v * b


class SlideEvidence(NamedTuple):
    """Evidence of a span of motion about the friction, linearised at the filter's estimate."""

    information: _Square
    """Inverse covariance of (u, v), in the filter's axes."""
    pull_u: float
    """Product of the information and the correction of u, v."""
    pull_v: float
    square: float
    """Squared difference between motion and prediction, in standard deviations."""
    rows: int
    """Number of independent measurements in the square."""


def ratio_evidence(information: float, pull: float, square: float, rows: int) -> SlideEvidence:
    """Return evidence of motion that shows only v (along against across)."""
    return SlideEvidence(_Square(0.0, 0.0, information), 0.0, pull, square, rows)


def slide_evidence(information: Floats, pull: Floats, square: float, rows: int) -> SlideEvidence:
    """Return the evidence of an information (2, 2) and a pull (2,) on u and v."""
    uu, uv, vv = (float(information[k]) for k in ((0, 0), (0, 1), (1, 1)))
    return SlideEvidence(_Square(uu, uv, vv), float(pull[0]), float(pull[1]), square, rows)


@dataclass(frozen=True, slots=True)
class FoundFriction:
    """Present results."""

    friction: FrictionConfig
    """Best estimate."""
    along_95: tuple[float, float]
    """Interval of 95 %."""
    across_95: tuple[float, float]
    differs: bool
    """Whether the file's friction is out."""
    is_estimated: bool = True
    """Whether motion made both intervals narrower; otherwise the values are the file's."""

    @property
    def spread(self) -> float:
        """Greater one of the two factors between the ends of an interval."""
        (low, high), (least, most) = self.along_95, self.across_95
        return max(high / low, most / least)


class FrictionFilter:
    """Estimates the friction along and across a body.

    The axes are u, both logarithms together, and v, along against across. A level floor gives no
    information about u.
    """

    def __init__(
        self,
        file: FrictionConfig,
        sigma: Sequence[float] = (),
        prior: float = PRIOR,
        doubt: float = DOUBT_99,
    ) -> None:
        """Start at the file's friction.

        Args:
            file: friction of the world.
            sigma: three standard deviations of the model's predictions, in the units of ``update``.
            prior: standard deviation of the logarithms about the file's.
            doubt: squared distance from which on the file is out.

        """
        self._file = file
        self._doubt = doubt
        self._weights = [1.0 / sigma_value**2 for sigma_value in sigma]
        self._prior = _Square(prior**2, 0.0, prior**2)
        self._u = self._v = 0.0
        self._covariance = self._prior
        self._differs = False

    def hypotheses(self) -> tuple[FrictionConfig, ...]:
        """Return the three hypotheses for the next prediction, the estimate first."""
        u, v = self._u, self._v
        return self._friction(u, v), self._friction(u + STEP, v), self._friction(u, v + STEP)

    def update(self, measured: Floats, predicted: Floats, span_s: float) -> FoundFriction:
        """Process a span of motion.

        Args:
            measured: (3,) distance ahead and to the left, m, and turn, rad.
            predicted: (3, 3) prediction under each of ``hypotheses``; the span is ignored if any
                value is not finite.
            span_s: duration.

        """
        rows = [measured.tolist(), *predicted.tolist()]
        is_finite = all(math.isfinite(reading) for row in rows for reading in row)
        return self.absorb(self._evidence(*rows) if is_finite else None, span_s)

    def absorb(self, evidence: SlideEvidence | None, span_s: float) -> FoundFriction:
        """Process the evidence of a span of motion; None: no evidence."""
        kept = math.exp(-span_s / _MEMORY_S)
        before = _Square(*(kept**2 * entry for entry in self._covariance))
        self._covariance = before.plus(self._prior, 1.0 - kept**2)
        if evidence is not None:
            self._correct(evidence)
        self._u = min(max(kept * self._u, -_BOUND), _BOUND)
        self._v = min(max(kept * self._v, -_BOUND), _BOUND)
        away = self._covariance.inverse.about(self._u, self._v)
        self._differs = away > (_TRUST if self._differs else self._doubt)
        return self.found

    def _evidence(
        self, measured: list[float], predicted: list[float], by_u: list[float], by_v: list[float]
    ) -> SlideEvidence:
        """Return the evidence of the difference between motion and prediction."""
        gap = [m - h for m, h in zip(measured, predicted, strict=True)]
        gap[2] = math.remainder(gap[2], 2.0 * math.pi)
        slopes = [
            ((a - h) / STEP, (b - h) / STEP) for a, b, h in zip(by_u, by_v, predicted, strict=True)
        ]
        misfit = 0.0
        information = _Square(0.0, 0.0, 0.0)
        pull_u = 0.0
        pull_v = 0.0
        for weight, g, (u, v) in zip(self._weights, gap, slopes, strict=True):
            misfit += weight * g * g
            information = information.plus(_Square(u * u, u * v, v * v), weight)
            pull_u, pull_v = pull_u + weight * u * g, pull_v + weight * v * g
        return SlideEvidence(information, pull_u, pull_v, misfit, len(gap))

    def _correct(self, evidence: SlideEvidence) -> None:
        information, pull_u, pull_v, square, rows = evidence
        span, about = self._of_span(information, 1.0)
        excess = max(1.0, (square - about.about(pull_u, pull_v)) / rows)
        span, about = self._of_span(information, excess)  # a large deviation counts less
        u, v = about.times(pull_u / excess, pull_v / excess)
        cov = self._covariance
        to_span = span.inverse
        u, v = cov.times(*to_span.times(u, v))
        self._u += min(max(u, -_LARGEST_CHANGE), _LARGEST_CHANGE)
        self._v += min(max(v, -_LARGEST_CHANGE), _LARGEST_CHANGE)
        less = span.plus(about, -1.0)
        first, second = (to_span.times(*row) for row in ((cov.uu, cov.uv), (cov.uv, cov.vv)))
        both = less.times(*second)
        self._covariance = _Square(
            cov.uu - less.about(*first),
            cov.uv - (first[0] * both[0] + first[1] * both[1]),
            cov.vv - less.about(*second),
        )

    def _of_span(self, information: _Square, excess: float) -> tuple[_Square, _Square]:
        """Covariance of one span's friction before and after it; ``excess`` scales noise."""
        span = self._covariance.plus(_Square(_STRAY**2, 0.0, _STRAY**2), excess)
        return span, span.inverse.plus(information, 1.0 / excess).inverse

    @property
    def found(self) -> FoundFriction:
        """Present estimate."""
        mean, (uu, uv, vv) = self._friction(self._u, self._v), self._covariance
        mid = 0.5 * (uu + vv)
        along = math.exp(_NORMAL_95 * math.sqrt(mid + uv))
        across = math.exp(_NORMAL_95 * math.sqrt(mid - uv))
        return FoundFriction(
            mean,
            (mean.along / along, mean.along * along),
            (mean.across / across, mean.across * across),
            self._differs,
            mid + abs(uv) < _ESTIMATED_VARIANCE * self._prior.uu,
        )

    def _friction(self, u: float, v: float) -> FrictionConfig:
        """Scale the file's friction: one factor along (also backward), one across."""
        file = self._file
        along = math.exp(_ROOT * (u + v))
        across = math.exp(_ROOT * (u - v))
        back = None if file.back is None else min(file.back * along, 5.0)
        given = {"along": min(file.along * along, 5.0), "across": min(file.across * across, 5.0)}
        return FrictionConfig(**given, back=back, law=file.law)
