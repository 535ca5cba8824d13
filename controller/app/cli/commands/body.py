"""``snakewalk body``: a solid body from skeletons and widths."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.app.cli.options import Force, Json, show
from snakewalk.controller.app.result_files import atomic_write, check_picture, refuse_to_overwrite

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Image = NDArray[np.uint8]


def body(
    track: Annotated[
        str, typer.Argument(help="an .npz of skeletons with widths, or a shipped recording")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="body.glb or body.obj")],
    image: Annotated[
        Path | None, typer.Option(help="picture of the body from above: the skin's texture")
    ] = None,
    frame: Annotated[
        int, typer.Option(help="frame of the track that the picture shows, from 0")
    ] = 0,
    side: Annotated[
        Path | None, typer.Option(help="an .npz of the same body seen from the side: its heights")
    ] = None,
    aspect: Annotated[float, typer.Option(help="height over width, without a side view")] = 0.85,
    posed: Annotated[
        bool, typer.Option("--posed", help="bent as in --frame, not straight")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="draw widths, skin and solid here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make the body's mesh: an ellipse at each skeleton point, with mirrored texture."""
    require_extra("body: meshes need", "trimesh")
    from snakewalk.controller.capture.mesh import body_model as model  # noqa: PLC0415  heavy
    from snakewalk.controller.capture.mesh.mesh import body_mesh  # noqa: PLC0415
    from snakewalk.controller.capture.mesh.mesh_files import mesh_files, write_mesh  # noqa: PLC0415
    from snakewalk.controller.capture.readers.generated import EMBEDDED, embedded  # noqa: PLC0415

    check_picture(picture)
    if not 0.1 <= aspect <= 10.0:
        raise InputError(f"aspect: height over width must be from 0.1 to 10, not {aspect:g}")
    drawn = [] if picture is None else [picture]
    refuse_to_overwrite([*mesh_files(output, image is not None), *drawn], force)
    texture, shown = None, None
    if track in EMBEDDED:
        if image is not None or side is not None:
            raise InputError(f"{track}: is made from figures, without widths; give an .npz")
        recording = embedded(track)
        one, points = model.spindle(recording.length_m), recording.points
    else:
        top = model.read_silhouettes(Path(track))
        seen = None if side is None else model.read_silhouettes(side)
        one, points = model.body_model(top, seen, aspect), top.points
        if image is not None:
            _check_frame(str(image), top.points, frame)
            shown = _read_picture(image), top.points[frame], top.radius[frame]
            texture = _texture(image, shown, top.pixels)
        if top.pixels:
            points = points * [1.0, -1.0]
    skeleton = _skeleton(track, points, frame) if posed else model.straight()
    mesh = body_mesh(one, skeleton)
    with atomic_write(output) as part:
        write_mesh(part, mesh, texture)
    files = mesh_files(output, texture is not None)
    if picture is not None:
        from snakewalk.controller.app.report.plots.body import draw_body  # noqa: PLC0415

        draw_body(picture, one, mesh, texture, shown)
    show(
        {
            "files": [str(file) for file in [*files, *drawn]],
            "vertices": len(mesh.vertices),
            "triangles": len(mesh.faces),
            "length_m": one.length_m,
            "widths": "measured" if one.measured else "a plain spindle: the track holds none",
            "thickest_over_length": round(2.0 * float(one.half_width.max()), 4),
            "height_over_width": round(float(one.half_height.max() / one.half_width.max()), 3),
            "texture": None if image is None else str(image),
            "body_profile": list(one.profile),
        },
        as_json,
    )


def _skeleton(track: str, points: Floats, frame: int) -> Floats:
    """Skeleton of one frame, in body lengths."""
    from snakewalk.controller.capture.mesh.body_model import pose  # noqa: PLC0415

    _check_frame(track, points, frame)
    return pose(points[frame])


def _texture(image: Path, shown: tuple[Image, Floats, Floats], pixels: bool) -> Image:
    """Strip of the skin from a picture, the skeleton in it and its radii."""
    from snakewalk.controller.capture.mesh.skin_texture import unroll  # noqa: PLC0415

    picture, points, radius = shown
    if not pixels:
        raise InputError(f"{image}: the track holds no places in pictures (points_px, skeletons)")
    rows, columns = picture.shape[:2]
    x, y = points.T
    if x.min() < -1.0 or y.min() < -1.0 or x.max() > columns or y.max() > rows:
        raise InputError(
            f"{image}: the skeleton does not lie in this picture of {columns} x {rows} pixels; say "
            "which --frame of the track it shows"
        )
    return unroll(picture, points, radius)


def _read_picture(image: Path) -> Image:
    """Grey or colour, whatever the file holds."""
    import numpy as np  # noqa: PLC0415
    from PIL import Image as Pillow  # noqa: PLC0415
    from PIL import UnidentifiedImageError  # noqa: PLC0415

    try:
        with Pillow.open(image) as picture:
            return np.asarray(picture.convert("RGB"))
    except FileNotFoundError:
        raise InputError(f"{image}: no such file") from None
    except (UnidentifiedImageError, OSError, SyntaxError):
        raise InputError(f"{image}: is no picture that can be read") from None


def _check_frame(name: str, points: Floats, frame: int) -> None:
    import numpy as np  # noqa: PLC0415

    if not 0 <= frame < len(points):
        raise InputError(f"{name}: frame {frame} is not in 0..{len(points) - 1}")
    if not np.isfinite(points[frame]).all():
        raise InputError(f"{name}: frame {frame} holds no whole skeleton")
