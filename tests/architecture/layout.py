"""The order of the packages: each one imports only packages that stand above it in these lists.

``docs/architecture.md`` explains the packages, ``test_layout`` checks the code against this order,
and ``docs/pictures/tools/layout_diagram.py`` draws it.
"""

from typing import Final

TOPS: Final = ("config", "drivers", "sim", "controller")
CORE: Final = (
    *("kinematics", "mechanics", "shape", "terrain", "gaits", "motion", "runlog", "walk"),
    *("runtime", "console", "track", "pose", "metrics", "images", "figures", "run"),
)
"""Packages of the controller that know no feature package; only ``run`` knows bus and simulator."""
FEATURES: Final = (
    *("capture", "animals", "cameras", "mapping", "repertoire", "bench", "report", "studies"),
    *("rehearsal", "validation", "view", "exchange", "ros", "learning", "cli"),
)
"""Packages of the controller that may import every core package, but not each other."""
BETWEEN_FEATURES: Final[dict[tuple[str, str], str]] = {
    ("animals", "report"): "an animated skin is drawn by the film of a run",
    ("cameras", "view"): "camera check shows its findings on the live page",
    ("learning", "studies"): "policies are compared by the measures of a sweep",
    ("repertoire", "view"): "a crowd is steered on the page",
    ("ros", "exchange"): "a live node and an exported bag have the same messages",
    ("view", "bench"): "the demonstration compiles the loops while a recorded run plays",
    ("view", "studies"): "a page of several logs shows their comparison",
}
"""Imports between feature packages, (from, to), each with its reason."""
MOST_BETWEEN: Final = 10
ORDER: Final = {
    "config": ("config",),
    "drivers": (
        *("drivers", "drivers.protocol", "drivers.port", "drivers.bus", "drivers.chain"),
        "drivers.safety",
    ),
    "sim": (
        *("sim", "sim.servo", "sim.line", "sim.faults", "sim.sniff", "sim.ax12", "sim.feetech"),
        *("sim.serve", "sim.physics", "sim.batch", "sim.rendering"),
    ),
    "controller": tuple(f"controller.{name}" for name in (*CORE, *FEATURES)),
}
"""All packages, from the bottom up."""
VOCABULARY: Final = frozenset(
    {
        *("types", "clock", "errors", "link", "compiling", "compilation", "fallbacks"),
        *("least_squares", "attitude"),
    }
)
"""Modules of the drivers that every core package may import."""
JOINING: Final = frozenset({"run", *FEATURES})
"""Packages of the controller that may import the bus and the simulator."""


def package_of(module: str) -> str:
    """Return the package of a module (dotted, without ``snakewalk``)."""
    parts = module.split(".")
    name = ".".join(parts[:2])
    return name if name in ORDER[parts[0]] else parts[0]
