"""``snakewalk animal body``: a solid body from skeletons and widths, and a skin that moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Annotated

import typer

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.commands.photograph_options import (
    Shot,
    SkinPicture,
    check_frame,
    posed_frame,
    shots_of,
    skin_picture,
)
from snakewalk.controller.animals.mesh import body_model as model
from snakewalk.controller.animals.mesh.body_model import BodyModel, pose, straight
from snakewalk.controller.animals.mesh.body_motion import animated
from snakewalk.controller.animals.mesh.body_skin import (
    BodySkin,
    Cut,
    body_skin,
    is_skin,
    model_skin,
)
from snakewalk.controller.animals.mesh.mesh import body_mesh, picture_around
from snakewalk.controller.animals.mesh.rig import spine_rig
from snakewalk.controller.animals.mesh.skin_file import write_skin
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.images.mesh import Mesh
from snakewalk.controller.images.mesh_files import MESH_ENDINGS, mesh_files, write_mesh
from snakewalk.controller.track.readers.generated import EMBEDDED, embedded

Animate = Annotated[
    str | None,
    typer.Option(
        help="source of the motion: a recording, the log of a run, or a spine gait",
        autocompletion=completion.MOVING,
    ),
]
Curves = Annotated[
    int | None, typer.Option(help="number of boundary curves of the skin; default: 37")
]
Order = Annotated[
    int | None,
    typer.Option(
        help="order of the skin: 1 creased, 2 biharmonic (default), 3 with even curvature"
    ),
]
Surface = Annotated[
    bool,
    typer.Option(
        "--surface",
        help="fit a PDE surface through curves of a given mesh, and write it instead of the mesh",
    ),
]
Forward = Annotated[
    str | None,
    typer.Option(
        help="axis of a given mesh that points to its head: +x, -z, ...; default: its longest axis"
    ),
]
Up = Annotated[
    str | None,
    typer.Option(help="axis of a given mesh that points up; default: +y, for an .obj +z"),
]
Picture = Annotated[
    list[str] | None,
    typer.Option(
        help="photograph for the texture, seen from above, or VIEW=FILE with VIEW top, left, right "
        "or below; repeatable"
    ),
]
Frame = Annotated[
    list[int] | None,
    typer.Option(
        help="frame of the track that --image shows or --posed uses, or one for each --image; "
        "default: 0"
    ),
]


@command(
    "animal body",
    examples=("animal body worm-like -o worm.glb", "animal body TRACK.npz --image 0.png -o b.obj"),
)
def body(
    track: Annotated[
        str,
        typer.Argument(
            metavar="BODY",
            help="an .npz of skeletons with widths, a picture of one part, a shipped recording or "
            "skin, an .obj or a .glb",
            autocompletion=completion.BODIES,
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="write the body here: body.glb or body.obj")
    ],
    animate: Animate = None,
    fps: Annotated[
        float | None,
        typer.Option(help="frames per second; default: the recording's rate, or 25 for a log"),
    ] = None,
    curves: Curves = None,
    order: Order = None,
    surface: Surface = False,
    forward: Forward = None,
    up: Up = None,
    image: Picture = None,
    frame: Frame = None,
    side: Annotated[
        Path | None,
        typer.Option(
            help="an .npz or picture of the same body from the side, for heights and side pictures"
        ),
    ] = None,
    aspect: Annotated[
        float, typer.Option(help="ratio of height to width without a side view")
    ] = 0.85,
    posed: Annotated[
        bool,
        typer.Option("--posed", help="bend the body as in --frame instead of straightening it"),
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="draw widths, skin and solid here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make the body's mesh (.obj, .glb), or an animated, textured skin with --animate."""
    check_picture(picture)
    if not 0.1 <= aspect <= 10.0:
        raise InputError(f"aspect: height over width must be from 0.1 to 10, not {aspect:g}")
    body_options = _ResultFiles(output, picture, force, as_json)
    given = is_skin(track)
    _check_options(
        track,
        given,
        animate,
        of_widths={"--image": image, "--side": side, "--posed": posed},
        of_skins={"--fps": fps, "--curves": curves, "--order": order},
        of_meshes={"--surface": surface, "--forward": forward, "--up": up},
    )
    if frame and not image and not posed:
        raise InputError("--frame: needs --image or --posed")
    how = Cut(37 if curves is None else curves, 2 if order is None else order, forward, up, surface)
    if given:
        body_options.refuse(textured=True)
        body_options.skin(body_skin(track, how), animate, fps)
        return
    body_options.refuse(textured=bool(image))
    shots = shots_of(image or [], frame or [])
    measured = _measure(track, shots, side, aspect)
    if animate is not None:
        if posed:
            raise InputError("--posed: --animate moves the body; it cannot keep one pose")
        worn = measured.texture
        skin = model_skin(
            measured.model, worn.picture, Path(track).stem, how, around=worn.is_around
        )
        body_options.skin(replace(skin, facts=skin.facts | worn.facts), animate, fps)
        return
    skeleton = straight()
    if posed:
        pose_frame = posed_frame(shots, frame or [])
        check_frame(track, measured.points, pose_frame)
        skeleton = pose(measured.points[pose_frame])
    body_options.solid(measured, skeleton)


