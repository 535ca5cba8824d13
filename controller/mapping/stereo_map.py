"""The robot's stereo head as a map source: only seen ground is known."""

from collections.abc import Iterator
from contextlib import closing, contextmanager

import numpy as np

from snakewalk.controller.console.command import plugin
from snakewalk.controller.console.result_files import MAP
from snakewalk.controller.mapping.stereo_head import StereoHead
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.map_provider import MapContext, MapProvider
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.drivers.types import BodyPose, JointState


@plugin("map", "stereo")
class StereoMap:
    """A map from the pictures of the robot's stereo head."""

    def faults(self, prepared: PreparedRun, *, on_port: bool) -> list[str]:
        """Return why the head cannot map the ground here, one line per fault."""
        run = prepared.run
        robot = prepared.robot
        faults = []
        if robot.stereo_head is None:
            faults.append(
                f"mapping: robot {robot.name} has no stereo head; add the table [stereo_head] "
                "to its file, or use alternating16-stereo"
            )
        if on_port:
            faults.append("mapping: pictures are the simulator's; on servos give the world's map")
        if run.motion not in ("walk", "serpenoid"):
            faults.append(f"mapping: motion {run.motion} plans only once; use walk or serpenoid")
        if prepared.ground is None:
            faults.append(f"mapping: world {prepared.world.name} is level; there is nothing to map")
        if not run.pose_is_true:
            faults.append(
                f"mapping: pose {run.pose} knows no heights; the pictures' places come from the "
                "simulator, as from a motion capture"
            )
        return faults

    @contextmanager
    def open(self, context: MapContext) -> Iterator[MapProvider]:
        """Map the ground during the run; the map is stored in the run's folder.

        Raises:
            OffscreenError: no off-screen OpenGL.

        """
        prepared = context.prepared
        backend = context.backend
        measure = context.measure
        folder = context.folder
        on_event = context.on_event
        provider = MapProvider(measure)
        if not isinstance(prepared, WalkRun) or prepared.ground_map is None:
            yield provider
            return
        ground = prepared.ground
        clock = backend.clock
        ground_map = prepared.ground_map
        assert ground is not None
        assert backend.qpos is not None
        assert backend.pose is not None
        provider.ground_map = ground_map
        provider.true_ground = ground
        ground_map.clear()
        stereo_head = StereoHead(
            prepared.run, prepared.robot, prepared.world, ground, backend.qpos, ground_map
        )
        with closing(stereo_head) as head:
            head.observe(clock.now_s(), backend.pose(), backend.qpos()[7:])
            head.fuse(np.inf)  # the run begins when the first picture is matched

            def measured(state: JointState) -> BodyPose:
                pose = measure(state)
                head.observe(clock.now_s(), pose, state.position_rad)
                provider.follow(pose.head_in_world_m)
                return pose

            provider.measure = measured
            yield provider
        ground_map.write(folder / MAP)
        on_event("map", ", ".join(f"{key} {value}" for key, value in provider.facts().items()))
