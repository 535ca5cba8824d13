"""``snakewalk capture``: from a film of an animal to a track that the robot can walk."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from snakewalk.controller.capture.capturing import (
    CaptureOptions,
    capture_recording,
    correct_recording,
)
from snakewalk.controller.console.command import RECORDINGS, command
from snakewalk.controller.console.options import Force, Json, show

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
        help="apply the corrections that the review page of TRACK.npz saved, and write -o",
        metavar="JSON",
    ),
]
Background = Annotated[
    Path | None, typer.Option(help="image without the animal; default: estimated from frames")
]


@command(
    "capture",
    group=RECORDINGS,
    examples=(
        "capture film.mp4 -o track.npz --length-m 0.4 --sheet sheet.png",
        "capture frames/ --cropped --overlay overlay.mp4 --force --json",
        "capture film.mp4 --review review.html",
        "capture track.npz --corrections track-corrections.json -o corrected.npz",
    ),
)
def capture(
    recording: Footage,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="write the track here (.npz)")
    ] = Path("track.npz"),
    background: Background = None,
    length_m: Annotated[
        float | None, typer.Option(help="length of the animal in metres, which sets the scale")
    ] = None,
    marker: Marker = None,
    rate: Annotated[
        float | None,
        typer.Option(
            help="frame rate in frames per second; default: the rate that the film states"
        ),
    ] = None,
    head: Annotated[
        str | None, typer.Option(help="X,Y in pixels near the head in the first usable frame")
    ] = None,
    cropped: Cropped = False,
    roi: Annotated[
        str | None,
        typer.Option(
            help="search only this part of the image: X,Y,W,H in pixels", metavar="X,Y,W,H"
        ),
    ] = None,
    mask: Annotated[
        Path | None, typer.Option(help="search only where this picture is white", metavar="PNG")
    ] = None,
    threshold: Threshold = None,
    overlay: Annotated[
        Path | None, typer.Option(help="write a film with the skeleton on it (.mp4, .avi)")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="write a contact sheet of frames (.png, .jpg)")
    ] = None,
    steps: Annotated[
        Path | None, typer.Option(help="draw the first usable frame step by step (.png, .jpg)")
    ] = None,
    review: Review = None,
    corrections: Corrections = None,
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
        review=review,
        corrections=corrections,
        force=force,
    )
    facts = (capture_recording if corrections is None else correct_recording)(options)
    show(asdict(facts), as_json)
