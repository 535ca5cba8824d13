"""The skin of a synthesised motion: as an animated glTF, and in a film on the world's ground."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.animals.mesh.body_look import animal, rig_look
from snakewalk.controller.animals.mesh.body_motion import robot_skin
from snakewalk.controller.animals.mesh.body_skin import BodySkin, body_skin
from snakewalk.controller.animals.mesh.mesh import tube_faces, vertex_normals
from snakewalk.controller.animals.mesh.rig import Rig, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin, Weights
from snakewalk.controller.animals.mesh.skin_file import write_skin
from snakewalk.controller.animals.synthesis.snake_synthesis import SynthesisedWalk
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.report.film import SIZE, renderer, speed_up
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.results import ANIMAL
from snakewalk.controller.track.bone_motion import BoneMotion
from snakewalk.sim.rendering.looks import SkinLook

LENGTH = 0.05
RADIUS = 0.0018
"""Length and radius of the whole tongue, over the body's length (ours)."""
_RGB = 191, 26, 38
FPS = 30
"""Least frames per second of a film."""
_ROWS = 8
"""Rows that the texture gets for the tongue's colour."""
_RING_CORNERS = 8
_HIDDEN_TONGUE = 2.0
"""Distance of the drawn-in tongue's tip behind the head's, over its radius."""
_FORK = 0.35
"""Share of the length that is forked."""


def rig_with_tongue(rig: Rig, length_m: float, texture: Image | None) -> tuple[Rig, Image | None]:
    """Hang a tongue on the first bone of a spine; it is the last bone, drawn in at rest.

    ``length_m`` is the body's; its texture gets rows of the tongue's colour.
    """
    mesh = rig.mesh
    bone = len(rig.rest_m)
    corners, faces = _forked_tongue(LENGTH * length_m, RADIUS * length_m)
    corners = corners + rig.rest_m[0] - [_HIDDEN_TONGUE * RADIUS * length_m, 0.0, 0.0]
    uv = mesh.uv
    colour = np.array([0.5, 0.5])
    if texture is not None:
        high = len(texture) + _ROWS
        red = np.broadcast_to(np.array(_RGB, np.uint8), (_ROWS, texture.shape[1], 3))
        texture = np.concatenate([texture, red])
        uv = (uv * [1.0, len(texture) - _ROWS] + [0.0, _ROWS]) / [1.0, high]
        colour = np.array([0.5, 0.5 * _ROWS / high])
    joined = Mesh(
        vertices=np.vstack([mesh.vertices, corners]),
        normals=np.vstack([mesh.normals, vertex_normals(corners, faces)]),
        uv=np.vstack([uv, np.tile(colour, (len(corners), 1))]),
        faces=np.vstack([mesh.faces, faces + len(mesh.vertices)]),
    )
    weights = Weights(
        np.vstack([rig.held.bones, np.full((len(corners), 3), bone, dtype=np.int64)]),
        np.vstack([rig.held.shares, np.tile([0.0, 1.0, 0.0], (len(corners), 1))]),
    )
    parent = np.append(rig.parent, 0)
    rest_m = np.vstack([rig.rest_m, rig.rest_m[0]])
    return Rig(joined, weights, rest_m, parent, (*rig.names, "tongue")), texture


def bones_with_tongue(bones: BoneMotion, heights: Floats) -> BoneMotion:
    """Add the tongue's bone: heights (T,), 0 drawn in and 1 out."""
    long_m = LENGTH * bones.length_m
    ahead = bones.rotation[:, 0, :, 0]
    front = bones.front_m[:, 0] + (long_m * heights)[:, None] * ahead
    return replace(
        bones,
        front_m=np.concatenate([bones.front_m, front[:, None]], axis=1),
        rotation=np.concatenate([bones.rotation, bones.rotation[:, :1]], axis=1),
        bone_m=np.append(bones.bone_m, 0.0),
    )


