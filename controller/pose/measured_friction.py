"""Friction under a body with a measured pose, from the measured poses themselves.

The filtered pose cannot show it: between measurements it follows dead reckoning, which assumes the
friction. The estimator compares measured poses with the predicted motion of the joints under
friction and gravity. This is valid only where the ground under the body is a plane, so that all
links bear the body.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.mechanics.friction_filter import (
    DOUBT_95,
    DOUBT_99,
    FoundFriction,
    FrictionFilter,
)
from snakewalk.controller.mechanics.slide_window import HeadReadings, SlideWindow
from snakewalk.controller.mechanics.slope_load import slope_load
from snakewalk.controller.pose.external_pose import MeasuredHeads, TimedHead
from snakewalk.controller.runtime.friction_estimator import FrictionEstimator
from snakewalk.drivers.attitude import about_up, heading_of

WINDOW_S = 4.0
"""Duration of motion that is compared at once (ours): the noise of slow sources averages out."""
LATE_S = 0.5
"""Poses that arrive later after the end of a window do not count (ours)."""
PRIOR = 0.56
"""Standard deviation of the logarithms about the file's friction (ours): 95 % are within a third to
three times. A level floor shows only the ratio of the frictions; this gives the rest of an
interval."""
ROUGH_M = 0.005
"""Root mean square distance of the ground under the links from a plane, above which the motion does
not count (ours)."""
SPREAD = 3.0
"""Largest ratio of an interval's ends at which the use of an estimate begins on a slope (ours). It
ends when the estimate agrees with the file again."""


class _Cycle(NamedTuple):
    time_s: float
    place: Floats
    headings_rad: Floats
    points_m: Floats
    links_m: Floats


class MeasuredFriction(FrictionEstimator):
    """Call ``update`` once a cycle."""

    def __init__(
        self,
        file: FrictionConfig,
        measured: Callable[[], MeasuredHeads],
        use: Callable[[FrictionConfig], None],
        ground: HeightField | None = None,
    ) -> None:
        """Begin with the file's friction.

        Args:
            file: of the world.
            measured: returns the measured poses since the last call.
            use: called with the friction to use when it changes. This is the file's until the run
                contradicts it.
            ground: None is a level floor.

        """
        super().__init__(file, use)
        self._measured = measured
        self._ground = ground
        doubt = DOUBT_99 if ground is None else DOUBT_95
        self._filter = FrictionFilter(file, prior=PRIOR, doubt=doubt)
        self._cycles: list[_Cycle] = []
        self._heads: list[TimedHead] = []
        self._steps: Iterator[FoundFriction | None] = iter(())

    def update(self, view: BodyView, goal_rad: Floats) -> FoundFriction | None:
        """Process the body, and the poses that have arrived; the goals do not count."""
        now_s, heads, has_slid = self._measured()
        if has_slid:  # no balance of friction with the motion of the joints: the window ends
            self._cycles.clear()
            self._heads.clear()
            self._steps = iter(())
        self._heads += heads
        self._cycles.append(_cycle(now_s, view))
        begin_s = self._cycles[0].time_s
        end_s = begin_s + WINDOW_S
        newest_s = heads[-1].time_s if heads else begin_s
        if newest_s > end_s or now_s > end_s + LATE_S:
            self._steps = self._judge(begin_s, end_s)
            self._cycles = [cycle for cycle in self._cycles if cycle.time_s > end_s]
            self._heads = [head for head in self._heads if head.time_s > end_s]
        identified = next(self._steps, None)
        if identified is not None:
            self.accept(identified)
        return identified

    def _judge(self, begin_s: float, end_s: float) -> Iterator[FoundFriction | None]:
        """Compare a window with two hypotheses, one a cycle; the result comes last."""
        cycles = [cycle for cycle in self._cycles if cycle.time_s <= end_s]
        heads = [head for head in self._heads if begin_s <= head.time_s <= end_s]
        return self._steps_of(cycles, heads)

    def _steps_of(
        self, cycles: list[_Cycle], heads: list[TimedHead]
    ) -> Iterator[FoundFriction | None]:
        columns = (np.array(column) for column in zip(*cycles, strict=True))
        times, places, headings, points, links = columns
        window = SlideWindow(times, headings, points, places[0])
        ground = self._ground
        if ground is not None:
            if any(
                _roughness_m(ground, link_points) > ROUGH_M for link_points in links[window.knots]
            ):
                yield self._filter.absorb(None, WINDOW_S)
                return
            window = replace(
                window, load=np.array([np.column_stack(slope_load(ground, link)) for link in links])
            )
            yield None
        hypothesis, by_both, by_ratio = self._filter.hypotheses()
        track = window.track(hypothesis)
        yield None
        farther = window.track(by_ratio)
        yield None
        other = None if ground is None else window.track(by_both)
        evidence = window.evidence(_readings(heads), track, farther, other) if heads else None
        yield self._filter.absorb(evidence, WINDOW_S)

    def accept(self, identified: FoundFriction) -> None:
        """As ``FrictionEstimator``; on a slope the use begins only with narrow intervals."""
        is_used = self._used != self._file
        if self._ground is not None and not is_used and identified.spread > SPREAD:
            identified = replace(identified, differs=False)
        super().accept(identified)


def _cycle(time_s: float, view: BodyView) -> _Cycle:
    headings = view.headings_rad
    mean = float(headings.mean())
    points = (view.link_m - view.centre_m)[:, :2]
    turned = points @ about_up(mean)[:2, :2]
    place = np.array([*view.centre_m[:2], mean])
    return _Cycle(time_s, place, headings - mean, turned, view.link_m[:, :2])


def _roughness_m(ground: HeightField, links_m: Floats) -> float:
    """Return the root mean square distance in height of the ground at (L, 2) from a plane."""
    offset_m = links_m - links_m.mean(axis=0)
    table = np.column_stack([offset_m, np.ones(len(offset_m))])
    height_m = ground.plane(links_m[:, 0], links_m[:, 1])[0]
    away_m = height_m - table @ np.linalg.lstsq(table, height_m, rcond=None)[0]
    return float(np.sqrt(np.mean(away_m**2)))


def _readings(heads: list[TimedHead]) -> HeadReadings:
    place = []
    variance = []
    for _, head in heads:
        heading = heading_of(head.rotation)
        place.append([*head.position_m[:2], heading])
        (xx, yy), turn = np.diag(head.position_covariance)[:2], head.rotation_covariance[2, 2]
        variance.append([xx, yy, turn])
    times = np.array([head_place.time_s for head_place in heads])
    return HeadReadings(times, np.array(place), np.array(variance))
