"""Who looks on at a run of a command: page and node get the same."""

from pathlib import Path

import numpy as np

from snakewalk.controller.run.observers import Observers, open_observers


class Taker:
    def __init__(self) -> None:
        self.taken: list[object] = []

    def on_row(self, topic: str, row: bytes) -> None:
        self.taken.append((topic, row))

    def on_picture(self, image: np.ndarray, time_s: float) -> None:
        self.taken.append(time_s)

    def on_button(self, path: Path) -> None:
        self.taken.append(path)


def test_both_get_every_row_and_the_button() -> None:
    page, node = Taker(), Taker()
    both = Observers(node, page=page)  # type: ignore[arg-type]
    both.on_button(Path("b"))
    both.on_row("/pose", b"{}")
    both.on_picture(np.zeros((1, 1, 3), np.uint8), 0.5)
    assert page.taken == node.taken == [Path("b"), ("/pose", b"{}"), 0.5]


def test_nobody_looks_on_unless_asked() -> None:
    with open_observers(False, "nowhere", False) as observers:
        assert not observers
