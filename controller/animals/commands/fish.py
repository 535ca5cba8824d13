"""``snakewalk fish``: postures from film, new motion from segments, and films to try it on."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.accuracy import compare
from snakewalk.controller.animals.fish.fish_synthesis import SynthesisOptions, synthesise_motion
from snakewalk.controller.animals.fish.postures import load_postures, save_postures
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
    refuse_to_overwrite,
)

if TYPE_CHECKING:
    from snakewalk.controller.animals.fish.postures import Postures

_Build = Annotated[
    str,
    typer.Option(
        help="carp (A0..A3 behind a rigid head) or eel (8 angles)",
        autocompletion=completion.words("carp", "eel"),
    ),
]
_Rate = Annotated[float | None, typer.Option(help="frames a second, instead of what the file says")]
_Picture = Annotated[Path | None, typer.Option(help="draw here (.png, .svg, .pdf)")]


@command(
    "fish film",
    examples=("fish film tank --side", "fish film eel --motion MIDLINES.csv --build eel"),
)
def film(
    folder: Annotated[Path, typer.Argument(help="folder to write frames and truth.npz into")],
    motion: Annotated[
        str | None,
        typer.Option(
            help="recording to render; default: a scripted fish",
            autocompletion=completion.RECORDINGS,
        ),
    ] = None,
    build: _Build = "carp",
    length_px: Annotated[float, typer.Option(min=20, max=2000, help="body length")] = 120.0,
    frames: Annotated[int | None, typer.Option(min=2, help="at most so many")] = None,
    side: Annotated[bool, typer.Option("--side", help="film from the side as well")] = False,
    fins: Annotated[
        float, typer.Option(min=0.0, max=0.3, help="pectoral fins seen from above, body lengths")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="of patterns and noise")] = 0,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Render a fish whose every angle is known, with marks, shadow, blur and noise."""
    from snakewalk.controller.animals.fish.fish_film import render  # noqa: PLC0415  heavy; --help stays quick

    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; give a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise InputError(f"{folder}: is not empty; --force writes into it")
    with ProgressBar("frames", transient=True) as bar:
        truth = render(
            folder, motion=motion, build=build, length_px=length_px, frames=frames, side=side,
            fins=fins, seed=seed, on_progress=bar.update,
        )  # fmt: skip
    found: dict[str, object] = {
        "folder": str(folder),
        "frames": truth.frames,
        "rate_hz": round(truth.rate_hz, 3),
        "length_px": length_px,
    }
    show(found, as_json)