def _forked_tongue(long_m: float, thick_m: float) -> tuple[Floats, np.ndarray]:
    """Corners (V, 3) and faces of a stem along -x and two tips that end at x = 0."""
    turn = np.arange(_RING_CORNERS) * TURN / _RING_CORNERS
    vertices = []
    faces = []
    count = 0
    split = -_FORK * long_m
    for ends, aside, radii in (
        ((split, -long_m), (0.0, 0.0), (1.0, 1.0)),
        ((0.0, split), (3.5, 0.0), (0.35, 0.8)),
        ((0.0, split), (-3.5, 0.0), (0.35, 0.8)),
    ):
        rings = [
            np.stack(
                [
                    np.full(_RING_CORNERS, x),
                    thick_m * (off + radius * np.cos(turn)),
                    thick_m * radius * np.sin(turn),
                ],
                axis=-1,
            )
            for x, off, radius in zip(ends, aside, radii, strict=True)
        ]
        vertices += [*rings, *(ring.mean(axis=0, keepdims=True) for ring in rings)]
        faces.append(tube_faces(2, _RING_CORNERS) + count)
        count += 2 * _RING_CORNERS + 2
    return np.concatenate(vertices), np.concatenate(faces)


FILM_SEGMENTS = 5
"""Segments of the skeleton in one bone of the film; the file has a bone a segment."""


@dataclass(frozen=True, slots=True)
class SynthesisSkin:
    """A skin of the robot's size, and its texture."""

    dressed: BodySkin
    skin: Skin
    tongue: bool
    """Whether it shows its tongue: a snake, or a recorded body."""

    @classmethod
    def of(cls, look: str, track: str, robot: RobotConfig) -> "SynthesisSkin":
        """Make ``animal``, which is the recording's own body or a plain snake, or a BODY.

        Raises:
            InputError: no such body, or an extra is missing.

        """
        dressed = body_skin(animal(track) if look == ANIMAL else look)
        return cls(dressed, robot_skin(dressed.skin, robot), look in (ANIMAL, "snake"))

    def write(self, walk: SynthesisedWalk, file: Path) -> None:
        """Write the animated glTF, ``file`` ends in .glb."""
        worn = self.dressed
        rig, bones, texture = self._rig(walk, 1)
        with atomic_write(file) as part:
            write_skin(part, rig, bones, texture, worn.name, both_sides=worn.both_sides)

    def _rig(self, walk: SynthesisedWalk, segments: int) -> tuple[Rig, BoneMotion, Image | None]:
        bones = walk.bones(segments)
        texture = self.dressed.texture
        rig = spine_rig(self.skin, bones.bone_m)
        if not self.tongue:
            return rig, bones, texture
        rig, texture = rig_with_tongue(rig, bones.length_m, texture)
        return rig, bones_with_tongue(bones, walk.tongue), texture

    def film(self, walk: SynthesisedWalk, prepared: WalkRun, file: Path, marks: bool) -> None:
        """Draw the film, ``file`` ends in .mp4; shows progress on standard error.

        Raises:
            InputError: the simulator or PyAV is not installed, or nothing draws here.

        """
        rig, bones, texture = self._rig(walk, FILM_SEGMENTS)
        film_over(
            prepared,
            file,
            bones,
            rig_look(rig, texture, spine=len(bones.bone_m) - self.tongue),
            robot=prepared.robot,
            reached_s=walk.reached_s(),
            paths=walk.targets.paths(walk.rate_hz) if marks else None,
            fps=FPS,
        )


def film_over(
    prepared: WalkRun,
    file: Path,
    bones: BoneMotion,
    look: "SkinLook",
    *,
    robot: RobotConfig,
    reached_s: Sequence[float],
    paths: Sequence[tuple[float, Floats]] | None,
    fps: int,
) -> None:
    """Draw a skin that moves over a run's world; shows progress on standard error.

    Args:
        prepared: the run.
        file: ends in .mp4.
        bones: the motion.
        look: the skin.
        robot: the body in the camera's frame, of the skin's length.
        reached_s: time at each waypoint.
        paths: paths (P, 2) from a time on; None draws a film without marks.
        fps: frames per second.

    Raises:
        InputError: the simulator or PyAV is not installed, or nothing draws here.

    """
    run = prepared.run
    film = renderer()
    turns = Rotation.from_matrix(bones.rotation.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    poses = np.hstack([bones.front_m.reshape(-1, 3), turns]).reshape(len(bones.front_m), -1)
    with atomic_write(file) as part, ProgressBar("film", transient=True) as bar:
        film.render_film(
            film.Scene(robot, prepared.world, prepared.ground),
            bones.time_s,
            poses,
            part,
            style=film.Style(fps, speed_up(float(bones.time_s[-1])), SIZE, run.name, look),
            marks=None
            if paths is None
            else film.Marks(run.waypoints_m, run.waypoint_radius_m, reached_s, paths),
            on_frame=bar.update,
        )
