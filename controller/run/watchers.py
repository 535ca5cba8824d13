"""Observers of a run: page, ROS node, and plug-ins."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.console.plugins import require
from snakewalk.controller.motion.command import Refused
from snakewalk.controller.run.observer_watch import OffersStop, Watcher

PAGE, ROS, SHADOW = "page", "ros", "shadow"
"""Observers that have an option of their own."""
GOALS = "goals"
"""Argument of the ROS node of a live run, which accepts goal poses."""


class PageControls(Watcher, OffersStop, Protocol):
    """The page of a run, which may command it."""

    @property
    def is_enabled(self) -> bool:
        """Whether the dead man's button is held; True without one."""
        ...

    def pressed(self) -> Sequence[str | Refused]:
        """Return the settings changed since the last call, and reasons for dropped ones."""
        ...

    def on_gait(self, name: str, parameters: dict[str, float]) -> None:
        """Show the gait that an operator runs."""
        ...

    def on_course(self) -> None:
        """Accept waypoints by clicks."""
        ...


@runtime_checkable
class OffersWaypoints(Protocol):
    """An observer that commands the waypoints of a live run."""

    def waypoint_commands(self) -> list[str | Refused]:
        """Return the commands since the last call, as ``LiveCourse`` accepts them."""
        ...


class Watchers:
    """A ``Watcher`` that passes on what it receives."""

    def __init__(self, page: PageControls | None, *others: Watcher | None) -> None:
        self.page = page
        """The page of the run, which may also command it; None without a page."""
        self._watchers: list[Watcher] = [one for one in (page, *others) if one is not None]
        self._with_waypoints = [
            one for one in self._watchers if one is not page and isinstance(one, OffersWaypoints)
        ]
        self._with_stop = [one for one in self._watchers if isinstance(one, OffersStop)]

    def on_row(self, topic: str, row: bytes) -> None:
        """Pass a row of the log on."""
        for each in self._watchers:
            each.on_row(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Pass a picture on."""
        for each in self._watchers:
            each.on_picture(image, time_s)

    def lost(self, now_s: float) -> str | None:
        """Return which E-STOPs have failed, and why, or None."""
        reasons = [why for each in self._with_stop if (why := each.lost(now_s)) is not None]
        return "; ".join(reasons) or None

    def rejected(self) -> list[str]:
        """Return why commands were rejected since the last call."""
        return [why for each in self._with_stop for why in each.rejected()]

    def waypoint_commands(self) -> list[str | Refused]:
        """Return the commands for waypoints since the last call."""
        commands: list[str | Refused] = [] if self.page is None else [*self.page.pressed()]
        for each in self._with_waypoints:
            commands += each.waypoint_commands()
        return commands

    def on_button(self, path: Path) -> None:
        """Pass the stop button on."""
        for each in self._watchers:
            each.on_button(path)


def open_observer(name: str, argument: str = "") -> AbstractContextManager[Any]:
    """Return the observer of a plug-in.

    Raises:
        InputError: the observer does not exist.

    """
    opened: AbstractContextManager[Any] = require("observer", name, "--observe").load()(argument)
    return opened


@contextmanager
def watched(
    view: bool,
    view_at: str,
    ros: bool,
    observe: Sequence[str] | None = None,
    *,
    live: bool = False,
) -> Iterator[Watchers | None]:
    """Open the requested observers; None without any.

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
        yield Watchers(page, *others) if page is not None or others else None
