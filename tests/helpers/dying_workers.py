"""Work that ends its own process: for workers, which import nothing else of the tests."""

import os
import signal
from pathlib import Path


def square(item: tuple[str, int, int]) -> int:
    """Square a number; the process is killed the first few times that it meets the item.

    ``item`` holds a folder for marks, the number, and how often the process dies.
    """
    folder, number, deaths = item
    marks = sorted(Path(folder).glob(f"{number}-*"))
    if len(marks) < deaths:
        (Path(folder) / f"{number}-{len(marks)}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2
