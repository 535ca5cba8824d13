"""What a person sees of a gait run, and a simulated one held to real time for an operator."""

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from controller.runtime.guide import Guide
from drivers.clock import Clock, WallClock


class GaitProgress:
    """A bar over the gait's seconds, on standard error; what is said stands above it."""

    def __init__(self, name: str, seconds: float) -> None:
        self._progress = Progress(
            TextColumn(name),
            BarColumn(),
            TextColumn("{task.fields[now]}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._task = self._progress.add_task(name, total=seconds, now="")
        self._start_s: float | None = None
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

    def cycle(self, time_s: float, pilot: Guide, speed_m_s: float) -> None:
        """Update, not in every cycle."""
        if self._start_s is None:
            self._start_s = time_s
        self._cycles += 1
        if self._cycles % 10 == 0 or pilot.done:
            gone_s = time_s - self._start_s
            self._progress.update(self._task, completed=gone_s, now=f"{gone_s:5.1f} s")

    def note(self, text: str) -> None:
        """Print a line above the bar."""
        self._progress.console.print(text)


class RealTime:
    """Holds a simulated run to the pace of a person's clock."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or WallClock()
        self._ahead_s: float | None = None

    def cycle(self, time_s: float, pilot: Guide, speed_m_s: float) -> None:
        """Wait until the wall clock has come to the run's time."""
        if self._ahead_s is None:
            self._ahead_s = self._clock.now_s() - time_s
        self._clock.sleep_until_s(time_s + self._ahead_s)
