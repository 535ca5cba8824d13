"""``snakewalk animal analyse``: the motion of a recorded animal."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from snakewalk.config.errors import InputError
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import (
    Force,
    Json,
    console,
)
from snakewalk.controller.console.progress import show_progress
from snakewalk.controller.console.result_files import check_picture, refuse_to_overwrite
from snakewalk.controller.track.analysis import analyse as measure
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import choice_among, load_track


@command(
    "animal analyse",
    examples=("animal analyse worm-like", "animal analyse MIDLINES.csv --picture ."),
)
def analyse(
    recordings: Annotated[
        list[str],
        typer.Argument(
            help="shipped names, or files of tracked bodies",
            metavar="TRACK",
            autocompletion=completion.RECORDINGS,
        ),
    ],
    picture: Annotated[
        Path | None,
        typer.Option(
            help="draw tracks and maps into a file (.png, .svg, .pdf), or a folder for PNGs"
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
    *,
    choice: Choice,
) -> None:
    """Analyse the animal's motion: pulse speed, sliding, wave, frequency, amplitudes, energy."""
    files = _pictures(recordings, picture, force)
    analyses = []
    pairs = list(zip(recordings, files, strict=True))
    for name, file in show_progress(pairs, "recordings", len(pairs)):
        analysis = measure(load_track(name, choice=choice_among(name, recordings, choice)))
        if file is not None:
            from snakewalk.controller.capture.plots.analysis import draw_analysis  # noqa: PLC0415  --picture: an extra

            draw_analysis(analysis, file)
        analyses.append(analysis.facts() | {"picture": None if file is None else str(file)})
    if as_json:
        print(json.dumps(analyses))
        return
    for facts in analyses:
        _show(facts)


def _pictures(recordings: list[str], picture: Path | None, force: bool) -> list[Path | None]:
    """File of each recording's picture; rejected before anything is measured."""
    if picture is None:
        return [None] * len(recordings)
    if picture.suffix and not picture.is_dir():
        check_picture(picture)
        if len(recordings) > 1:
            raise InputError(f"{picture}: one file for {len(recordings)} recordings; give a folder")
        files = [picture]
    else:
        files = [picture / f"{Path(name).stem}.png" for name in recordings]
    if len(set(files)) < len(files):
        raise InputError(f"{picture}: two recordings have the same name; draw them one by one")
    refuse_to_overwrite(files, force)
    return list(files)


def _show(facts: dict[str, Any]) -> None:
    """One recording as a table of two columns, units in words."""
    missing = f"{facts['frames_missing']} missing in the file, " if facts["frames_missing"] else ""
    assumed = " (assumed; give --rate)" if facts["rate_assumed"] else ""
    if facts["times_uneven"]:
        assumed = " (frames came at uneven times; bodies put between them)"
    bridged = f"{facts['frames_bridged']} with a keypoint set, " if facts["frames_bridged"] else ""
    length = "no scale" if facts["length_m"] is None else f"{1e3 * facts['length_m']:.4g} mm long"
    low, high = facts["pulse_quartiles_body_lengths_s"]
    direction = "towards the tail" if facts["wave_towards_tail"] else "towards the head"
    no_wave, no_pulse, no_travel = (
        facts[f"{what}_not_told"] and f"not stated: {facts[f'{what}_not_told']}"
        for what in ("wave", "pulse", "travel")
    )
    rows = {
        "frames": f"{facts['frames']}, {facts['frames_left_out']} left out, "
        f"{missing}"
        f"{bridged}"
        f"{facts['rate_hz']:g} Hz{assumed}, {length}",
        "frequency": no_wave or f"{facts['frequency_hz']} Hz",
        "wave": no_wave
        or f"{facts['waves_on_body']} on the body: {facts['wavelength_body_lengths']} body "
        f"lengths, {facts['wave_number_rad_per_body_length']} rad a body length, {direction}; "
        f"it is {facts['wave_share']:.0%} of the bending",
        "pulse speed": no_pulse
        or f"{facts['pulse_body_lengths_s']} body lengths/s (half of it {low} to "
        f"{high}), {facts['pulse_points_per_frame']} points a frame; known at "
        f"{facts['pulse_measured_share']:.0%} of body and time",
        "one pulse speed for the body": no_pulse
        or f"leaves {facts['one_pulse_error_rad']} rad; goes with the "
        f"slope along the body by {facts['one_pulse_error_correlation']}",
        "frequency x wavelength": no_wave or f"{facts['wave_speed_body_lengths_s']} body lengths/s",
        "travel": no_travel
        or f"{facts['travel']} of the pulse speed; sliding weight w_d {facts['sliding_weight']}"
        + (" (below 0: slips backwards)" if (facts["sliding_weight"] or 0) < 0 else ""),
        "angle amplitude": _profile_text(facts["angle_amplitude_rad"], "rad"),
        "sideways amplitude": _profile_text(
            facts["lateral_amplitude_body_lengths"], "body lengths"
        ),
        "bend K": f"{facts['bend_k_rad']} rad",
        "in 7 coefficients": f"{facts['energy_kept']:.2%} of the shapes' energy, "
        f"{facts['energy_kept_least']:.2%} of the worst",
        "states lie within": ", ".join(f"{a}-{b}" for a, b in facts["state_amplitudes_rad"])
        + " rad: amplitudes of coefficients 1-7, between which random states are drawn",
    }
    if facts["picture"]:
        rows["picture"] = facts["picture"]
    if not no_wave and facts["time_towards_head"] > 0.1:
        rows["note"] = (
            f"the wave runs towards the head {facts['time_towards_head']:.0%} of the time"
        )
    if facts["every_nth_frame"] > 1:
        rows["rows"] = f"every {facts['every_nth_frame']}th frame of the camera"
    if facts["notes"]:
        rows["changed by the reader"] = "\n".join(facts["notes"])
    table = Table(title=facts["recording"], title_justify="left", box=None, show_header=False)
    for key, text in rows.items():
        table.add_row(key, text)
    console.print(table)


def _profile_text(values: list[float], unit: str) -> str:
    return f"{', '.join(map(str, values))} {unit} (head, 1/4, 1/2, 3/4, tail)"
