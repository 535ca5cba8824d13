"""Progress of a run for a person: a bar on standard error, and events in lines above it."""

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from snakewalk.controller.runtime.drive import Progress as RunProgress

EVERY = 10
"""Cycles between two updates."""


class RunBar:
    """The bar, and when it is updated; subclasses define what it shows."""

    def __init__(self, words: str, total: float) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[now]}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._task = self._progress.add_task(words, total=total, now="")
        self._cycles = 0

    def __enter__(self) -> Self:
        """Show the bar."""
        self._progress.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the last state standing."""
        self._progress.__exit__(kind, error, trace)

    def _is_due(self, progress: RunProgress) -> bool:
        """Count a cycle; return whether the bar is updated with it."""
        self._cycles += 1
        return self._cycles % EVERY == 0 or progress.done

    def on_event(self, kind: str, text: str) -> None:
        """Print a line above the bar."""
        self._progress.console.print(text)


class PathBar(RunBar):
    """How far along the path, which waypoint, how fast."""

    def __init__(self, path_m: float, waypoints: int) -> None:
        super().__init__("ramp", path_m)
        self._waypoints = waypoints

    def on_progress(self, progress: RunProgress) -> None:
        """Update, not in every cycle."""
        if self._is_due(progress):
            self._progress.update(
                self._task,
                description=f"waypoint {progress.reached}/{self._waypoints}",
                completed=progress.along_m,
                now=f"{progress.time_s:5.1f} s  {progress.speed_m_s:5.2f} m/s",
            )


class TimeBar(RunBar):
    """How much of its time a gait, or anything else that takes a known time, has gone."""

    def __init__(self, name: str, seconds: float) -> None:
        super().__init__(name, seconds)
        self._start_s: float | None = None

    def on_progress(self, progress: RunProgress) -> None:
        """Update, not in every cycle."""
        if self._start_s is None:
            self._start_s = progress.time_s
        if self._is_due(progress):
            gone_s = progress.time_s - self._start_s
            self._progress.update(self._task, completed=gone_s, now=f"{gone_s:5.1f} s")
