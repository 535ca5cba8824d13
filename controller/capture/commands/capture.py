"""``snakewalk animal capture``: from a film of an animal to a track that the robot can walk."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.capture.capturing import capture_recording, correct_recording
from snakewalk.controller.capture.options import CaptureOptions
from snakewalk.controller.capture.several.recording import AnimalsFacts, capture_several
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    FilmRate,
    Force,
    Json,
    console,
    print_table,
    show,
)

Footage = Annotated[
    Path,
    typer.Argument(
        help="a video, a TIFF stack or a folder of images; with --corrections, an earlier track",
        metavar="VIDEO|FOLDER|TRACK.npz",
    ),
]
Marker = Annotated[
    str | None,
    typer.Option(
        help="scale from a printed ArUco or AprilTag marker with SIDE in metres; or "
        "X0,Y0,X1,Y1,METRES: two points in the image and their distance"
    ),
]
Cropped = Annotated[
    bool,
    typer.Option("--cropped", help="the images were cropped to the animal, or the camera moves"),
]
Threshold = Annotated[
    float | None,
    typer.Option(
        help="grey levels between body and background at the boundary; default: half of the "
        "body's contrast"
    ),
]
Review = Annotated[
    Path | None,
    typer.Option(
        help="write a page (.html) for flipping heads, leaving out frames and dragging "
        "points; open it in a browser",
        metavar="PAGE",
    ),
]
Corrections = Annotated[
    Path | None,
    typer.Option(
        help="apply the corrections that the review page saved, and write the track to --output",
        metavar="JSON",
    ),
]
Animals = Annotated[
    str | None,
    typer.Option(
        help="capture several animals, with one track each: their number, or auto for those that "
        "are in view for half of the film",
        metavar="N|auto",
    ),
]
Wide = Annotated[
    bool, typer.Option("--wide", help="in a .csv, one row for each frame instead of each point")
]
Resume = Annotated[
    bool,
    typer.Option("--resume", help="continue an interrupted capture of a long film from OUT.part"),
]
Background = Annotated[
    Path | None, typer.Option(help="image without the animal; default: estimated from frames")
]

Output = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        help="write the track here (.npz, .csv or .wcon); with --animals to track-1.npz and so "
        "on, or to one .csv or .wcon",
    ),
]
LengthM = Annotated[
    float | None, typer.Option(help="length of the animal in metres, which sets the scale")
]
Head = Annotated[
    str | None, typer.Option(help="X,Y in pixels near the head in the first usable frame")
]
Roi = Annotated[
    str | None,
    typer.Option(help="search only this part of the image: X,Y,W,H in pixels", metavar="X,Y,W,H"),
]
Mask = Annotated[
    Path | None, typer.Option(help="search only where this picture is white", metavar="PNG")
]
Overlay = Annotated[
    Path | None, typer.Option(help="write a film with the skeleton on it (.mp4, .avi)")
]
Sheet = Annotated[Path | None, typer.Option(help="write a contact sheet of frames (.png, .jpg)")]
Steps = Annotated[
    Path | None, typer.Option(help="draw the first usable frame step by step (.png, .jpg)")
]

Trail = Annotated[
    Path | None,
    typer.Option(
        help="draw all places of the animal as one picture: each pixel's brightest, or darkest, "
        "value over the film (.png, .jpg)"
    ),
]


@command(
    "animal capture",
    examples=(
        "animal capture film.mp4 -o track.npz --length-m 0.4 --sheet sheet.png",
        "animal capture frames/ --cropped --overlay overlay.mp4 --force --json",
        "animal capture film.mp4 --review review.html",
        "animal capture plate.mp4 --animals auto --overlay overlay.mp4",
        "animal capture dish.mp4 --animals 3 -o fish.csv --wide",
        "animal capture track.npz --corrections track-corrections.json -o corrected.npz",
    ),
)
def capture(
    recording: Footage,
    output: Output = Path("track.npz"),
    background: Background = None,
    length_m: LengthM = None,
    marker: Marker = None,
    rate: FilmRate = None,
    head: Head = None,
    cropped: Cropped = False,
    roi: Roi = None,
    mask: Mask = None,
    threshold: Threshold = None,
    overlay: Overlay = None,
    sheet: Sheet = None,
    steps: Steps = None,
    trail: Trail = None,
    review: Review = None,
    corrections: Corrections = None,
    animals: Animals = None,
    wide: Wide = False,
    resume: Resume = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Find the animal in every frame: silhouette, medial axis, 100 equal chords, head and tail."""
    options = CaptureOptions(
        recording=recording,
        output=output,
        background=background,
        length_m=length_m,
        marker=marker,
        rate_hz=rate,
        head=head,
        cropped=cropped,
        roi=roi,
        mask=mask,
        threshold=threshold,
        overlay=overlay,
        sheet=sheet,
        steps=steps,
        trail=trail,
        review=review,
        corrections=corrections,
        animals=animals,
        wide=wide,
        resume=resume,
        force=force,
    )
    if animals is not None and corrections is None:
        show_several(capture_several(options), as_json=as_json)
        return
    facts = (capture_recording if corrections is None else correct_recording)(options)
    show(asdict(facts), as_json)


def show_several(facts: AnimalsFacts, *, as_json: bool) -> None:
    """Show the animals, as rows or as JSON; exit with code 1 if one of them has no track."""
    if as_json:
        show(asdict(facts), as_json)
    else:
        _print_animals(facts)
    if any(animal.capture is None for animal in facts.animals):
        raise SystemExit(1)


def _print_animals(facts: AnimalsFacts) -> None:
    """One row for each animal."""
    rows: list[tuple[object, ...]] = []
    heads = ("animal", "track", "frames used", "in contact", "length, px", "identity uncertain")
    for animal in facts.animals:
        after = ", ".join(map(str, animal.identity_uncertain_after))
        unsure = f"after frame {after}" if after else "no"
        if animal.capture is None:
            rows.append((animal.animal, "-", 0, "-", "-", unsure))
            continue
        used = animal.capture.frames_used
        length = f"{animal.capture.length_px:g}"
        merged = animal.frames_merged
        rows.append((animal.animal, animal.capture.track, used, merged, length, unsure))
    print_table(heads, rows, f"{facts.recording}: {facts.frames} frames")
    console.print(f"other objects, not captured: {facts.left_out}; background: {facts.background}")
