"""The body in a film by name: servos, the captured animal, or any skin of ``snakewalk body``."""

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.world import Water
from snakewalk.controller.runlog.record import Header

if TYPE_CHECKING:
    from snakewalk.controller.app.recordings.body_skin import BodySkin
    from snakewalk.controller.capture.mesh.skin import Skin
    from snakewalk.sim.rendering.looks import SkinLook

SERVOS: Final = "servos"
ANIMAL: Final = "animal"
_PLAIN = "snake"
"""The animal of a run whose recording holds no widths."""


def check_look(look: str) -> None:
    """Refuse a look that cannot be made, before a run.

    Raises:
        InputError: no such skin, or an extra is missing.

    """
    if look == SERVOS:
        return
    require_extra("a skin needs", "trimesh")
    if look != ANIMAL:
        from snakewalk.controller.app.recordings.body_skin import body_skin  # noqa: PLC0415  an extra

        body_skin(look)


def skin_look(look: str, header: Header) -> "SkinLook | None":
    """Make the skin of a run's film; None is a capsule a link.

    Args:
        look: ``servos``; ``animal``, which is the run's own recording where it holds widths, else a
            plain snake; or what ``body_skin`` takes.
        header: of the run.

    Raises:
        InputError: no such skin, or an extra is missing.

    """
    if look == SERVOS:
        return None
    require_extra("a skin needs", "trimesh", "mujoco")
    from snakewalk.controller.app.recordings.body_motion import robot_skin  # noqa: PLC0415  an extra
    from snakewalk.controller.app.recordings.body_skin import body_skin  # noqa: PLC0415
    from snakewalk.controller.capture.mesh.skin import rest_fronts_m  # noqa: PLC0415

    dressed = body_skin(animal(header.run.track) if look == ANIMAL else look)
    robot = header.robot
    skin = robot_skin(dressed.skin, robot, isinstance(header.world.ground, Water))
    bone_m = np.array(robot.link_lengths_m)
    origins = rest_fronts_m(bone_m, skin.axis_m)  # a body begins at its joint, the head's amidst
    origins[0, 0] -= 0.5 * bone_m[0]
    return _look(skin, bone_m, origins, dressed.texture)


def bone_look(dressed: "BodySkin", skin: "Skin", bone_m: Floats) -> "SkinLook":
    """Make a look of floating bones (K,), for a motion that no robot makes.

    Args:
        dressed: whose texture is worn.
        skin: its skin, of the motion's size.
        bone_m: lengths of the bones; a body begins at its bone's front.

    """
    from snakewalk.controller.capture.mesh.skin import rest_fronts_m  # noqa: PLC0415  an extra

    origins = rest_fronts_m(bone_m, skin.axis_m)
    return _look(skin, bone_m, origins, dressed.texture, free=True)


def _look(
    skin: "Skin", bone_m: Floats, origins_m: Floats, texture: Image | None, *, free: bool = False
) -> "SkinLook":
    from snakewalk.controller.capture.mesh.skin import weights  # noqa: PLC0415  an extra
    from snakewalk.sim.rendering.looks import SkinLook  # noqa: PLC0415

    held = weights(skin, bone_m)
    return SkinLook(
        vertices_m=skin.mesh.vertices,
        uv=skin.mesh.uv,
        faces=skin.mesh.faces,
        link=held.bones,
        share=held.shares,
        rest_m=origins_m,
        texture=texture,
        free=free,
    )


def animal(track: str) -> str:
    """Name of the body that a motion was captured from: the recording's, or a plain snake."""
    from snakewalk.controller.capture.mesh.body_model import read_silhouettes  # noqa: PLC0415

    try:
        read_silhouettes(Path(track))
    except InputError:
        return _PLAIN
    return track
