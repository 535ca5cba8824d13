"""Names of the motions of people, and of the equations of their feet."""

from enum import StrEnum
from typing import Literal

MotionName = Literal["walk", "run"]


class FeetLaw(StrEnum):
    """Equations of the feet."""

    PRINTED = "printed"
    """The law of Eq. 9 and 10 as printed."""
    PHASES = "phases"
    """Eq. 9 and 10, the feet half a cycle apart and never below the ground."""
    PLANTED = "planted"
    """The law of Eq. 9 and 10 with feet that keep their place while they are on the ground."""
