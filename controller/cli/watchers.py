"""Who looks on at a run of a command: its page, its ROS node, both or nobody."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from snakewalk.config.arrays import Image
from snakewalk.controller.ros.ros_link import RosLink, open_ros
from snakewalk.controller.ros.ros_options import RosOptions
from snakewalk.controller.view.live_view import LiveView, open_view


class Watchers:
    """A ``Watcher`` that passes on what it takes."""

    def __init__(self, page: LiveView | None, node: RosLink | None) -> None:
        self.page = page
        self._watchers = [each for each in (page, node) if each is not None]

    def on_row(self, topic: str, row: bytes) -> None:
        """Give a row to each."""
        for each in self._watchers:
            each.on_row(topic, row)

    def on_picture(self, image: Image, time_s: float) -> None:
        """Give a picture to each."""
        for each in self._watchers:
            each.on_picture(image, time_s)

    def on_button(self, path: Path) -> None:
        """Give the stop button to each."""
        for each in self._watchers:
            each.on_button(path)


@contextmanager
def watched(view: bool, view_at: str, ros: bool) -> Iterator[Watchers | None]:
    """Open what is asked for, and say where it is; None where nothing is."""
    with open_view(view, view_at) as page, open_ros(RosOptions() if ros else None) as node:
        yield Watchers(page, node) if page or node else None
