"""``snakewalk animal track``: properties of recordings, and the share that a robot can do."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from snakewalk.config.constants import DEFAULT_ROBOT, DEFAULT_WORLD
from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    GivenRobot,
    GivenWorld,
    Json,
    console,
)

if TYPE_CHECKING:
    from snakewalk.controller.capture.recording import RecordingFacts
from snakewalk.controller.capture.recording import examine
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_picture,
)
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.generated import EMBEDDED
from snakewalk.controller.track.readers.load import choice_among
from snakewalk.controller.track.readers.writers import SUFFIXES, write_track
from snakewalk.controller.track.track import UNSURE_HEAD


@command(
    "animal track",
    examples=("animal track", "animal track MIDLINES.csv --rate 60 --picture track.png"),
    results=("picture", "output"),
)
def track(
    recordings: Annotated[
        list[str] | None,
        typer.Argument(
            help="shipped names or files; default: the shipped ones",
            metavar="NAME",
            autocompletion=completion.RECORDINGS,
        ),
    ] = None,
    robot: GivenRobot = DEFAULT_ROBOT,
    world: GivenWorld = DEFAULT_WORLD,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="write the chosen animal as a track (.npz, .csv or .wcon)"
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="draw midlines and angles here (.png, .svg, .pdf)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: Choice,
) -> None:
    """Examine recordings: wave, bends, states this robot can use, slowing for its servos."""
    check_picture(picture)

    names = recordings or list(EMBEDDED)
    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise InputError(f"{output}: a track is written as one of {', '.join(SUFFIXES)}")
    if output is not None and len(names) > 1:
        raise InputError(f"{output}: one recording makes one file; {len(names)} are named")
    tracked = [
        examine(
            name,
            robot,
            world,
            choice=choice_among(name, names, choice),
        )
        for name in show_progress(names, "recordings", len(names))
    ]
    if picture is not None:
        from snakewalk.controller.capture.plots.recording import draw  # noqa: PLC0415  --picture: an extra

        draw(
            [
                (tracked_film.track, Path(tracked_film.facts.recording).name)
                for tracked_film in tracked
            ],
            picture,
        )
    if output is not None:
        with atomic_write(output) as part:
            write_track(part, tracked[0].track, output.suffix)
    if as_json:
        print(json.dumps([tracked_film.facts.to_dict() for tracked_film in tracked]))
        return
    for tracked_film in tracked:
        _show(tracked_film.facts)


def _show(facts: "RecordingFacts") -> None:
    """One recording as a table of two columns, units in words."""
    pace = facts.pace
    length = "no scale" if facts.length_mm is None else f"{facts.length_mm:g} mm long"
    bridged = f"{facts.frames_bridged} with a keypoint set, " if facts.frames_bridged else ""
    missing = f"{facts.frames_missing} missing in the file, " if facts.frames_missing else ""
    assumed = " (assumed; give --rate)" if facts.rate_assumed else ""
    if facts.times_uneven:
        assumed = " (frames came at uneven times; bodies put between them)"
    refused = ", ".join(f"{n} for {why}" for why, n in facts.states_refused.items() if n)
    stall = pace.times_no_load_speed
    rows = {
        "source": "; ".join(dict.fromkeys((str(facts.source), str(facts.licence)))),
        "frames": f"{facts.frames}, {facts.frames_left_out} left out, "
        f"{missing}"
        f"{bridged}"
        f"{facts.rate_hz:g} Hz{assumed}, {length}",
        "wave": f"{facts.waves_on_body} on the body, {facts.wave_hz} Hz, "
        f"{facts.wave_share:.0%} of the bending; towards the head "
        f"{facts.time_towards_head:.0%} of the time"
        if facts.time_towards_head is not None
        else f"not stated: {facts.wave_not_told}",
        "bend K": f"{facts.bend_k_rad} rad, at most {facts.bend_k_most_rad}",
        "in 7 coefficients": f"{facts.energy_kept:.2%} of the energy",
        "states": f"{facts.states_kept} of {facts.frames} usable by {facts.robot}"
        + (f"; refused {refused}" if refused else ""),
        "joint speed": f"{pace.joint_speed_rad_s} rad/s at the animal's pace; a plan may ask "
        f"{pace.joint_speed_limit_rad_s:g}"
        + ("" if stall is None else f"; {stall} of the servo's no-load speed"),
        "slowed": f"{pace.slowed_by} times throughout (speed {pace.slowed_by_for_speed}, "
        f"acceleration {pace.slowed_by_for_acceleration}); "
        f"{pace.longer_if_slowed_where_needed} times longer if only where needed",
    }
    if not facts.places_recorded:
        rows["places"] = "not recorded: the images were cropped to the animal or the camera moved"
    if facts.head_and_tail_swapped:
        rows["warning"] = f"head and tail change places {facts.head_and_tail_swapped} times"
    elif facts.head_sure is not None and facts.head_sure < UNSURE_HEAD:
        rows["warning"] = (
            f"head and tail may be exchanged (sure by {facts.head_sure:.2f}); capture the film "
            "again with --head X,Y, or correct it on the page of capture --review"
        )
    elif facts.time_towards_head is not None and facts.time_towards_head > 0.5:
        rows["warning"] = "the wave runs towards the head: an animal going backwards, or tail first"
    if facts.every_nth_frame > 1:
        rows["rows"] = f"every {facts.every_nth_frame}th frame of the camera"
    if facts.notes:
        rows["changed by the reader"] = "\n".join(facts.notes)
    table = Table(title=facts.recording, title_justify="left", box=None, show_header=False)
    for key, text in rows.items():
        table.add_row(key, text)
    console.print(table)
