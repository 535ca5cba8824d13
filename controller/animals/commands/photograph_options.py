"""Photographs of ``snakewalk animal body``: their options, files and the texture of the skin."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.mesh.body_model import BodyModel, Silhouettes
from snakewalk.controller.animals.mesh.photographs import VIEWS, Photograph, blend
from snakewalk.controller.animals.mesh.skin_texture import unroll
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.images.colour_picture import read_colours

_VIEWS_FROM_ABOVE = ("top", "below")
"""Views whose skeletons are those of the body seen from above."""


@dataclass(frozen=True, slots=True)
class Shot:
    """A photograph that an option names."""

    view: str
    """Name of the view of a photograph, one of ``VIEWS``."""
    file: Path
    frame: int
    """Row of the skeleton that lies in the photograph."""


@dataclass(frozen=True, slots=True)
class SkinPicture:
    """The texture of a skin."""

    picture: Image | None = None
    is_around: bool = False
    """Whether the photograph shows the complete skin, instead of its upper half."""
    shown: tuple[tuple[Image, Floats, Floats], ...] = ()
    """Image, skeleton (P, 2) and radii (P,) of each photograph."""
    facts: dict[str, object] = field(default_factory=dict)


def shots_of(images: Sequence[str], frames: Sequence[int]) -> tuple[Shot, ...]:
    """Read ``--image`` and ``--frame``.

    Raises:
        InputError: an unknown view, or another number of frames.

    """
    if len(frames) > 1 and len(frames) != len(images):
        raise InputError(
            f"--frame: give one, or one for each --image; there are {len(frames)} frames and "
            f"{len(images)} images"
        )
    return tuple(
        Shot(*_view(image), frame)
        for image, frame in zip(images, cycle(frames or [0]), strict=False)
    )


def posed_frame(shots: Sequence[Shot], frames: Sequence[int]) -> int:
    """Frame of ``--posed``: that of the first photograph from above, or from below."""
    of_top = [shot.frame for shot in shots if shot.view in _VIEWS_FROM_ABOVE]
    return of_top[0] if of_top else 0 if shots or not frames else frames[0]


def _view(text: str) -> tuple[str, Path]:
    view, equals, file = text.partition("=")
    if equals and view in VIEWS:
        return view, Path(file)
    if equals and view.isalpha() and not Path(text).exists():
        raise InputError(f"--image {text}: the view is one of {', '.join(VIEWS)}, not {view}")
    return "top", Path(text)


def skin_picture(
    shots: Sequence[Shot], top: Silhouettes, side: Silhouettes | None, body: BodyModel
) -> SkinPicture:
    """Make the texture: one photograph from above is mirrored; others go around the whole body.

    Raises:
        InputError: a file is not a picture, or does not hold its skeleton.

    """
    if not shots:
        return SkinPicture()
    shown = tuple(_photographed_body(shot, top, side) for shot in shots)
    files = [str(shot.file) for shot in shots]
    if [shot.view for shot in shots] == ["top"]:
        facts: dict[str, object] = {"texture": files[0], "texture_seen": 0.5}
        return SkinPicture(unroll(*shown[0]), False, shown, facts)
    blended = blend(
        [
            Photograph(*silhouette_view, VIEWS[shot.view])
            for shot, silhouette_view in zip(shots, shown, strict=True)
        ],
        body,
    )
    for file, gain in zip(files, blended.gains, strict=True):
        if gain is None:
            LOGGER.warning(
                "%s: shows no part of the body that %s or a matched photograph shows; its "
                "brightness stays as it is",
                file,
                files[0],
            )
    facts = {
        "texture": files,
        "texture_seen": round(blended.seen, 3),
        "texture_gains": [
            None if gain is None else [round(x, 3) for x in gain] for gain in blended.gains
        ],
    }
    return SkinPicture(blended.picture, True, shown, facts)


def _photographed_body(
    shot: Shot, top: Silhouettes, side: Silhouettes | None
) -> tuple[Image, Floats, Floats]:
    """Image, skeleton and radii in it."""
    track = top if shot.view in _VIEWS_FROM_ABOVE else side
    if track is None:
        raise InputError(
            f"{shot.file}: a photograph from the {shot.view} needs the skeletons in it; "
            "give their .npz as --side"
        )
    check_frame(str(shot.file), track.points, shot.frame)
    image = read_colours(shot.file)[..., ::-1]
    points = track.points[shot.frame]
    if not track.pixels:
        raise InputError(
            f"{shot.file}: the track holds no places in pictures (points_px, skeletons)"
        )
    rows, columns = image.shape[:2]
    x, y = points.T
    if x.min() < -1.0 or y.min() < -1.0 or x.max() > columns or y.max() > rows:
        raise InputError(
            f"{shot.file}: the skeleton does not lie in this picture of {columns} x {rows} pixels; "
            "give the --frame of the track that it shows"
        )
    return image, points, track.radius[shot.frame]


def check_frame(name: str, points: Floats, frame: int) -> None:
    """Reject a frame without a complete skeleton."""
    if not 0 <= frame < len(points):
        raise InputError(f"{name}: frame {frame} is not in 0..{len(points) - 1}")
    if not np.isfinite(points[frame]).all():
        raise InputError(f"{name}: frame {frame} contains no complete skeleton")
