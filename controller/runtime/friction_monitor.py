"""Estimates the friction under the body during its motion.

Every second and a half, less often while the file's friction holds, a model replays the measured
motion under three frictions, one per cycle. The best one gives the estimate. The model is a twin,
or the balance of forces on a level floor.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.mechanics.friction_filter import FoundFriction, FrictionFilter
from snakewalk.controller.mechanics.rigid_motion import planar_slide
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.controller.walk.twin import Twin, seen_state
from snakewalk.drivers.attitude import about_up

SPAN_S = 1.5
"""Duration of motion that is replayed (ours): in a shorter span the initial speed counts too much,
in a longer one bodies diverge."""
_SETTLED_SPANS = 4
_RESTS = 3
"""Spans that are skipped behind each replayed one, after ``_SETTLED_SPANS`` spans in a row that
confirm the file's friction (ours): a quarter of the cost; a change is visible up to 4.5 s later."""
_STRIDE = 5
"""Cycles in a step on paper."""


@dataclass(frozen=True, slots=True)
class Span:
    """A span of measured motion of C cycles."""

    views: tuple[BodyView, ...]
    """(C + 2) at the cycles: the first is the one before it begins."""
    goals_rad: tuple[Floats, ...]
    """C of (J,): goals sent in each cycle."""
    cycle_s: float

    @property
    def slid(self) -> Floats:
        """(3,) way ahead and to the left of the mean line, m, and turn, rad."""
        end = self.views[-1]
        return self.slid_to(end.centre_m[:2], end.heading_rad)

    def slid_to(self, centre_m: Floats, heading_rad: float) -> Floats:
        """(3,) motion of a body that came to another centre (2,) and mean heading."""
        begin = self.views[1]
        mean = begin.heading_rad
        way_m = (centre_m - begin.centre_m[:2]) @ about_up(mean)[:2, :2]
        return np.append(way_m, heading_rad - mean)


class SlideModel(Protocol):
    """Foretells where a body comes to."""

    @property
    def sigma(self) -> tuple[float, float, float]:
        """Standard deviations, m, m and rad."""
        ...

    def slid(self, span: Span, friction: FrictionConfig) -> Floats:
        """(3,) as ``Span.slid``, on ground with this friction; NaN without a prediction."""
        ...


class OnTwin:
    """A ``SlideModel``: physics moves a second body by the goals that were sent."""

    sigma: Final = (0.012, 0.012, 0.035)
    """Slightly more than the median error with the true friction on rough slopes, 3 mm and 0.6
    degrees in a second (ours): a stuck link is sometimes far off."""

    def __init__(self, robot: RobotConfig, make_twin: Callable[[], Twin]) -> None:
        self._robot = robot
        self._make_twin = make_twin

    def slid(self, span: Span, friction: FrictionConfig) -> Floats:
        """As ``SlideModel``."""
        twin = self._make_twin()
        robot = self._robot
        twin.use_friction(friction)
        (before, before_rad), (now, now_rad) = (seen_state(robot, v) for v in span.views[:2])
        try:
            twin.begin(before, now, before_rad, now_rad, span.cycle_s)
            for goal_rad in span.goals_rad:
                now, now_rad = twin.step(goal_rad, span.cycle_s)
        except RuntimeError:  # it has diverged
            return np.full(3, np.nan)
        end = body_in_world(robot, now, now_rad)
        return span.slid_to(end.centre_m[:2], end.heading_rad)


class OnPaper:
    """A ``SlideModel`` of a level floor: friction under the measured shapes is in balance."""

    sigma: Final = (0.02, 0.02, 0.05)
    """Includes the error of a camera (ours). The model is invalid on hills: few links bear the
    body, and the error would look like friction."""

    def __init__(self) -> None:
        self._span: Span | None = None
        self._shapes = np.empty((0, 0)), np.empty((0, 0, 2)), np.empty(0)

    def slid(self, span: Span, friction: FrictionConfig) -> Floats:
        """As ``SlideModel``."""
        if self._span is not span:  # the shapes are those of every friction
            self._span, self._shapes = span, _shapes(span)
        begin = span.views[1]
        *place_m, heading = planar_slide(*self._shapes, begin.heading_rad, friction)
        return span.slid_to(begin.centre_m[:2] + place_m, heading)


def _shapes(span: Span) -> tuple[Floats, Floats, Floats]:
    """Headings (n, L) and centres (n, L, 2) of the links about those of the body, every few cycles.

    Last the times (n - 1,) between them, s.
    """
    last = len(span.views) - 1
    view_indices = np.array([*range(1, last, _STRIDE), last])
    headings = np.array([span.views[k].headings_rad for k in view_indices])
    points = np.array(
        [(span.views[k].link_m - span.views[k].centre_m)[:, :2] for k in view_indices]
    )
    mean = headings.mean(axis=1)[:, None]
    x, y, c, s = points[..., 0], points[..., 1], np.cos(mean), np.sin(mean)
    turned = np.stack([c * x + s * y, c * y - s * x], axis=-1)
    return headings - mean, turned, np.diff(view_indices) * span.cycle_s


class FrictionMonitor(FrictionEstimator):
    """Replays measured motion under three frictions by a model."""

    def __init__(
        self,
        file: FrictionConfig,
        model: SlideModel,
        cycle_s: float,
        use: Callable[[FrictionConfig], None],
    ) -> None:
        """Begin with the file's friction.

        Args:
            file: of the world.
            model: foretells motion.
            cycle_s: length of a control cycle.
            use: called with the friction to use when it changes. This is the file's until the run
                contradicts it.

        """
        super().__init__(file, use)
        self._model = model
        self._cycle_s = cycle_s
        self._filter = FrictionFilter(file, model.sigma)
        self._count = max(1, round(SPAN_S / cycle_s))
        self._views: list[BodyView] = []
        self._goals_rad: list[Floats] = []
        self._replays: Iterator[FoundFriction | None] = iter(())
        self._rests = 0
        self._since_s = 0.0

    def update(self, view: BodyView, goal_rad: Floats) -> FoundFriction | None:
        """Process a cycle, as ``FrictionEstimator``."""
        self._views.append(view)
        self._goals_rad.append(goal_rad)
        if len(self._views) == self._count + 2:
            self._since_s += self._count * self._cycle_s
            if self._rests > 0:
                self._rests -= 1
            else:
                span = Span(tuple(self._views), tuple(self._goals_rad[2:]), self._cycle_s)
                self._replays = self._judge(span)
            del self._views[:-2], self._goals_rad[:-2]
        identified = next(self._replays, None)
        if identified is not None:
            self.accept(identified)
            self._rests = _RESTS if self._confirmed >= _SETTLED_SPANS else 0
        return identified

    def _judge(self, span: Span) -> Iterator[FoundFriction | None]:
        """Replay a span, a hypothesis a cycle; the result comes last."""
        predicted = []
        for friction in self._filter.hypotheses():
            predicted.append(self._model.slid(span, friction))
            yield None
        since_s = self._since_s
        self._since_s = 0.0
        yield self._filter.update(span.slid, np.array(predicted), since_s)
