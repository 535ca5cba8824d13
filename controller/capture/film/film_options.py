"""Options of ``snakewalk animal capture``: facts about a film, and results to write."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from snakewalk.config.answers import Answers
from snakewalk.controller.console.option import Flag
from snakewalk.controller.console.options import Force


class FootageChoice(Answers):
    """Rate, scale and head of a film of an animal."""

    length_m: float | None = Field(
        None, gt=0.0, description="length of the animal in metres, which sets the scale"
    )
    marker: str | None = Field(
        None,
        description="scale from a printed ArUco or AprilTag marker with SIDE in metres; or "
        "X0,Y0,X1,Y1,METRES: two points in the image and their distance",
    )
    rate_hz: Annotated[float | None, Flag(("--rate",))] = Field(
        None,
        description="frame rate in frames per second; default: the rate that the film states",
    )
    head: str | None = Field(
        None,
        description="X,Y in pixels near the head in the first usable frame; with --animals X,Y;X,Y "
        "for several heads",
    )


class CaptureOptions(FootageChoice):
    """A film, its facts, and results to write."""

    recording: Annotated[Path, Flag(is_argument=True, metavar="VIDEO|FOLDER|TRACK.npz")] = Field(
        description="a video, a TIFF stack or a folder of images; with --corrections, an earlier "
        "track"
    )
    output: Annotated[Path, Flag(("--output", "-o"))] = Field(
        Path("track.npz"),
        description="write the track here (.npz, .csv or .wcon); with --animals to track-1.npz and "
        "so on, or to one .csv or .wcon",
    )
    background: Path | None = Field(
        None, description="image without the animal; default: estimated from frames"
    )
    cropped: bool = Field(
        False, description="the images were cropped to the animal, or the camera moves"
    )
    roi: Annotated[str | None, Flag(metavar="X,Y,W,H")] = Field(
        None, description="search only this part of the image: X,Y,W,H in pixels"
    )
    mask: Annotated[Path | None, Flag(metavar="PNG")] = Field(
        None, description="search only where this picture is white"
    )
    threshold: float | None = Field(
        None,
        gt=0.0,
        description="grey levels between body and background at the boundary; default: half of the "
        "body's contrast",
    )
    keypoints: Annotated[Path | None, Flag(metavar="FILE")] = Field(
        None,
        description="positions of the body from a file of SLEAP or DeepLabCut, in the order of its "
        "names or of its stored answers",
    )
    overlay: Path | None = Field(
        None, description="write a film with the skeleton on it (.mp4, .avi)"
    )
    sheet: Path | None = Field(None, description="write a contact sheet of frames (.png, .jpg)")
    steps: Path | None = Field(
        None, description="draw the first usable frame step by step (.png, .jpg)"
    )
    trail: Path | None = Field(
        None,
        description="draw all places of the animal as one picture: each pixel's brightest, or "
        "darkest, value over the film (.png, .jpg)",
    )
    review: Annotated[Path | None, Flag(metavar="PAGE")] = Field(
        None,
        description="write a page (.html) for flipping heads, leaving out frames and dragging "
        "points; open it in a browser",
    )
    corrections: Annotated[Path | None, Flag(metavar="JSON")] = Field(
        None,
        description="apply the corrections that the review page saved, and write the track to "
        "--output",
    )
    animals: Annotated[str | None, Flag(metavar="N|auto")] = Field(
        None,
        description="capture several animals, with one track each: their number, or auto for those "
        "that are in view for half of the film",
    )
    wide: bool = Field(False, description="in a .csv, one row for each frame instead of each point")
    resume: bool = Field(
        False, description="continue an interrupted capture of a long film from OUT.part"
    )
    force: Force = False
