"""A run in simulated time behind its page, which advances only when a test asks for it."""

import dataclasses
import threading
from pathlib import Path
from typing import Any, Final

from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.hands import Hands
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.observers import Observers
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runtime.drive import Progress
from tests.helpers.browser import PATIENCE_S
from tests.helpers.page_view import PageView

_DRAWN_CYCLES: Final = 10


class SteppedPage:
    """A simulated gait whose page is open before it starts; ``go`` lets it run on."""

    def __init__(self, folder: Path, *, walks: bool = False, **gait: Any) -> None:
        self.view = PageView()
        self.url = self.view.url
        self.port: int = self.view.server.get_port()
        self.stop = self.view.stop
        self.folder = folder
        self.finished: Any = None
        self._walks = walks
        self._gait = {"seconds": 60.0} | gait
        self._until_s = 0.0
        self._turn = threading.Condition()
        self._time_s = -1.0
        self._cycles = 0
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Start the run, up to its first cycle."""
        self._thread.start()
        self.go(0.1)

    def go(self, seconds: float) -> None:
        """Let the run advance by simulated time, or to its end."""
        with self._turn:
            self._until_s += seconds
            until_s = self._until_s
            self._turn.notify_all()
            assert self._turn.wait_for(
                lambda: self._time_s >= until_s or self.finished is not None, PATIENCE_S
            )

    def end(self) -> Any:
        """Let the run end, and return its result."""
        self.go(1e6)
        self._thread.join(PATIENCE_S)
        return self.finished

    def serve(self) -> None:
        """Let the page look at the run's line once more."""
        self.view.page.step()

    def close(self) -> None:
        """Stop the run and the page."""
        if self._thread.ident is not None and self.finished is None:
            self.stop.pressed()
            self.end()
        self.view.close()

    def _run(self) -> None:
        hands = Hands([self.view], self.view)  # type: ignore[list-item, arg-type]
        if self._walks:
            prepared = prepare_walk("flat-slalom", motion="serpenoid", waypoints_m=((0.1, 0.0),))
            self.view.on_course()
            options: dict[str, Any] = {"waypoint_commands": self.view.pressed}
        else:
            gait = prepare_gait("lateral-undulation", **self._gait)
            prepared = dataclasses.replace(gait, make_operator=hands.operator)
            options = {"stop_requested": hands.torque_off}
        result = run_robot(
            RunRequest(
                prepared,
                self.folder,
                observers=Observers(self.view),
                on_progress=self._on_progress,
                **options,
            )
        )
        self.view.page.step()
        with self._turn:
            self.finished = result
            self._turn.notify_all()

    def _on_progress(self, progress: Progress) -> None:
        self.view.now_s = 100.0 + progress.time_s
        self._cycles += 1
        if self._cycles % _DRAWN_CYCLES == 1 or progress.time_s >= self._until_s:
            self.view.page.step()
        with self._turn:
            self._time_s = progress.time_s
            self._turn.notify_all()
            self._turn.wait_for(lambda: progress.time_s < self._until_s)
