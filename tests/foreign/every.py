"""All generated files."""

from collections.abc import Iterator

from tests.foreign import grounds, motions, robots, situations, tracks
from tests.foreign.case import Case


def every_case() -> Iterator[Case]:
    """Yield the cases of all kinds."""
    for module in (motions, tracks, grounds, robots, situations):
        yield from module.cases()
