"""Faults of observers: the run reports them, and stops if an E-STOP is lost."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, Literal, Protocol, runtime_checkable

from snakewalk.config.arrays import Image
from snakewalk.controller.motion.refusals import Refusals
from snakewalk.controller.runtime.drive import OnProgress, Progress
from snakewalk.drivers.safety.stop_button import StopButton

ADVICE: Final = "to go on in this case: --set run.safety.lost_observer=warn"


class Watcher(Protocol):
    """An observer of a run; each call returns at once."""

    def on_row(self, topic: str, row: bytes) -> None:
        """Accept a row of the log."""
        ...

    def on_button(self, path: Path) -> None:
        """Accept the run's stop button, which the observer may press."""
        ...

    def on_picture(self, image: Image, time_s: float) -> None:
        """Accept a picture (H, W, 3), blue first, of the run's camera, from any thread."""
        ...


@runtime_checkable
class OffersStop(Protocol):
    """An observer with an E-STOP and possibly damaged commands."""

    def lost(self, now_s: float) -> str | None:
        """Return why its E-STOP has failed, or None; called in every read and write."""
        ...

    def rejected(self) -> list[str]:
        """Return why commands were rejected since the last call."""
        ...


class ObserverWatch:
    """Watches the observers of a run; ``report`` and ``stop_requested`` never raise or wait."""

    def __init__(
        self,
        view: Watcher | None,
        policy: Literal["stop", "warn"],
        warn: Callable[[str, str], None],
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Watch a run's observers.

        Args:
            view: the observers; one without an E-STOP is not watched.
            policy: ``safety.lost_observer`` of the run.
            warn: reports (kind, text).
            now_s: clock of the machine.

        """
        self._view: OffersStop | None = view if isinstance(view, OffersStop) else None
        self._policy, self._warn, self._now_s = policy, warn, now_s
        self._refusals = Refusals(lambda why: warn("refused", why))
        self._reported: str | None = None

    def with_stop(
        self, stop_requested: Callable[[], str | None], button: StopButton | None
    ) -> Callable[[], str | None]:
        """Return the reason for torque off of an operator, the button or an observer."""
        return lambda: (
            stop_requested()
            or (None if button is None else button.pressed())
            or self.stop_requested()
        )

    def with_report(self, on_progress: OnProgress) -> OnProgress:
        """Return ``on_progress`` that also reports rejected commands."""

        def progressed(progress: Progress) -> None:
            self.report(progress.time_s)
            on_progress(progress)

        return progressed

    def stop_requested(self) -> str | None:
        """Return why the run has to stop, or None."""
        reason = None if self._view is None else self._view.lost(self._now_s())
        if reason is None:
            return None
        if self._policy == "stop":
            return f"{reason}; {ADVICE}"
        if reason != self._reported:
            self._reported = reason
            self._warn("observer", f"{reason}; the run goes on (safety.lost_observer)")
        return None

    def report(self, time_s: float) -> None:
        """Report rejected commands at a time of the run."""
        if self._view is None:
            return
        for why in self._view.rejected():
            self._refusals.add(why, time_s)
        self._refusals.step(time_s)
