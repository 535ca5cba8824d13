"""Friction under a body whose pose another program measures: from the measured poses themselves.

The filtered pose of a run cannot show it: between two measurements it follows dead reckoning, which
assumes the friction. The estimator compares the measured poses with the motion that the balance of
friction predicts for the joints. This is valid on a level floor.
"""

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.mechanics.friction_filter import FoundFriction, FrictionFilter
from snakewalk.controller.mechanics.slide_window import HeadReadings, SlideWindow
from snakewalk.controller.pose.external_pose import MeasuredHeads, TimedHead
from snakewalk.controller.runtime.friction_monitor import FrictionEstimator

WINDOW_S: Final = 4.0
"""Duration of motion that is compared at once (ours): the noise of slow sources averages out."""
LATE_S: Final = 0.5
"""Poses that arrive later after the end of a window do not count (ours)."""
PRIOR: Final = 0.56
"""Standard deviation of the logarithms about the file's friction (ours): a third to three times
the file's in 95 %. On a level floor only the ratio of both frictions can be measured; the rest of
an interval comes from here."""


class _Cycle(NamedTuple):
    time_s: float
    place: Floats
    headings_rad: Floats
    points_m: Floats


class MeasuredFriction(FrictionEstimator):
    """Call ``update`` once a cycle."""

    def __init__(
        self,
        file: FrictionConfig,
        measured: Callable[[], MeasuredHeads],
        use: Callable[[FrictionConfig], None],
    ) -> None:
        """Begin with the file's friction.

        Args:
            file: of the world.
            measured: returns the measured poses since the last call.
            use: called with the friction to use when it changes. This is the file's until the run
                contradicts it.

        """
        super().__init__(file, use)
        self._measured = measured
        self._filter = FrictionFilter(file, prior=PRIOR)
        self._cycles: list[_Cycle] = []
        self._heads: list[TimedHead] = []
        self._steps: Iterator[FoundFriction | None] = iter(())

    def update(self, view: BodyView, goal_rad: Floats) -> FoundFriction | None:
        """Process the body, and the poses that have arrived; the goals do not count."""
        now_s, heads = self._measured()
        self._heads += heads
        self._cycles.append(_cycle(now_s, view))
        begin_s = self._cycles[0].time_s
        end_s = begin_s + WINDOW_S
        newest_s = heads[-1].time_s if heads else begin_s
        if newest_s > end_s or now_s > end_s + LATE_S:
            self._steps = self._judge(begin_s, end_s)
            self._cycles = [each for each in self._cycles if each.time_s > end_s]
            self._heads = [each for each in self._heads if each.time_s > end_s]
        found = next(self._steps, None)
        if found is not None:
            self.accept(found)
        return found

    def _judge(self, begin_s: float, end_s: float) -> Iterator[FoundFriction | None]:
        """Compare a window with two hypotheses, one a cycle; the result comes last."""
        cycles = [each for each in self._cycles if each.time_s <= end_s]
        heads = [each for each in self._heads if begin_s <= each.time_s <= end_s]
        return self._steps_of(cycles, heads)

    def _steps_of(
        self, cycles: list[_Cycle], heads: list[TimedHead]
    ) -> Iterator[FoundFriction | None]:
        times, places, headings, points = (np.array(each) for each in zip(*cycles, strict=True))
        window = SlideWindow(times, headings, points, places[0])
        here, _, by_ratio = self._filter.hypotheses()
        track = window.track(here)
        yield None
        farther = window.track(by_ratio)
        yield None
        evidence = window.evidence(_readings(heads), track, farther) if heads else None
        yield self._filter.absorb(evidence, WINDOW_S)


def _cycle(time_s: float, view: BodyView) -> _Cycle:
    headings = view.headings_rad
    mean = float(headings.mean())
    points = (view.link_m - view.centre_m)[:, :2]
    c, s = np.cos(mean), np.sin(mean)
    x, y = points[:, 0], points[:, 1]
    turned = np.column_stack([c * x + s * y, c * y - s * x])
    return _Cycle(time_s, np.array([*view.centre_m[:2], mean]), headings - mean, turned)


def _readings(heads: list[TimedHead]) -> HeadReadings:
    place, variance = [], []
    for _, head in heads:
        heading = np.arctan2(head.rotation[1, 0], head.rotation[0, 0])
        place.append([*head.position_m[:2], heading])
        (xx, yy), turn = np.diag(head.position_covariance)[:2], head.rotation_covariance[2, 2]
        variance.append([xx, yy, turn])
    times = np.array([each.time_s for each in heads])
    return HeadReadings(times, np.array(place), np.array(variance))
