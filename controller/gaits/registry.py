"""The gaits by name."""

from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.controller.gaits.compound_serpenoid import CompoundSerpenoid
from snakewalk.controller.gaits.concertina import Concertina
from snakewalk.controller.gaits.erect import ErectTrot, ErectWalk
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.gaits.helix import HelixPipe, HelixPole
from snakewalk.controller.gaits.lateral_undulation import LateralUndulation
from snakewalk.controller.gaits.rectilinear import Rectilinear
from snakewalk.controller.gaits.rolling import Rolling
from snakewalk.controller.gaits.sidewinding import Sidewinding
from snakewalk.controller.gaits.spine import (
    Anguilliform,
    Carangiform,
    Dolphin,
    SpineGait,
    Subcarangiform,
    Thunniform,
)
from snakewalk.controller.gaits.trot import LateralWalk, Trot
from snakewalk.controller.gaits.turn_in_place import TurnInPlace

GAITS: dict[str, type[Gait]] = {
    gait.name: gait
    for gait in (
        LateralUndulation,
        Sidewinding,
        Rolling,
        TurnInPlace,
        Rectilinear,
        Concertina,
        CompoundSerpenoid,
        HelixPole,
        HelixPipe,
        Anguilliform,
        Subcarangiform,
        Carangiform,
        Thunniform,
        Dolphin,
        Trot,
        LateralWalk,
        ErectWalk,
        ErectTrot,
    )
}

SPINE_GAITS: tuple[str, ...] = tuple(
    name for name, gait in GAITS.items() if issubclass(gait, SpineGait)
)
"""Names of the gaits that move a spine without a robot."""


def make_gait(name: str, values: dict[str, Any] | None = None, source: str = "") -> Gait:
    """Make a gait by its name with parameters in place of defaults.

    Raises:
        InputError: no such gait, unknown parameters, values out of range; one line each.

    """
    from snakewalk.controller.gaits import spine_heading  # noqa: F401, PLC0415  compiled here, never within a run

    if name not in GAITS:
        raise InputError(f"{name}: no such gait; there are {', '.join(GAITS)}")
    return GAITS[name].of(values, source)
