"""Progress on standard error: one bar, and events in lines above it."""

import logging
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Self, TypeVar

from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from snakewalk.controller.console.messages import LOGGER, stderr_console
from snakewalk.drivers.clock import Clock, WallClock

if TYPE_CHECKING:
    from snakewalk.controller.runtime.drive import Progress as RunProgress

T = TypeVar("T")
EVERY = 10
"""Cycles of a run between two updates."""
REFRESH_HZ = 4.0
"""Rate at which a terminal shows the bar (ours): drawing it uses as much CPU time as a cycle."""


class ProgressBar:
    """A bar with description, share, note and time; ``transient`` bars vanish at the end.

    ``remaining`` adds an estimate of the remaining time.
    """

    def __init__(
        self,
        description: str,
        total: float | None = None,
        *,
        transient: bool = False,
        remaining: bool = False,
    ) -> None:
        console = stderr_console()
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),  # a file may be named [red]
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[note]}", markup=False),
            TimeElapsedColumn(),
            *([TextColumn("remaining"), TimeRemainingColumn()] if remaining else []),
            console=console,
            transient=transient,
            auto_refresh=console.is_terminal,  # elsewhere only the last state is printed
            refresh_per_second=REFRESH_HZ,
        )
        self._task = self._progress.add_task(description, total=total, note="")

    def __enter__(self) -> Self:
        """Show the bar."""
        self._progress.__enter__()
        return self

    def __exit__(self, *raised: Any) -> None:
        """Leave the last state, or nothing of a transient bar."""
        if self._progress.live.transient:
            self._progress.live.stop()  # the other way leaves an empty line in a file
        else:
            self._progress.stop()

    def update(
        self,
        done: float,
        total: float | None = None,
        *,
        description: str | None = None,
        note: str = "",
    ) -> None:
        """Show that ``done`` of ``total`` is done; None keeps total or description."""
        self._progress.update(
            self._task, completed=done, total=total, description=description, note=note
        )

    def advance(self) -> None:
        """Show that one more is done."""
        self._progress.advance(self._task)

    def hide(self) -> None:
        """Remove the bar, because its task failed."""
        self._progress.live.transient = True
        self._progress.update(self._task, visible=False)

    def on_event(self, kind: str, text: str) -> None:
        """Show an event of a run above the bar; a failed climb is a warning."""
        LOGGER.log(logging.WARNING if kind == "climb" else logging.INFO, "%s", text)


class RunBar(ProgressBar):
    """Bar of a run, updated every few cycles; subclasses define its content."""

    def __init__(self, description: str, total: float) -> None:
        super().__init__(description, total)
        self.total = total
        self._cycles = 0

    def __exit__(self, *raised: Any) -> None:
        """Remove the bar of a run that failed before its first cycle."""
        if raised[0] is not None and self._cycles == 0:
            self.hide()
        super().__exit__(*raised)

    def _is_due(self, progress: "RunProgress") -> bool:
        self._cycles += 1
        return self._cycles % EVERY == 0 or progress.done


class PathBar(RunBar):
    """Bar with the progress along the path, waypoint and speed."""

    def __init__(self, path_m: float) -> None:
        super().__init__("ramp", path_m)

    def on_progress(self, progress: "RunProgress") -> None:
        """Update every few cycles."""
        if self._is_due(progress):
            is_complete = progress.done and progress.reached == progress.waypoints
            self.update(
                self.total if is_complete else progress.along_m,  # the last waypoint has a radius
                description=f"waypoint {progress.reached}/{progress.waypoints}",
                note=f"{progress.time_s:5.1f} s  {progress.speed_m_s:5.2f} m/s",
            )


class TimeBar(RunBar):
    """Share of the elapsed time of a gait, or of any task of known duration.

    ``name_at`` returns the present motion at an elapsed time, s: a run may change its gait.
    """

    def __init__(
        self, name: str, seconds: float, name_at: Callable[[float], str] | None = None
    ) -> None:
        super().__init__(name, seconds)
        self._name_at = name_at if name_at is not None else lambda gone_s: name
        self._start_s: float | None = None

    def on_progress(self, progress: "RunProgress") -> None:
        """Update every few cycles."""
        if self._start_s is None:
            self._start_s = progress.time_s
        if self._is_due(progress):
            gone_s = progress.time_s - self._start_s
            done_s = self.total if progress.done else gone_s
            self.update(done_s, description=self._name_at(gone_s), note=f"{gone_s:5.1f} s")


def in_real_time(
    on_progress: "Callable[[RunProgress], None]",
) -> "Callable[[RunProgress], None]":
    """Slow a simulated run to real time."""
    clock = WallClock()
    ahead_s: float | None = None

    def wait(progress: "RunProgress") -> None:
        nonlocal ahead_s
        on_progress(progress)
        if ahead_s is None:
            ahead_s = clock.now_s() - progress.time_s
        clock.sleep_until_s(progress.time_s + ahead_s)

    return wait


def show_progress(
    items: Iterable[T],
    description: str,
    total: int,
    *,
    done: int = 0,
    transient: bool = True,
    clock: Clock | None = None,
) -> Iterator[T]:
    """Yield items under a bar that counts them; ``done`` of ``total`` were done before.

    The bar estimates the remaining time from the items finished under it.
    """
    clock = clock or WallClock()
    start_s = clock.now_s()
    with ProgressBar(description, total, transient=transient) as bar:
        bar.update(done)
        for number, item in enumerate(items, start=done + 1):
            try:
                yield item
            except GeneratorExit:  # the caller failed, and reports it
                bar.hide()
                raise
            rate_hz = (number - done) / max(clock.now_s() - start_s, 1e-9)
            bar.update(number, note=remaining_note((total - number) / rate_hz))


def remaining_note(seconds: float) -> str:
    """Remaining time as text, in two units at most; empty below a second."""
    minutes = round(seconds / 60.0)
    if seconds < 1.0:
        return ""
    if seconds < 90.0:
        return f"about {seconds:.0f} s remain"
    if minutes < 90:
        return f"about {minutes} min remain"
    hours, minutes = divmod(minutes, 60)
    if hours < 48:
        return f"about {hours} h {minutes} min remain"
    days, hours = divmod(hours, 24)
    return f"about {days} d {hours} h remain"
