"""The order of the packages: each one imports only packages that stand above it in these lists.

``docs/architecture.md`` explains the packages, ``test_layout`` checks the code against this order,
and ``docs/pictures/tools/layout_diagram.py`` draws it.
"""

from typing import Final

TOPS: Final = ("config", "drivers", "sim", "controller")
CORE: Final = (
    *("kinematics", "mechanics", "shape", "terrain", "gaits", "motion", "runlog", "walk"),
    *("runtime", "track", "pose", "metrics", "console", "images", "figures", "run"),
)
"""Packages of the controller that know no feature package; only ``run`` knows bus and simulator."""
FEATURES: Final = (
    *("capture", "animals", "cameras", "mapping", "repertoire", "bench", "report", "studies"),
    *("view", "exchange", "ros", "learning", "cli"),
)
"""Packages of the controller that may import every core package, but not each other."""
BETWEEN_FEATURES: Final[dict[tuple[str, str], str]] = {}
"""Imports between feature packages, (from, to), each with its reason."""
MOST_BETWEEN: Final = 10
ORDER: Final = {
    "config": ("config",),
    "drivers": (
        *("drivers", "drivers.protocol", "drivers.port", "drivers.bus", "drivers.chain"),
        "drivers.safety",
    ),
    "sim": (
        *("sim", "sim.servo", "sim.line", "sim.faults", "sim.sniff", "sim.ax12", "sim.serve"),
        *("sim.physics", "sim.rendering"),
    ),
    "controller": tuple(f"controller.{name}" for name in (*CORE, *FEATURES)),
}
"""All packages, from the bottom up."""
VOCABULARY: Final = frozenset(
    {"types", "clock", "errors", "link", "compiling", "least_squares", "attitude"}
)
"""Modules of the drivers that every core package may import."""
JOINING: Final = frozenset({"run", *FEATURES})
"""Packages of the controller that may import the bus and the simulator."""
PENDING: Final[dict[str, frozenset[str]]] = {
    "controller.animals.mesh.body_motion": frozenset({"controller.report.film"}),
    "controller.animals.synthesis.synthesis_skin": frozenset({"controller.report.film"}),
    "controller.bench.commands.cable_drop": frozenset({"controller.exchange.commands.listing"}),
    "controller.cameras.camera_page": frozenset(
        {"controller.view.live_view", "controller.view.page_server"}
    ),
    "controller.console.completion": frozenset({"controller.animals.mesh.body_motion"}),
    "controller.console.options": frozenset(
        {"controller.report.artifacts", "controller.run.execute"}
    ),
    "controller.images.mesh_files": frozenset({"controller.animals.mesh.mesh"}),
    "controller.learning.commands.policy": frozenset({"controller.cli.watchers"}),
    "controller.learning.policy_trials": frozenset({"controller.studies.sweep_measure"}),
    "controller.pose.pose_provider": frozenset(
        {
            "controller.cameras.camera_pose",
            "controller.cameras.device_camera",
            "controller.cameras.rendered_camera",
            "controller.run.backend",
            "controller.run.prepared_run",
        }
    ),
    "controller.repertoire.commands.playback": frozenset({"controller.cli.watchers"}),
    "controller.repertoire.commands.repertoire": frozenset({"controller.cli.watchers"}),
    "controller.report.artifacts": frozenset({"controller.animals.mesh.body_look"}),
    "controller.report.commands.report": frozenset({"controller.animals.mesh.body_look"}),
    "controller.report.film": frozenset({"controller.animals.mesh.bone_motion"}),
    "controller.ros.commands.ros": frozenset(
        {"controller.cli.watchers", "controller.exchange.body_frames", "controller.view.live_view"}
    ),
    "controller.ros.ros_node": frozenset({"controller.exchange.ros_messages"}),
    "controller.run.commands.gait_run": frozenset(
        {"controller.cli.watchers", "controller.view.live_view"}
    ),
    "controller.run.commands.plan": frozenset(
        {"controller.repertoire.commands.repertoire", "controller.repertoire.repertoire_planning"}
    ),
    "controller.run.commands.play": frozenset({"controller.cli.watchers"}),
    "controller.run.commands.run": frozenset(
        {"controller.animals.mesh.body_look", "controller.cli.watchers"}
    ),
    "controller.run.execute": frozenset(
        {
            "controller.report.artifacts",
            "controller.studies.shadow.diagnosis",
            "controller.studies.shadow.run_shadow",
        }
    ),
    "controller.run.factory": frozenset(
        {"controller.repertoire.repertoire", "controller.repertoire.schedule_run"}
    ),
    "controller.run.map_provider": frozenset({"controller.mapping.stereo_head"}),
    "controller.studies.replay": frozenset({"controller.repertoire.repertoire_run"}),
    "controller.view.commands.view": frozenset({"controller.studies.run_comparison"}),
}
"""Upward imports that are still to be removed, by module."""
