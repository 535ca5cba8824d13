"""Observers of a run: page, ROS node, and plug-ins."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.console.plugins import require
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.motion.refusals import Refusals
from snakewalk.controller.runtime.drive import OnProgress, Progress

PAGE = "page"
ROS = "ros"
SHADOW = "shadow"
"""Observers that have an option of their own."""
GOALS = "goals"
"""Argument of the ROS node of a live run, which accepts goal poses."""
ADVICE = "to go on in this case: --set run.safety.lost_observer=warn"


class RunObserver(Protocol):
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


@runtime_checkable
class OffersWaypoints(Protocol):
    """An observer that commands the waypoints of a live run."""

    def waypoint_commands(self) -> list[str | Refused]:
        """Return the commands since the last call, as ``LiveCourse`` accepts them."""
        ...


class PageControls(RunObserver, OffersStop, Protocol):
    """The page of a run, which may command it."""

    @property
    def is_enabled(self) -> bool:
        """Whether the dead man's button is held; True without one."""
        ...

    def pressed(self) -> Sequence[str | Refused]:
        """Return the settings changed since the last call, and reasons for dropped ones."""
        ...

    def on_gait(self, name: str, parameters: dict[str, float], limit: str = "") -> None:
        """Show the gait that an operator runs."""
        ...

    def on_course(self) -> None:
        """Accept waypoints by clicks."""
        ...


class Observers:
    """All observers of a run: passes rows on to them and watches their E-STOPs.

    ``stop_requested`` and ``report`` never raise or wait.
    """

    def __init__(
        self,
        *observers: RunObserver,
        page: PageControls | None = None,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        """Collect observers.

        Args:
            observers: all but the page.
            page: the page, which may also command the run.
            now_s: clock of the machine.

        """
        self.page = page
        """Page of the run; None without a page."""
        self._all: list[RunObserver] = [*([] if page is None else [page]), *observers]
        self._with_waypoints = [
            observer for observer in observers if isinstance(observer, OffersWaypoints)
        ]
        self._with_stop = [observer for observer in self._all if isinstance(observer, OffersStop)]
        self._policy: Literal["stop", "warn"] = "stop"
        self._warn: Callable[[str, str], None] = lambda kind, text: None
        self._refusals = Refusals(lambda why: self._warn("refused", why))
        self._reported: str | None = None
        self._now_s = now_s

    def __bool__(self) -> bool:
        """Whether there is an observer."""
        return bool(self._all)

    def watch(self, policy: Literal["stop", "warn"], warn: Callable[[str, str], None]) -> None:
        """Set ``safety.lost_observer`` of the run, and what reports (kind, text)."""
        self._policy = policy
        self._warn = warn

    def on_row(self, topic: str, row: bytes) -> None:
        """Pass a row of the log on."""
        for observer in self._all:
            observer.on_row(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Pass a picture on."""
        for observer in self._all:
            observer.on_picture(image, time_s)

    def on_button(self, path: Path) -> None:
        """Pass the stop button on."""
        for observer in self._all:
            observer.on_button(path)

    def waypoint_commands(self) -> list[str | Refused]:
        """Return the commands for waypoints since the last call."""
        commands: list[str | Refused] = [] if self.page is None else [*self.page.pressed()]
        for observer in self._with_waypoints:
            commands += observer.waypoint_commands()
        return commands

    def lost(self) -> str | None:
        """Return which E-STOPs have failed, and why, or None."""
        now_s = self._now_s()
        reasons = [why for observer in self._with_stop if (why := observer.lost(now_s)) is not None]
        return "; ".join(reasons) or None

    def stop_requested(self) -> str | None:
        """Return why the run has to stop, or None."""
        reason = self.lost()
        if reason is None:
            return None
        if self._policy == "stop":
            return f"{reason}; {ADVICE}"
        if reason != self._reported:
            self._reported = reason
            self._warn("observer", f"{reason}; the run goes on (safety.lost_observer)")
        return None

    def reporting(self, on_progress: OnProgress) -> OnProgress:
        """Return ``on_progress`` that also reports rejected commands."""
        if not self._with_stop:
            return on_progress

        def progressed(progress: Progress) -> None:
            for observer in self._with_stop:
                for why in observer.rejected():
                    self._refusals.add(why, progress.time_s)
            self._refusals.step(progress.time_s)
            on_progress(progress)

        return progressed


def open_observer(name: str, argument: str) -> AbstractContextManager[Any]:
    """Return the observer of a plug-in.

    Raises:
        InputError: the observer does not exist.

    """
    opened: AbstractContextManager[Any] = require("observer", name, "--observe").load()(argument)
    return opened


@contextmanager
def open_observers(
    view: bool,
    view_at: str,
    ros: bool,
    observe: Sequence[str] | None = None,
    *,
    live: bool = False,
) -> Iterator[Observers]:
    """Open the requested observers.

    Args:
        view: open the page.
        view_at: HOST:PORT of the page.
        ros: open the ROS node.
        observe: ``NAME[:ARGUMENT]`` of further observers.
        live: let page and ROS node command the waypoints of the run.

    Raises:
        InputError: the observer does not exist, or it cannot be opened.

    """
    with ExitStack() as stack:
        page = stack.enter_context(open_observer(PAGE, view_at)) if view else None
        others = [stack.enter_context(open_observer(ROS, GOALS if live else ""))] if ros else []
        for text in observe or ():
            name, _, argument = text.partition(":")
            if name in (PAGE, ROS, SHADOW):
                option = {PAGE: "--view", ROS: "--ros", SHADOW: "--shadow"}[name]
                raise InputError(f"--observe {text}: use {option}")
            others.append(stack.enter_context(open_observer(name, argument)))
        yield Observers(*others, page=page)
