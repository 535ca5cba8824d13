"""What a walk knows of its ground: the world's own, or the map of a stereo head, as it grows."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.console.result_files import MAP
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.run.walk_run import WalkRun
from snakewalk.controller.runtime.drive import OnEvent, PoseSource
from snakewalk.controller.terrain.growing_map import GrowingMap
from snakewalk.drivers.types import BodyPose, JointState


def map_faults(prepared: PreparedRun, *, metal: bool) -> None:
    """Refuse a run that maps its ground where it cannot.

    Raises:
        InputError: one line per fault, or an extra that mapping needs is not there.

    """
    run, robot = prepared.run, prepared.robot
    if run.mapping is None:
        return
    require_extra("mapping on the way needs", "cv2", "mujoco")
    faults = []
    if robot.stereo_head is None:
        faults.append(
            f"mapping: robot {robot.name} has no stereo head: describe it in its file, table "
            "[stereo_head], or take alternating16-stereo"
        )
    if metal:
        faults.append("mapping: pictures are the simulator's; on servos give the world's map")
    if run.motion not in ("walk", "serpenoid"):
        faults.append(f"mapping: motion {run.motion} plans once; take walk or serpenoid")
    if prepared.ground is None:
        faults.append(f"mapping: world {prepared.world.name} is level; there is nothing to map")
    if not run.pose_is_true:
        faults.append(
            f"mapping: pose {run.pose} knows no heights; the pictures' places come from the "
            "simulator, as from a motion capture"
        )
    if faults:
        raise InputError(faults)


@dataclass
class MapProvider:
    """What a run sees of its ground beside its pose, and afterwards how well."""

    measure: PoseSource
    """Measures the pose, and takes pictures when they are due."""
    ground_map: GrowingMap | None = None
    """None where the walk knows its ground from the world."""
    true_ground: HeightField | None = None
    head_m: float = 0.0
    """Way of the head so far, in plan."""
    head_over_unknown_m: float = 0.0
    """Of it, over ground that was not in the map when the head came there."""
    _last_m: Floats | None = None

    def follow(self, head_m: Floats) -> None:
        """Note where the head (3,) is now."""
        if self.ground_map is not None and self._last_m is not None:
            step_m = float(np.hypot(*(head_m - self._last_m)[:2]))
            self.head_m += step_m
            if not self.ground_map.is_known(float(head_m[0]), float(head_m[1])):
                self.head_over_unknown_m += step_m
        self._last_m = np.array(head_m)

    def facts(self) -> dict[str, float | int]:
        """Numbers for the log and for a command's answer; none where nothing was mapped."""
        ground_map, ground = self.ground_map, self.true_ground
        if ground_map is None or ground is None or not ground_map.known.any():
            return {}
        error_m = np.abs(ground_map.errors_m(ground))
        return {
            "pictures": ground_map.pictures,
            "seen_m2": round(float(ground_map.known.sum()) * ground_map.spacing_m**2, 2),
            "height_error_rms_m": round(float(np.sqrt((error_m**2).mean())), 4),
            "height_error_median_m": round(float(np.median(error_m)), 4),
            "height_error_95_m": round(float(np.quantile(error_m, 0.95)), 4),
            "head_m": round(self.head_m, 2),
            "head_over_unknown_m": round(self.head_over_unknown_m, 2),
        }


@contextmanager
def map_provider(
    prepared: PreparedRun, backend: Backend, measure: PoseSource, folder: Path, on_event: OnEvent
) -> Iterator[MapProvider]:
    """Map the ground on the way, where the run asks for it; the map is left in the run's folder.

    Raises:
        OffscreenError: nothing here draws without a screen.

    """
    provider = MapProvider(measure)
    if not isinstance(prepared, WalkRun) or prepared.ground_map is None:
        yield provider
        return
    from snakewalk.controller.mapping.stereo_head import StereoHead  # noqa: PLC0415  OpenCV, MuJoCo

    ground, clock, ground_map = prepared.ground, backend.clock, prepared.ground_map
    assert ground is not None
    assert backend.qpos is not None
    assert backend.pose is not None
    provider.ground_map, provider.true_ground = ground_map, ground
    ground_map.clear()
    made = StereoHead(
        prepared.run, prepared.robot, prepared.world, ground, backend.qpos, ground_map
    )
    with closing(made) as head:
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