@dataclass(frozen=True)
class _MeasuredBody:
    """A body with widths."""

    model: BodyModel
    points: Floats
    texture: SkinPicture


@dataclass(frozen=True)
class _ResultFiles:
    """Where results go."""

    output: Path
    picture: Path | None
    force: bool
    as_json: bool

    @property
    def drawn(self) -> list[Path]:
        return [] if self.picture is None else [self.picture]

    def refuse(self, *, textured: bool) -> None:
        refuse_to_overwrite([*mesh_files(self.output, textured), *self.drawn], self.force)

    def solid(self, body: _MeasuredBody, skeleton: Floats) -> None:
        """Write the ellipses along a skeleton."""
        body_model = body.model
        worn = body.texture
        mesh = body_mesh(body_model, skeleton)
        corners = len(mesh.vertices)
        if worn.is_around:
            mesh, _ = picture_around(mesh)
        files = self._write(mesh, worn.picture)
        if self.picture is not None:
            _plots().draw_body(self.picture, body_model, mesh, worn.picture, worn.shown)
        show(
            {
                "files": files,
                "vertices": corners,
                "triangles": len(mesh.faces),
                "length_m": body_model.length_m,
                "widths": "measured"
                if body_model.measured
                else "a plain spindle: the track holds none",
                "thickest_over_length": round(2.0 * float(body_model.half_width.max()), 4),
                "height_over_width": round(
                    float(body_model.half_height.max() / body_model.half_width.max()), 3
                ),
                "texture": None,
                "body_profile": list(body_model.profile),
            }
            | worn.facts,
            self.as_json,
        )

    def skin(self, body: BodySkin, animate: str | None, fps: float | None) -> None:
        facts: dict[str, object] = {}
        skin = body.skin
        motion = None
        if animate is None:
            files = self._write(skin.mesh, body.texture)
        else:
            check_ending(self.output, "a skin that moves", ".glb")
            skin, motion = animated(skin, animate, fps)
            with atomic_write(self.output) as part:
                write_skin(
                    part,
                    spine_rig(skin, motion.bone_m),
                    motion,
                    body.texture,
                    body.name,
                    both_sides=body.both_sides,
                )
            files = [str(self.output), *map(str, self.drawn)]
            facts = {
                "animated_by": animate,
                "frames": len(motion.time_s),
                "duration_s": round(float(motion.time_s[-1]), 3),
                "bones": len(motion.bone_m),
                **motion.pose,
            }
        if self.picture is not None:
            _plots().draw_skin(self.picture, skin, motion, body.texture)
        sizes = {
            "files": files,
            "vertices": len(skin.mesh.vertices),
            "triangles": len(skin.mesh.faces),
            "length_m": round(skin.length_m, 6),
        }
        show(sizes | facts | body.facts, self.as_json)

    def _write(self, mesh: Mesh, texture: Image | None) -> list[str]:
        with atomic_write(self.output) as part:
            write_mesh(part, mesh, texture)
        return [str(f) for f in [*mesh_files(self.output, texture is not None), *self.drawn]]


def _plots() -> ModuleType:
    from snakewalk.controller.animals.plots import body as plots  # noqa: PLC0415  --picture: an extra

    return plots


def _check_options(
    body: str,
    given: bool,
    animate: str | None,
    *,
    of_widths: dict[str, object],
    of_skins: dict[str, object],
    of_meshes: dict[str, object],
) -> None:
    mesh = given and body.lower().endswith(MESH_ENDINGS)
    faults = [
        f"{name}: is for recordings with widths, and {body} has none; leave it out"
        for name, value in of_widths.items()
        if given and value
    ]
    faults += [
        f"{name}: is for a mesh, .obj or .glb" for name, v in of_meshes.items() if v and not mesh
    ]
    faults += [
        f"{name}: is for a skin: give --animate"
        for name, v in of_skins.items()
        if v is not None and not (given or animate)
    ]
    if of_skins["--fps"] is not None and not animate:
        faults.append("--fps: is for --animate")
    if faults:
        raise InputError(list(dict.fromkeys(faults)))


def _measure(track: str, shots: Sequence[Shot], side: Path | None, aspect: float) -> _MeasuredBody:
    """Widths of a recording, and its texture from photographs."""
    if track in EMBEDDED:
        if shots or side is not None:
            raise InputError(f"{track}: is made from figures, without widths; give an .npz")
        recording = embedded(track)
        return _MeasuredBody(model.spindle(recording.length_m), recording.points, SkinPicture())
    top = model.read_silhouettes(Path(track))
    silhouettes = None if side is None else model.read_silhouettes(side)
    body = model.body_model(top, silhouettes, aspect)
    points = top.points * [1.0, -1.0] if top.pixels else top.points
    return _MeasuredBody(body, points, skin_picture(shots, top, silhouettes, body))