@command(
    "fish match",
    examples=(
        "fish match top.mp4 --side side.mp4 -o postures.npz",
        "fish match tank/top --background tank/top-background.png --picture match.png",
    ),
)
def match(
    footage: Annotated[
        Path, typer.Argument(help="video or folder of images from above; or tracked midlines")
    ],
    side: Annotated[
        Path | None, typer.Option(help="the same moments from the side: height and pitch")
    ] = None,
    background: Annotated[
        Path | None, typer.Option(help="picture of the empty scene; default: median of frames")
    ] = None,
    side_background: Annotated[Path | None, typer.Option(help="the same of the side view")] = None,
    build: _Build = "carp",
    rate: _Rate = None,
    length: Annotated[
        float | None, typer.Option(help="body length, m; without it the unit is the body length")
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(help="known postures to compare with: truth.npz of fish film")
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="postures")] = Path("postures.npz"),
    picture: _Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Lay a deformable fish over every frame: head, spine angles, and from the side its pitch."""
    refuse_to_overwrite([output, picture], force)
    check_picture(picture)

    from snakewalk.controller.animals.fish.fish_matching import (  # noqa: PLC0415
        MIDLINES,
        match_footage,
        read_midlines,
    )

    _check_npz(output)
    if length is not None and not 0.0 < length < 1e3:
        raise InputError(f"--length: a body length in metres, above 0; not {length:g}")
    known = None if truth is None else load_postures(truth)
    if footage.suffix.lower() in MIDLINES:
        if side is not None:
            raise InputError(f"{footage}: midlines have no side view; --side goes with images")
        matched = read_midlines(footage, build, rate)
    else:
        with ProgressBar("frames", transient=True) as bar:
            matched = match_footage(
                footage, side, background, side_background, build=build, rate_hz=rate,
                length_m=length, on_progress=bar.update,
            )  # fmt: skip
    accuracy = None if known is None else compare(matched.postures, known)
    with atomic_write(output) as part:
        save_postures(part, matched.postures)
    if picture is not None:
        from snakewalk.controller.animals.plots.fish import draw_match  # noqa: PLC0415

        draw_match(picture, matched.postures, known, matched.film, footage)
    facts = matched.facts.to_dict()
    if accuracy is not None:
        facts |= accuracy.to_dict()
    show(facts | {"postures": str(output)}, as_json)


@command(
    "fish synthesise",
    examples=(
        "fish synthesise postures.npz --seconds 30 --seed 1 -o track.npz",
        "fish synthesise postures.npz --through 3,0 --through 5,3 --mirror",
    ),
)
def synthesise(
    postures: Annotated[Path, typer.Argument(help="postures.npz of snakewalk fish match")],
    through: Annotated[
        list[str] | None,
        typer.Option(
            help="control point X,Y or X,Y,Z from the start, x along the head; give several"
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=3600.0, help="at least so long, at random")
    ] = 20.0,
    seed: Annotated[int, typer.Option(min=0, help="of the random order")] = 0,
    radius: Annotated[float, typer.Option(min=0.01, help="of a control point, body lengths")] = 0.5,
    limit: Annotated[
        float, typer.Option(min=1.0, max=3600.0, help="seconds for all control points")
    ] = 120.0,
    mirror: Annotated[
        bool, typer.Option("--mirror", help="use every segment mirrored too")
    ] = False,
    within: Annotated[
        float, typer.Option(min=0.1, max=45.0, help="degrees from the basic posture")
    ] = 4.0,
    merge: Annotated[float, typer.Option(min=0.0, help="degrees below which beats merge")] = 20.0,
    reference: Annotated[
        str, typer.Option(help="basic posture: straight, or the commonest of the film")
    ] = "straight",
    blend: Annotated[float, typer.Option(min=0.02, help="seconds of the blend of a join")] = 0.25,
    robot: Annotated[
        str, typer.Option(help="whose joints are written along", autocompletion=completion.ROBOTS)
    ] = "yaw16",
    output: Annotated[Path, typer.Option("--output", "-o", help="track")] = Path("track.npz"),
    picture: _Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Put segments of a film together anew, at random or through control points."""
    refuse_to_overwrite([output, picture], force)
    check_picture(picture)

    options = SynthesisOptions(
        through=_points(through or []), seconds=seconds, seed=seed, radius=radius, limit_s=limit,
        mirror=mirror, within_deg=within, merge_deg=merge, reference=reference, blend_s=blend,
        robot=robot,
    )  # fmt: skip
    _check_npz(output)
    source: Postures = load_postures(postures)
    made = synthesise_motion(source, options)
    with atomic_write(output) as part:
        made.save(part)
    if picture is not None:
        from snakewalk.controller.animals.plots.fish_path import draw_synthesis  # noqa: PLC0415

        draw_synthesis(picture, made, options)
    show(made.facts.to_dict() | {"track": str(output)}, as_json)


def _check_npz(path: Path) -> None:
    if path.suffix.lower() != ".npz":
        raise InputError(f"{path}: what is written is an .npz")


def _points(words: list[str]) -> list[tuple[float, ...]]:
    found: list[tuple[float, ...]] = []
    for word in words:
        try:
            point = tuple(float(part) for part in word.split(","))
        except ValueError:
            point = ()
        if len(point) not in {2, 3} or not all(map(math.isfinite, point)):
            raise InputError(
                f"--through {word}: a control point is X,Y, as in 3,-1.5, or X,Y,Z with its height"
            )
        found.append(point)
    if len({len(point) for point in found}) > 1:
        raise InputError("--through: give the height of all control points, or of none")
    return found
