"""What a person sees while a run goes on: how far along the path, which waypoint, how fast."""

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from controller.runtime.guide import Guide


class PathProgress:
    """A progress bar on standard error; silent where that is no terminal."""

    def __init__(self, path_m: float, waypoints: int) -> None:
        self._waypoints = waypoints
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.fields[now]}"),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._task = self._progress.add_task("ramp", total=path_m, now="")
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
        self._cycles += 1
        if self._cycles % 10 and not pilot.done:
            return
        self._progress.update(
            self._task,
            description=f"waypoint {pilot.reached}/{self._waypoints}",
            completed=pilot.along_m,
            now=f"{time_s:5.1f} s  {speed_m_s:5.2f} m/s",
        )

    def note(self, text: str) -> None:
        """Print a line above the bar."""
        self._progress.console.print(text)
