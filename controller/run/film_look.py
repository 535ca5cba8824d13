"""The look of the body in a film: servos, or a plug-in of the kind ``look``."""

from typing import TYPE_CHECKING, Final, Protocol

from snakewalk.controller.console.plugins import find, require
from snakewalk.controller.runlog.record import Header

if TYPE_CHECKING:
    from snakewalk.sim.rendering.looks import SkinLook

SERVOS: Final = "servos"
"""A capsule per link."""
ANIMAL: Final = "animal"
"""The animal of the run's recording."""
_BODY: Final = "body"
"""Plug-in of all other looks: names and files of bodies."""


class LookPlugin(Protocol):
    """A look, as a plug-in provides it."""

    def check(self, look: str) -> None:
        """Reject an impossible look before a run."""
        ...

    def make(self, look: str, header: Header) -> "SkinLook":
        """Return the skin of a run's film."""
        ...


def check_look(look: str) -> None:
    """Reject an impossible look before a run.

    Raises:
        InputError: the look does not exist, or an extra is missing.

    """
    if look != SERVOS:
        _plugin(look).check(look)


def film_look(look: str, header: Header) -> "SkinLook | None":
    """Return the skin of a run's film; None is a capsule per link.

    Raises:
        InputError: the look does not exist, or an extra is missing.

    """
    return None if look == SERVOS else _plugin(look).make(look, header)


def _plugin(look: str) -> LookPlugin:
    found = find("look", look) or find("look", _BODY) or require("look", look, "--look", [SERVOS])
    made: LookPlugin = found.load()()
    return made
