"""The stages of a capture after the detector, in their order."""

from collections.abc import Sequence

from snakewalk.controller.capture.coil_film import Repair
from snakewalk.controller.capture.staged_film import Stage
from snakewalk.controller.capture.stages.complete import Complete
from snakewalk.controller.capture.stages.head import Identify
from snakewalk.controller.capture.stages.outlier_frames import Compare
from snakewalk.controller.capture.verification.film_check import Verify
from snakewalk.controller.console.plugins import Plugin, plugins

STAGES: dict[str, type[Stage]] = {
    "compare": Compare,
    "repair": Repair,
    "identify": Identify,
    "complete": Complete,
    "verify": Verify,
}
"""The first stage of each frame, ``Detector.detect``, comes before them."""


def stages(offered: Sequence[Plugin] | None = None) -> list[Stage]:
    """All stages; a plug-in replaces the one of its name, or follows the last one.

    ``offered`` are the plug-ins of kind ``stage``; None: those that are installed.
    """
    loaded = {
        plugin.name: plugin.load() for plugin in (plugins("stage") if offered is None else offered)
    }
    return [stage() for stage in (STAGES | loaded).values()]
