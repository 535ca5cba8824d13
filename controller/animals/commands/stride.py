"""``snakewalk animal stride``: from a tracked animal with legs to an animal's file."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.reading import texts
from snakewalk.controller.animals.legged.animal_stride import Names, measure_animal
from snakewalk.controller.animals.legged.views import View
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    Json,
    show,
)
from snakewalk.controller.console.result_files import (
    check_picture,
    refuse_to_overwrite,
    write_result,
)
from snakewalk.controller.track.choice import AnimalChoice, Choice
from snakewalk.controller.track.readers.load import load_keypoints


@command(
    "animal stride",
    examples=(
        "animal stride TRACKED.h5 --spine nose,neck,hip,tail --girdles neck,hip "
        "--feet FL,FR,HL,HR -o mine.toml --picture stride.png",
        "animal synthesise jacksboro-traverse --animal mine.toml --film",
    ),
)
def stride(
    keypoints: Annotated[
        Path,
        typer.Argument(help="file of keypoints: SLEAP, DeepLabCut, QTM or C3D"),
    ],
    spine: Annotated[str, typer.Option(help="A,B,C: keypoints along the spine, head first")],
    girdles: Annotated[
        str, typer.Option(help="F,H: keypoints of the spine at the front and the hind legs")
    ],
    feet: Annotated[
        str, typer.Option(help="keypoints of the feet: front left,front right,hind left,hind right")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", help="write the animal's file here (.toml)")
    ] = Path("animal.toml"),
    animal: Annotated[
        str,
        typer.Option(
            help="animal whose heights, knees and skin to use", autocompletion=completion.ANIMALS
        ),
    ] = "lizard",
    length_m: Annotated[
        float | None, typer.Option(help="length of the spine in metres; default: the file's scale")
    ] = None,
    view: Annotated[
        View, typer.Option(help="view of the camera: above; or side, on level ground")
    ] = "above",
    picture: Annotated[
        Path | None, typer.Option(help="draw the fit of each foot here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: AnimalChoice,
) -> None:
    """Measure one cycle of a tracked animal with legs ([KP] 4.2.2): contacts, phases, bends."""
    names = Names.of(spine, girdles, feet)
    written = [output] if picture is None else [output, picture]
    refuse_to_overwrite(written, force)
    if picture is not None:
        check_picture(picture)
    keypoints_of_film = load_keypoints(keypoints, Choice(**choice.model_dump()))
    measured = measure_animal(keypoints_of_film, names, animal, output.stem, length_m, view)
    write_result(output, measured.text())
    if picture is not None:
        from snakewalk.controller.animals.plots.stride import draw_stride  # noqa: PLC0415  --picture: an extra

        draw_stride(
            measured.stride, picture, f"{keypoints.name}: {measured.stride.cycles:.1f} cycles"
        )
    about = {
        "animal": str(output),
        "picture": None if picture is None else str(picture),
        "facts": texts(keypoints_of_film.facts),
        "notes": keypoints_of_film.notes,
    }
    show(measured.facts() | about, as_json)
