"""Differences between a replay and its original: first time and joint, largest and RMS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.controller.runlog.column import ROWS, release
from snakewalk.controller.runlog.record import RunRecord


@dataclass(frozen=True, slots=True)
class Difference:
    """One quantity of two runs, row by row over the rows that both have."""

    name: str
    rows: int
    """Rows compared."""
    largest: float
    """Largest absolute difference; inf where only one of the two is known."""
    rms: float
    """Root mean square over all rows and columns that both know."""
    by_column: tuple[float, ...]
    """Largest of each joint, or axis."""
    first_s: float | None
    """Time of the first row that differs; None if none does."""
    first_column: int | None
    """Joint, or axis, of the first difference."""
    first_name: str = ""
    """Name for people: ``joint yaw_05 (ID 5)``, ``y``; empty without a difference."""
    decides: bool = True
    """Whether it has a tolerance; else it is reported only."""

    @property
    def is_equal(self) -> bool:
        """Whether every row agrees."""
        return self.first_s is None


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two runs, side by side."""

    same_config: bool
    cycles: tuple[int, int]
    """Rows of the original and of the replay."""
    differences: tuple[Difference, ...]

    @property
    def is_equal(self) -> bool:
        """Whether the replay equals the original within the tolerances."""
        return self.cycles[0] == self.cycles[1] and all(d.is_equal for d in self.differences)

    @property
    def identical(self) -> bool:
        """Whether no digit differs."""
        return self.is_equal and all(d.largest == 0.0 for d in self.differences)

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "same": self.is_equal,
            "identical": self.identical,
            "same_config": self.same_config,
            "cycles": list(self.cycles),
            "differences": {
                d.name: {
                    "rows": d.rows,
                    "largest": d.largest if np.isfinite(d.largest) else None,
                    "rms": d.rms,
                    "by_column": [x if np.isfinite(x) else None for x in d.by_column],
                    "first_s": d.first_s,
                    "first_column": d.first_column,
                    "first_name": d.first_name,
                    "judged": d.decides,
                }
                for d in self.differences
            },
        }

    def lines(self) -> tuple[str, ...]:
        """Return lines for a reader, the earliest difference first."""
        head = f"{self.cycles[0]} cycles against {self.cycles[1]}"
        if not self.same_config:
            head += "; the configurations differ"
        if self.identical:
            return (f"{head}: the replay is the same to the last digit of the log",)
        order = sorted(self.differences, key=lambda d: np.inf if d.is_equal else (d.first_s or 0.0))
        return (head, *(_line(d) for d in order))


def compare(
    original: RunRecord,
    replay: RunRecord,
    tolerance: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    valid: Bools | None = None,
) -> Comparison:
    """Compare two runs cycle by cycle.

    Args:
        original: of the two.
        replay: the other.
        tolerance: a difference up to this, in SI units, counts as none.
        tolerances: the same for single quantities, by name; infinite: none counts.
        valid: readings (n, J) that count; default: all.

    """
    limits = dict(tolerances or {})
    a, b = original.cycle, replay.cycle
    names = ("asked_rad", "sent_rad", "measured_rad", "velocity_rad_s", "current_a")
    robot = original.header.robot
    joints = tuple(map(robot.joint_label, range(robot.joint_count)))
    pairs: list[tuple[str, tuple[str, ...], Floats, Floats, Floats]] = [
        (name, joints, a.deadline_s, getattr(a, name), getattr(b, name)) for name in names
    ]
    p, q = original.pose, replay.pose
    pairs += [("head_m", ("x", "y", "z"), p.time_s, p.head_m, q.head_m)]
    pairs += [("deadline_s", ("",), a.deadline_s, a.deadline_s[:, None], b.deadline_s[:, None])]
    return Comparison(
        same_config=original.header.config_hash == replay.header.config_hash,
        cycles=(len(a.time_s), len(b.time_s)),
        differences=tuple(
            _difference(
                *pair,
                limits.get(pair[0], tolerance),
                valid if pair[0] in names[2:] else None,
            )
            for pair in pairs
        ),
    )


def _difference(
    name: str,
    columns: Sequence[str],
    time_s: Floats,
    a: Floats,
    b: Floats,
    tolerance: float,
    valid: Bools | None,
) -> Difference:
    rows = min(len(a), len(b))
    if a.shape[1:] != b.shape[1:]:
        first_s = float(time_s[0]) if rows else 0.0
        return Difference(name, rows, float("inf"), float("inf"), (), first_s, None)
    largest = np.zeros(a.shape[1:])
    squares = known = 0.0
    row, column = -1, 0
    for start in range(0, rows, ROWS):
        part = slice(start, min(start + ROWS, rows))
        gap = np.abs(a[part] - b[part])
        gap[np.isnan(a[part]) & np.isnan(b[part])] = 0.0
        gap[np.isnan(gap)] = np.inf
        if valid is not None:
            gap[~valid[part]] = 0.0
        release([a, b])
        largest = np.maximum(largest, gap.max(axis=0))
        finite_values = gap[np.isfinite(gap)]
        squares += float(np.square(finite_values).sum())
        known += finite_values.size
        bad = np.argwhere(gap > tolerance)
        if len(bad) and row < 0:
            row, column = start + int(bad[0][0]), int(bad[0][1])
    rms = float(np.sqrt(squares / max(known, 1.0)))
    sizes = float(largest.max(initial=0.0)), rms, tuple(map(float, largest))
    if row < 0:
        return Difference(name, rows, *sizes, None, None, decides=bool(np.isfinite(tolerance)))
    return Difference(name, rows, *sizes, float(time_s[row]), column, columns[column])


def _line(d: Difference) -> str:
    if d.largest == 0.0:
        return f"{d.name}: same in {d.rows} rows"
    if d.is_equal:
        judged = "within its tolerance" if d.decides else "not judged"
        return f"{d.name}: {judged}; {d.largest:.3g} at most, {d.rms:.3g} RMS"
    where = f", {d.first_name}" if d.first_name else ""
    size = f"{d.largest:.3g} at most, {d.rms:.3g} RMS"
    return f"{d.name}: differs first at {d.first_s:.3f} s{where}; by {size}"
