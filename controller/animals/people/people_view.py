"""A person in films and pictures: the PDE surface of each pose, and a mesh next to it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.animals.legged.animal_synthesis import as_long_robot
from snakewalk.controller.animals.mesh.rig import Rig, posed_m
from snakewalk.controller.animals.people.cycle import PersonMotion
from snakewalk.controller.animals.people.surface import Person
from snakewalk.sim.rendering.figure_view import FigureView, OrbitCamera
from snakewalk.sim.rendering.looks import SkinLook
from snakewalk.sim.rendering.movie_file import MovieFile

FPS = 25
FILM_PX = (960, 540)
STAGE_PX = (460, 600)
STAGES = 8
"""Pictures of a cycle."""
_DISTANCE_ASIDE = 0.36
"""Distance of person and mesh from the middle plane, in shares of the stature."""
_CLOTH = (128, 132, 146)
"""Colour of a mesh without a texture."""


class PersonView:
    """Draws a person, and next to it a mesh with the same motion; ``close`` it."""

    def __init__(
        self,
        person: Person,
        worn: Rig | None = None,
        texture: Image | None = None,
        size_px: tuple[int, int] = FILM_PX,
    ) -> None:
        """Prepare the view; ``worn`` is a mesh on the bones, ``texture`` is the mesh's.

        Raises:
            OffscreenError: off-screen rendering is missing.

        """
        self._person = person
        self._worn = worn
        size = person.skeleton.stature_m
        robot = as_long_robot(load_robot("yaw16"), size)
        look = _joined_look(person, worn, texture)
        self._view = FigureView(look, robot, load_world("flat"), size_px)

    def draw(
        self, motion: PersonMotion, frame: int, camera: OrbitCamera, caption: str = ""
    ) -> Image:
        """Draw a moment of a motion, (height, width, 3)."""
        bones = motion.bones
        corners = self._person.solved_m(bones.front_m[frame], bones.rotation[frame])
        worn = None if self._worn is None else posed_m(self._worn, bones, frame)
        return self._view.draw(self._side_by_side(corners, worn), camera, caption)

    def rest(self, camera: OrbitCamera) -> Image:
        """Draw the person at rest."""
        worn = None if self._worn is None else self._worn.mesh.vertices
        return self._view.draw(self._side_by_side(self._person.rig.mesh.vertices, worn), camera)

    def _side_by_side(self, corners_m: Floats, worn_m: Floats | None) -> Floats:
        """Join the person's corners and those of the mesh, which stands to the left."""
        if worn_m is None:
            return corners_m
        aside = np.array([0.0, _DISTANCE_ASIDE * self._person.skeleton.stature_m, 0.0])
        return np.concatenate([corners_m - aside, worn_m + aside])

    def close(self) -> None:
        """Free the frame buffer; safe to call twice."""
        self._view.close()


def stages_of_cycle(
    person: Person, motion: PersonMotion, worn: tuple[Rig | None, Image | None]
) -> tuple[Image, list[tuple[float, Image]]]:
    """Return the person at rest, and stages of one cycle on the spot: share and picture."""
    size = person.skeleton.stature_m
    bones = motion.bones
    near, turns = (1.32, (130.0, 112.0)) if worn[0] is None else (1.9, (165.0, 150.0))
    front = OrbitCamera((0.0, 0.0, 0.5 * size), near * size, turns[0], -6.0)
    side = OrbitCamera((0.0, 0.0, 0.49 * size), (near + 0.06) * size, turns[1], -5.0)
    shown = np.round(np.arange(STAGES) * (len(bones.time_s) - 1) / STAGES).astype(int)
    view = PersonView(person, *worn, STAGE_PX)
    try:
        return view.rest(front), [
            (float(bones.time_s[k] / motion.cycle_s), view.draw(motion, int(k), side))
            for k in shown
        ]
    finally:
        view.close()


def film_person(
    file: Path,
    person: Person,
    motion: PersonMotion,
    worn: tuple[Rig | None, Image | None],
    title: str,
    on_progress: Callable[[int, int], None],
) -> int:
    """Draw the film of a motion of ``FPS`` poses a second, ``file`` ends in .mp4.

    The camera goes along with the person, and turns by 60 degrees from its right to its front.
    ``worn`` is a mesh on its bones, with its texture. ``on_progress`` is called with (frames done,
    of).

    Returns:
        The number of frames.

    """
    size = person.skeleton.stature_m
    frames = len(motion.bones.time_s)
    view = PersonView(person, *worn)
    try:
        with MovieFile(file, FPS, FILM_PX) as film:
            for k, now_s in enumerate(motion.bones.time_s):
                place = (motion.speed_m_s * float(now_s), 0.0, 0.5 * size)
                share = k / (frames - 1)
                turn = 90.0 + 60.0 * share if worn[0] is None else 135.0 + 45.0 * share
                camera = OrbitCamera(place, 1.75 * size, turn, -9.0)
                film.add(view.draw(motion, k, camera, f"{title}   {now_s:4.1f} s"))
                on_progress(k + 1, frames)
    finally:
        view.close()
    return frames


def _joined_look(person: Person, worn: Rig | None, texture: Image | None) -> SkinLook:
    """Join the two meshes and their textures, the person's above."""
    mesh = person.rig.mesh
    picture = person.texture
    vertices = mesh.vertices
    uv = mesh.uv
    faces = mesh.faces
    if worn is not None:
        cloth = np.full((128, 8, 3), _CLOTH, np.uint8) if texture is None else texture
        picture = _stacked_textures(picture, cloth)
        share = person.texture.shape[0] / picture.shape[0]
        outer_uv = uv * [1.0, share] + [0.0, 1.0 - share]
        other = np.clip(worn.mesh.uv, 0.02, 0.98) * [1.0, 1.0 - share]
        vertices = np.concatenate([vertices, worn.mesh.vertices])
        faces = np.concatenate([faces, worn.mesh.faces + len(uv)])
        uv = np.concatenate([outer_uv, other])
    bone_zeros = np.zeros((len(vertices), 1), dtype=np.int64)
    return SkinLook(
        vertices,
        uv,
        faces,
        bone_zeros,
        np.ones((len(vertices), 1)),
        np.zeros((1, 3)),
        picture,
        free=True,
    )


def _stacked_textures(above: Image, below: Image) -> Image:
    """Put one texture above another of the same width."""
    columns = np.arange(above.shape[1]) * below.shape[1] // above.shape[1]
    return np.concatenate([above, below[:, columns]])
