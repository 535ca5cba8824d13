"""The body in a film by name: servos, captured animal, or a skin of ``snakewalk animal body``."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.config.world import Water
from snakewalk.controller.animals.mesh.body_model import read_silhouettes
from snakewalk.controller.animals.mesh.body_motion import robot_skin
from snakewalk.controller.animals.mesh.body_skin import body_skin
from snakewalk.controller.animals.mesh.rig import Rig, spine_rig
from snakewalk.controller.console.command import plugin
from snakewalk.controller.run.results import ANIMAL
from snakewalk.controller.runlog.record import Header
from snakewalk.sim.rendering.looks import SkinLook

_DEFAULT_ANIMAL = "snake"
"""Animal of a run whose recording holds no widths."""


@plugin("look", "body")
class BodyLook:
    """The skin of a named body, or of a body's file."""

    def check(self, look: str) -> None:
        """Reject a look that cannot be made, before a run.

        Raises:
            InputError: the skin does not exist, or an extra is missing.

        """
        _check(look)

    def make(self, look: str, header: Header) -> SkinLook:
        """Return the skin of a run's film."""
        return skin_look(look, header)


@plugin("look", "animal")
class AnimalLook(BodyLook):
    """The animal of the run's recording, or a plain snake."""


def _check(look: str) -> None:
    if look != ANIMAL:
        body_skin(look)


def skin_look(look: str, header: Header) -> SkinLook:
    """Make the skin of a run's film.

    Args:
        look: ``animal``, the run's own recording if it contains widths, else a plain snake; or a
            value that ``body_skin`` accepts.
        header: of the run.

    Raises:
        InputError: no such skin, or an extra is missing.

    """
    dressed = body_skin(animal(header.run.track) if look == ANIMAL else look)
    robot = header.robot
    skin = robot_skin(dressed.skin, robot, isinstance(header.world.ground, Water))
    rig = spine_rig(skin, np.array(robot.link_lengths_m))
    origins = rig.rest_m.copy()  # a body begins at its joint, the head's amidst
    origins[0, 0] -= 0.5 * robot.link_lengths_m[0]
    return rig_look(replace(rig, rest_m=origins), dressed.texture, free=False)


def rig_look(rig: Rig, texture: Image | None, *, free: bool = True, spine: int = 0) -> SkinLook:
    """Make the look of a rig.

    Args:
        rig: its size is the motion's.
        texture: None is one colour.
        free: its bones float, for a motion that no robot makes.
        spine: number of its bones that are the spine; 0: all.

    """
    return SkinLook(
        vertices_m=rig.mesh.vertices,
        uv=rig.mesh.uv,
        faces=rig.mesh.faces,
        link=rig.held.bones,
        share=rig.held.shares,
        rest_m=rig.rest_m,
        texture=texture,
        free=free,
        spine=spine,
    )


def animal(track: str) -> str:
    """Name of the body of the recording, or of a plain snake."""
    try:
        read_silhouettes(Path(track))
    except InputError:
        return _DEFAULT_ANIMAL
    return track
