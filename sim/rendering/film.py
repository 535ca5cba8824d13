"""Recorded poses as a film: a chase camera, ground, waypoints, paths, trails and a scale."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.sim.rendering.follow_camera import BodyTrack, follow
from snakewalk.sim.rendering.looks import (
    Marks,
    Scene,
    SkinLook,
    dressed_model,
    mark_reached,
    mark_size,
)
from snakewalk.sim.rendering.movie_file import MovieFile
from snakewalk.sim.rendering.offscreen import Offscreen
from snakewalk.sim.rendering.shade import SoftShade, add_sheet, link_surface_m, surface_points_m
from snakewalk.sim.rendering.trail import AXES_GEOMS, add_axes, make_trail

_LEGEND = "\nhead purple, centre blue"
"""Colours of the tracks of head and body."""


@dataclass(frozen=True, slots=True)
class Style:
    """Style of a film."""

    fps: int = 25
    """Frames a second of film."""
    speed_up: float = 1.0
    """Seconds of run a second of film."""
    size: tuple[int, int] = (960, 540)
    """Even width and height, pixels."""
    title: str = ""
    """Title in the caption of a film."""
    look: SkinLook | None = None
    """Skin of the body; None draws a capsule for each link."""
    fine: bool = False
    """Smooth edges, at three times the cost."""


def render_film(
    scene: Scene,
    time_s: ArrayLike,
    qpos: ArrayLike,
    path: Path,
    *,
    style: Style,
    marks: Marks | None,
    on_frame: Callable[[int, int], None] | None = None,
) -> int:
    """Write an MP4 (H.264 if PyAV has it) of ``qpos`` (T, 7 + J) at ``time_s`` (T,), increasing.

    ``qpos`` are ``MujocoPlant.qpos``; of a free look, (T, 7 L). ``marks`` None draws neither
    waypoints nor paths, trails, scale and caption. ``on_frame`` is called with (frames done, of)
    after each.

    Returns:
        Number of frames.

    Raises:
        InputError: fewer than two poses, odd size, or PyAV missing.
        OffscreenError: no off-screen OpenGL.

    """
    times = np.asarray(time_s, float)
    poses = np.asarray(qpos, float)
    _check(times, poses, style.size)
    stage = _Stage(scene, style, marks)
    shots = poses_at(
        times, poses, np.arange(times[0], times[-1], style.speed_up / style.fps), stage.bodies
    )
    shot_s = times[0] + np.arange(len(shots)) * style.speed_up / style.fps
    camera, centre = stage.camera(shots, style)
    centre_m = np.column_stack([np.interp(times, shot_s, column) for column in centre.T])
    trail = (
        None
        if marks is None
        else make_trail(marks.paths, times, poses, centre_m, scene.ground, mark_size(scene.robot))
    )
    shown = stage.scene(0 if trail is None else trail.most)
    with (
        Offscreen(stage.model, *style.size) as screen,
        MovieFile(path, style.fps, style.size) as film,
    ):
        for k, shot in enumerate(shots):
            now = float(shot_s[k])
            stage.pose(shown, shot, camera[k], now)
            screen.reload(stage.model, stage.shade.texture)
            caption = ""
            if trail is not None:
                trail.add(shown, now)
                add_axes(shown, _corner(camera[k]), _scale_m(scene.robot.length_m), scene.ground)
                caption = f"{style.title}  {now:6.1f} s   {style.speed_up:g}x".strip() + _LEGEND
            film.add(screen.draw(shown, caption))
            if on_frame is not None:
                on_frame(k + 1, len(shots))
    return len(shots)


def _check(times: Floats, poses: Floats, size: tuple[int, int]) -> None:
    faults = []
    if poses.ndim != 2 or len(poses) < 2 or times.shape != poses.shape[:1]:
        faults.append(f"film: needs two poses or more, each with its time; has {len(times)}")
    if size[0] % 2 or size[1] % 2:
        faults.append(f"film: width and height must be even, not {size[0]} x {size[1]}")
    if faults:
        raise InputError(faults)


class _Stage:
    """The drawn model, and the scene of one pose after another."""

    def __init__(
        self,
        scene: Scene,
        style: Style,
        marks: Marks | None,
    ) -> None:
        look = style.look
        robot = scene.robot
        self._robot = robot
        self._reached_s = () if marks is None else marks.reached_s
        self.bodies = len(look.rest_m) if look is not None and look.free else 1
        bones = self.bodies if self.bodies > 1 else robot.link_count + len(robot.limb_joints)
        spine = self.bodies if self.bodies > 1 else robot.link_count
        spine = spine if look is None else look.spine or spine
        legs_m = max((sum(pair.segments_m) for pair in robot.limbs), default=0.0)
        self.length_m = robot.length_m + legs_m
        """Length to show: the spine, and a leg to its side."""
        self.model = dressed_model(
            scene,
            marks,
            look=look,
            fine=style.fine,
            additions=(add_sheet,),
        )
        parts = np.array([self.model.body(f"link{k}").id for k in range(bones)])
        self._parts = parts
        self._spine = parts[:spine]
        self._ground = scene.ground
        self.shade = SoftShade(self.model, scene.ground)
        self._faces = None if look is None else look.faces
        self.data = mujoco.MjData(self.model)
        self._view, self._option = mujoco.MjvCamera(), mujoco.MjvOption()
        self._reached = 0

    def camera(self, shots: Floats, style: Style) -> tuple[Floats, Floats]:
        """Camera of each frame (F, 6), and middle of the spine (F, 3)."""
        data = self.data
        parts = np.empty((len(shots), len(self._parts), 3))
        for k, shot in enumerate(shots):
            data.qpos[:] = shot
            mujoco.mj_kinematics(self.model, data)
            parts[k] = data.xipos[self._parts]
        track = BodyTrack(
            parts_m=parts,
            spine=len(self._spine),
            length_m=self.length_m,
            fps=style.fps,
            fovy_deg=float(self.model.vis.global_.fovy),
            aspect=style.size[0] / style.size[1],
        )
        return follow(track, self._ground), parts[:, : len(self._spine)].mean(axis=1)

    def scene(self, trail: int) -> mujoco.MjvScene:
        """Return a scene for the model and ``trail`` more geoms."""
        room = self.model.ngeom + self.model.nbody + 11 + AXES_GEOMS + trail
        scene = mujoco.MjvScene(self.model, maxgeom=room)
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        return scene

    def pose(self, scene: mujoco.MjvScene, shot: Floats, camera: Floats, now_s: float) -> None:
        """Draw a pose into a scene from a camera; waypoints reached by ``now_s`` are green."""
        model = self.model
        data = self.data
        view = self._view
        while self._reached < len(self._reached_s) and self._reached_s[self._reached] <= now_s:
            mark_reached(model, self._reached)
            self._reached += 1
        data.qpos[:] = shot
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        view.lookat[:] = camera[:3]
        view.azimuth = camera[3]
        view.elevation = -camera[4]
        view.distance = camera[5]
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, self._option, None, view, every, scene)
        self.shade.lay(scene, self._surface_m(scene))

    def _surface_m(self, scene: mujoco.MjvScene) -> Floats:
        """Points (P, 3) of the body's surface in its last pose."""
        if self._faces is None:
            spine = self._spine
            data = self.data
            links = np.array(data.xipos[spine]), np.array(data.xmat[spine, ::3])
            return link_surface_m(*links, self._robot)
        corners = np.array(scene.skinvert, float).reshape(-1, 3)[: int(self._faces.max()) + 1]
        return surface_points_m(corners, self._faces)


