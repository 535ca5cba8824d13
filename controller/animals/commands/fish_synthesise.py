"""``snakewalk animal fish synthesise``: new motion from segments of a film."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.commands.fish_options import Picture, check_npz
from snakewalk.controller.animals.commands.pictures import pictures
from snakewalk.controller.animals.fish.fish_synthesis import (
    SynthesisFacts,
    SynthesisOptions,
    synthesise_motion,
)
from snakewalk.controller.animals.fish.postures import load_postures
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
)


@command(
    "animal fish synthesise",
    examples=(
        "animal fish synthesise postures.npz --seconds 30 --seed 1 -o track.npz",
        "animal fish synthesise postures.npz --through 3,0 --through 5,3 --mirror",
    ),
    results=("output", "picture"),
)
def synthesise(
    postures: Annotated[Path, typer.Argument(help="postures.npz of snakewalk animal fish match")],
    through: Annotated[
        list[str] | None,
        typer.Option(help="control point X,Y or X,Y,Z; may be repeated"),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option(min=0.1, max=3600.0, help="shortest duration of a random motion in seconds"),
    ] = 20.0,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random order")] = 0,
    radius: Annotated[
        float, typer.Option(min=0.01, help="radius of a control point in body lengths")
    ] = 0.1,
    start: Annotated[
        str, typer.Option(help="place and direction in degrees of the first posture: X,Y,DEGREES")
    ] = "0,0,0",
    tank: Annotated[
        str | None, typer.Option(help="walls to keep away from: XMIN,YMIN,XMAX,YMAX")
    ] = None,
    avoid: Annotated[
        list[Path] | None,
        typer.Option(help="track of another fish to keep away from; may be repeated"),
    ] = None,
    apart: Annotated[
        float,
        typer.Option(min=0.0, help="least distance from walls and other fish in body lengths"),
    ] = 0.5,
    limit: Annotated[
        float,
        typer.Option(
            min=1.0, max=3600.0, help="time limit in seconds for reaching all control points"
        ),
    ] = 120.0,
    mirror: Annotated[
        bool, typer.Option("--mirror", help="also use the mirror image of every segment")
    ] = False,
    within: Annotated[
        float,
        typer.Option(
            min=0.1, max=45.0, help="largest difference from the basic posture in degrees"
        ),
    ] = 4.0,
    merge: Annotated[
        float, typer.Option(min=0.0, help="merge tail beats that differ by fewer degrees than this")
    ] = 20.0,
    reference: Annotated[
        str, typer.Option(help="basic posture: straight, or the commonest of the film")
    ] = "straight",
    blend: Annotated[
        float, typer.Option(min=0.02, help="duration of the blend at a join in seconds")
    ] = 0.25,
    robot: Annotated[
        str,
        typer.Option(
            help="add the joint angles of this robot to the track", autocompletion=completion.ROBOTS
        ),
    ] = "yaw16",
    output: Annotated[
        Path, typer.Option("--output", "-o", help="write the track here (.npz)")
    ] = Path("track.npz"),
    picture: Picture = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Join segments of a film in a new order, at random or through control points."""
    check_picture(picture)
    options = SynthesisOptions(
        through=_points(through or []), seconds=seconds, seed=seed, radius=radius, limit_s=limit,
        mirror=mirror, within_deg=within, merge_deg=merge, reference=reference, blend_s=blend,
        robot=robot, tank=_tank(tank), start=_start(start), avoid=tuple(avoid or ()), apart=apart,
    )  # fmt: skip
    check_npz(output)
    made = synthesise_motion(load_postures(postures), options)
    with atomic_write(output) as part:
        made.save(part)
    if picture is not None:
        pictures()[1].draw_synthesis(picture, made, options)
    _warn(made.facts)
    show(made.facts.to_dict() | {"track": str(output)}, as_json)


def _warn(facts: SynthesisFacts) -> None:
    """Warn of a fish that leaves its tank, or comes nearer to walls and fish than requested."""
    advice = "film more turns, add --mirror, or give a larger --tank"
    if facts.wall_distance is not None and facts.wall_distance < 0.0:
        LOGGER.warning(
            "--tank: the fish leaves the tank by %.3g; its segments turn too little; %s",
            -facts.wall_distance, advice,
        )  # fmt: skip
    elif facts.pieces_too_close:
        LOGGER.warning(
            "%s of %s segments come nearer than --apart to walls or fish; %s",
            facts.pieces_too_close, facts.pieces_used, advice,
        )  # fmt: skip


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
    for number, (one, other) in enumerate(pairwise(found), 1):
        if one == other:
            raise InputError(
                f"--through: control points {number} and {number + 1} are the same; remove one"
            )
    return found


def _tank(word: str | None) -> tuple[float, float, float, float] | None:
    """Return the walls of ``--tank``."""
    if word is None:
        return None
    x0, y0, x1, y1 = _numbers("--tank", word, 4, "XMIN,YMIN,XMAX,YMAX, as in -2,-2,6,4")
    if max(x1 - x0, y1 - y0) < 1.0:
        raise InputError(
            f"--tank {word}: no wall is as long as the fish, whose length is 1; give "
            "XMIN,YMIN,XMAX,YMAX in body lengths"
        )
    return x0, y0, x1, y1


def _start(word: str) -> tuple[float, float, float]:
    """Return place and direction of ``--start``."""
    x, y, head_deg = _numbers("--start", word, 3, "X,Y,DEGREES, as in 1,0.5,90")
    return x, y, head_deg


def _numbers(option: str, word: str, count: int, form: str) -> list[float]:
    try:
        found = [float(part) for part in word.split(",")]
    except ValueError:
        found = []
    if len(found) != count or not all(map(math.isfinite, found)):
        raise InputError(f"{option} {word}: give {form}")
    return found
