"""``snakewalk animal people``: a person who walks or runs, as looping glTF, film and picture."""

from pathlib import Path
from types import ModuleType
from typing import Annotated

import numpy as np
import typer

from snakewalk.config.arrays import Image
from snakewalk.config.extras import require_extra
from snakewalk.controller.animals.commands.pictures import pictures
from snakewalk.controller.animals.mesh.rig import Rig, posed_m
from snakewalk.controller.animals.mesh.skin_file import write_skin
from snakewalk.controller.animals.people.cycle import (
    FRAMES,
    GAITS,
    PersonGait,
    PersonMotion,
    animate,
    scaled,
)
from snakewalk.controller.animals.people.feet_law import FeetLaw, MotionName
from snakewalk.controller.animals.people.surface import Person
from snakewalk.controller.animals.people.worn_mesh import worn_mesh
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import Force, Json, show
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    check_picture,
    refuse_to_overwrite,
)
from snakewalk.controller.images.mesh_files import read_mesh


@command(
    "animal people",
    examples=(
        "animal people walk --picture walk.png",
        "animal people run -o run.glb --film run.mp4",
        "animal people walk --feet printed --film printed.mp4",
    ),
)
def people(
    motion: Annotated[MotionName, typer.Argument(help="walk or run")] = "walk",
    output: Annotated[
        Path, typer.Option("-o", "--output", help="write one looping cycle here (.glb)")
    ] = Path("person.glb"),
    feet: Annotated[
        FeetLaw,
        typer.Option(
            help="equations of the feet: planted, phases (Eq. 9 and 10, half a cycle apart), or "
            "printed (as in the paper)"
        ),
    ] = FeetLaw.PLANTED,
    stature: Annotated[
        float, typer.Option(min=0.1, max=10.0, help="height of the person in metres")
    ] = 1.75,
    girth: Annotated[
        float, typer.Option(min=0.7, max=1.3, help="factor on the widths of the body")
    ] = 1.0,
    step_height: Annotated[
        float,
        typer.Option(min=0.0, max=3.0, help="factor on the height of a step (H of [GC] Eq. 10)"),
    ] = 1.0,
    step_length: Annotated[
        float,
        typer.Option(min=0.1, max=1.3, help="factor on the length of a step (L of [GC] Eq. 10)"),
    ] = 1.0,
    cycle: Annotated[
        float | None, typer.Option(min=0.2, max=10.0, help="duration of a cycle in seconds")
    ] = None,
    cycles: Annotated[int, typer.Option(min=1, max=100, help="number of cycles in the film")] = 4,
    mesh: Annotated[
        Path | None,
        typer.Option(help="mesh of a person that gets the same motion (.obj, .glb)"),
    ] = None,
    forward: Annotated[
        str, typer.Option(help="axis of the mesh's file to which the person faces")
    ] = "+x",
    up: Annotated[str, typer.Option(help="axis of the mesh's file that points up")] = "+z",
    film: Annotated[Path | None, typer.Option(help="draw a film here (.mp4)")] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="draw curves, joints, surface and stages here (.png, .svg, .pdf)"),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Animate a person who walks or runs: PDE skin, feet by [GC] Eq. 9 and 10."""
    _check(output, film, picture, force)
    gait = scaled(GAITS[motion], step_height, step_length, cycle)
    person = Person.of(stature, girth)
    worn, texture = _worn(person, mesh, forward, up)
    person_motion = animate(person.skeleton, gait, feet, in_place=True)
    rig = person.rig if worn is None else worn
    with atomic_write(output) as part:
        write_skin(
            part,
            rig,
            person_motion.bones,
            person.texture if worn is None else texture,
            gait.name,
            both_sides=True,
        )
    if picture is not None:
        rest, stages = _view().stages_of_cycle(person, person_motion, (worn, texture))
        pictures()[2].draw_person(picture, person, rest, stages, f"{gait.name}, feet: {feet}")
    if film is not None:
        _film(film, person, gait, feet, cycles, (worn, texture))
    files = {"mesh": mesh, "animation": output, "film": film, "picture": picture}
    facts: dict[str, object] = {"motion": gait.name, "feet": str(feet)}
    named = {key: None if file is None else str(file) for key, file in files.items()}
    show(facts | _facts(person, gait, person_motion, rig) | named, as_json)


def _facts(person: Person, gait: PersonGait, motion: PersonMotion, rig: Rig) -> dict[str, object]:
    return {
        "cycle_s": round(gait.cycle_s, 3),
        "speed_m_s": round(motion.speed_m_s, 3),
        "feet_slide_m": round(_slide_m(motion), 4),
        "lowest_sole_m": round(_lowest_m(person, motion), 4),
        "bones": len(person.skeleton.parent),
        "boundary_curves": sum(len(part.curves_m) for part in person.parts),
        "vertices": len(rig.mesh.vertices),
        "triangles": len(rig.mesh.faces),
        "frames": FRAMES,
        "skin_minus_surface_m": round(_difference_m(person, motion), 4),
    }


def _check(output: Path, film: Path | None, picture: Path | None, force: bool) -> None:
    """Check the results' names before any work."""
    check_ending(output, "a person who moves", ".glb")
    check_ending(film, "a film", ".mp4")
    refuse_to_overwrite([output, film, picture], force)
    check_picture(picture)
    if film is not None or picture is not None:
        require_extra("films and pictures of people need", "mujoco", "av")


def _worn(
    person: Person, mesh: Path | None, forward: str, up: str
) -> tuple[Rig | None, Image | None]:
    """Return the mesh on the person's bones, and its texture."""
    if mesh is None:
        return None, None
    given = read_mesh(mesh, forward, up)
    return worn_mesh(person, given.mesh), given.texture


def _view() -> ModuleType:
    from snakewalk.controller.animals.people import people_view  # noqa: PLC0415  an extra

    return people_view


def _film(
    file: Path,
    person: Person,
    gait: PersonGait,
    feet: FeetLaw,
    cycles: int,
    worn: tuple[Rig | None, Image | None],
) -> None:
    view = _view()
    frames = max(round(view.FPS * gait.cycle_s), 4)
    motion = animate(person.skeleton, gait, feet, cycles=cycles, frames=frames)
    title = f"{gait.name}, feet {feet}"
    with atomic_write(file) as part, ProgressBar("film", transient=True) as bar:
        view.film_person(part, person, motion, worn, title, bar.update)


def _slide_m(motion: PersonMotion) -> float:
    """Largest distance that a foot slides on the ground in one step."""
    feet = motion.feet
    travel = motion.speed_m_s * motion.bones.time_s
    place = feet.ahead_m + travel[:, None]
    slides = [0.0]
    for k in range(2):
        on = np.flatnonzero(feet.on_ground[:, k])
        for run in np.split(on, np.flatnonzero(np.diff(on) > 1) + 1):
            if len(run) > 1:
                slides.append(float(np.ptp(place[run, k])))
    return max(slides)


def _lowest_m(person: Person, motion: PersonMotion) -> float:
    """Lowest corner of the skin over the cycle."""
    return min(
        float(posed_m(person.rig, motion.bones, k)[:, 2].min())
        for k in range(len(motion.bones.time_s))
    )


def _difference_m(person: Person, motion: PersonMotion) -> float:
    """Largest distance of the played skin from the solved surface, at a quarter of the cycle."""
    k = FRAMES // 4
    bones = motion.bones
    solved = person.solved_m(bones.front_m[k], bones.rotation[k])
    return float(np.linalg.norm(posed_m(person.rig, bones, k) - solved, axis=1).max())