def poses_at(time_s: Floats, qpos: Floats, at_s: Floats, bodies: int) -> Floats:
    """Poses (F, 7 + J) at ``at_s``, linear between the recorded ones; quaternions stay unit.

    The first ``bodies`` groups of seven columns are place and quaternion of a floating body.
    """
    q = qpos.copy()
    turns = [slice(7 * k + 3, 7 * k + 7) for k in range(bodies)]
    for turn in turns:
        flips = np.where((q[1:, turn] * q[:-1, turn]).sum(axis=1) < 0.0, -1.0, 1.0)
        q[1:, turn] *= flips.cumprod()[:, None]
    out = np.column_stack([np.interp(at_s, time_s, column) for column in q.T])
    for turn in turns:
        out[:, turn] /= np.linalg.norm(out[:, turn], axis=1, keepdims=True)
    return out


def _corner(camera: Floats) -> Floats:
    """Place (2,) of the scale on the ground: to the left of the look-at point, and nearer."""
    turn = np.radians(camera[3])
    ahead = np.array([np.cos(turn), np.sin(turn)])
    left = np.array([-ahead[1], ahead[0]])
    nearer = float(np.interp(camera[4], [19.0, 33.0], [0.1, 0.28]))  # a low camera sees less
    at_m: Floats = camera[:2] + camera[5] * (0.38 * left - nearer * ahead)
    return at_m


def _scale_m(length_m: float) -> float:
    """A round length of about a fifth of the body's."""
    power = 10.0 ** np.floor(np.log10(0.2 * length_m))
    return float(
        power * max(length for length in (1.0, 2.0, 5.0) if length * power <= 0.2 * length_m)
    )
