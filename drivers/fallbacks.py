"""Private interfaces of dependencies that snakewalk uses for speed, and their public fallbacks.

One module wraps each, checks it once per process, and reports a fallback here.

| name | wrapped in | fallback |
| --- | --- | --- |
| ``numba`` | ``drivers.compiling`` (option ``_nrt``) | loops count references to their arrays |
| ``cache`` | ``drivers.loop_cache`` (numba's cache of functions) | numba's own folders, or none |
| ``mujoco`` | ``sim.physics.layout`` (memory of ``mjData``) | ``sim.physics.public_steps`` |

The environment variable ``SNAKEWALK_FALLBACK`` forces fallbacks: names, separated by commas.
"""

import logging
import os
from typing import Literal

ENVIRONMENT = "SNAKEWALK_FALLBACK"
Interface = Literal["numba", "cache", "mujoco"]

_reported_fallbacks: dict[Interface, str] = {}


def is_forced(name: Interface) -> bool:
    """Whether the environment asks for the public fallback of an interface."""
    return name in os.environ.get(ENVIRONMENT, "").replace(" ", "").split(",")


def report_fallback(name: Interface, text: str) -> None:
    """Log one warning per process that the fallback of an interface is used."""
    if name not in _reported_fallbacks:
        _reported_fallbacks[name] = text
        logging.getLogger("snakewalk").warning(text)


def fallbacks_in_use() -> tuple[str, ...]:
    """Return the warnings so far; some precede the log handlers of a command."""
    return tuple(_reported_fallbacks.values())
