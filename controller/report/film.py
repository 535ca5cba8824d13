"""Film of a run, from the head pose and the joint angles in its log; on metal too."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField
from snakewalk.controller.metrics.path_error import waypoint_times_s
from snakewalk.controller.runlog.record import Header, RunRecord

if TYPE_CHECKING:
    from snakewalk.sim.rendering.looks import SkinLook

FPS = 15
FINE_FPS = 25
SIZE = (800, 450)
FINE_SIZE = (1280, 720)
_LONGEST_FILM_S = 27.0
"""Longest film: a longer run is shown faster."""
_ROWS = 20_000
"""Least rows that are left of a longer run (ours): 30 for each frame of a film."""


def film_run(
    record: RunRecord,
    path: Path,
    *,
    look: "SkinLook | None" = None,
    fine: bool = False,
    marks: bool = True,
    on_progress: Callable[[int, int], None] | None = None,
) -> int:
    """Draw the film of a run into ``path`` (.mp4); the number of its frames.

    Args:
        record: the run.
        path: of the film; its folder is made.
        look: the body's skin; None is a capsule a link. The waypoints of a dead-reckoned run are
            hollow, and the caption names its pose.
        fine: larger, smoother, and eight times slower to draw.
        marks: draw waypoints, path, contour lines, scale and caption.
        on_progress: called with (frames done, of).

    Raises:
        InputError: the simulator or PyAV is not installed, nothing draws here without a screen, or
            the log holds no two poses.

    """
    film = renderer()
    header = record.header
    time_s, qpos = body_qpos(record)
    if len(time_s) < 2:
        raise InputError("the log holds no two poses: there is nothing to film")
    path.parent.mkdir(parents=True, exist_ok=True)
    plan = header.plan
    measured = header.pose_evidence.is_measured
    drawn: int = film.render_film(
        film.Scene(header.robot, header.world, _ground(header)),
        time_s,
        qpos,
        path,
        style=film.Style(
            fps=FINE_FPS if fine else FPS,
            speed_up=speed_up(float(time_s[-1] - time_s[0])),
            size=FINE_SIZE if fine else SIZE,
            title=header.run.name
            if measured
            else f"{header.run.name}, {header.pose_evidence.text}",
            look=look,
            fine=fine,
        ),
        marks=film.Marks(
            waypoints_m=[(float(x), float(y)) for x, y in plan.waypoints_m],
            waypoint_radius_m=plan.waypoint_radius_m,
            reached_s=[float(t) for t in waypoint_times_s(record.pose, plan)],
            paths=record.paths,
            hollow=not measured,
        )
        if marks
        else None,
        on_frame=on_progress,
    )
    return drawn


def renderer() -> ModuleType:
    """Return the module that draws films."""
    require_extra("films need", "mujoco", "av")
    from snakewalk.sim.rendering import film  # noqa: PLC0415  an extra

    return film


def body_qpos(record: RunRecord) -> tuple[Floats, Floats]:
    """Times (n,) and MuJoCo's coordinates (n, 7 + J) wherever head and joints are known.

    Coordinates that the log holds as such come first; else the head pose, then the joints, measured
    in the same cycle.
    """
    if len(record.qpos.time_s) > 1:
        return record.qpos.time_s, record.qpos.qpos
    pose = record.pose
    count = min(len(pose.time_s), len(record.cycle.time_s))
    rows = slice(0, count, max(1, count // _ROWS))
    head = pose.head_m[rows]
    turn = pose.rotation[rows].reshape(-1, 9)
    joints = record.cycle.measured_rad[rows]
    is_known = np.isfinite(np.hstack([head, turn, joints])).all(axis=1)
    if not is_known.any():
        return np.zeros(0), np.zeros((0, 7 + joints.shape[1]))
    quaternion = Rotation.from_matrix(turn[is_known].reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return pose.time_s[rows][is_known], np.hstack([head[is_known], quaternion, joints[is_known]])


def film_times(record: RunRecord) -> tuple[float, float]:
    """Time of the run at which its film begins, and how many times faster it is."""
    time_s, _ = body_qpos(record)
    if len(time_s) < 2:
        return 0.0, 1.0
    return float(time_s[0]), speed_up(float(time_s[-1] - time_s[0]))


def speed_up(duration_s: float) -> float:
    """How many times faster than its run a film is: whole, and 1 for a short run."""
    return float(max(1, np.ceil(duration_s / _LONGEST_FILM_S)))


def _ground(header: Header) -> HeightField | None:
    """The world's own height field where its source is at hand, else the log's coarser copy."""
    if header.ground is None:
        return None
    try:
        return build_ground(header.world)
    except InputError:
        return header.ground
