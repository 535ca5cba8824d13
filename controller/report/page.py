"""The page: headline numbers, film, curves, figures, events and configuration in one file.

The template escapes everything that comes from the log.
"""

import base64
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from urllib.parse import quote

from snakewalk.config.errors import InputError
from snakewalk.controller.console.result_files import LOG
from snakewalk.controller.console.shared_text import shared, without_folders
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.metrics.verdict import RunVerdict, verdict
from snakewalk.controller.report.trip import Trip, trip_of
from snakewalk.controller.runlog.record import Event, RunRecord

T = TypeVar("T", RunSummary, Event, Trip, RunVerdict)
_EVENTS_SHOWN = 300
INLINE_BYTES = 8_000_000
_TYPES = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


@dataclass(frozen=True, slots=True)
class Section:
    """One figure on the page."""

    title: str
    caption: str
    image: str
    """Data URI."""


class Drawings(NamedTuple):
    """Figures of a page, its curves, and the command that drew them."""

    sections: Sequence[Section]
    curves: str = ""
    """HTML made by ``curves_html``, or empty."""
    made: str = ""
    """Command, place and time; may be empty."""


@dataclass(frozen=True, slots=True)
class Film:
    """A film on the page."""

    source: str
    """Data URI, or a link relative to the page."""
    is_picture: bool
    start: str
    """Time of the run at which the film begins, s."""
    speed: str
    """Seconds of run per second of film."""


def page(
    record: RunRecord,
    numbers: RunSummary,
    drawings: Drawings,
    *,
    film: Film | None = None,
    links: Sequence[str] = (),
    folders: bool = False,
) -> str:
    """Return the page as HTML; ``templates/page.html`` has its layout.

    Args:
        record: the log of the run.
        numbers: of the run.
        drawings: its figures and curves.
        film: shown first, if there is one.
        links: names of files in the same folder as the page.
        folders: whether the texts keep the folders of the user's files.

    """
    header = record.header
    run_verdict = verdict(record, numbers, LOG)
    events: Sequence[Event] = record.events
    trip = trip_of(record)
    creation_text = drawings.made
    config: Mapping[str, Any] = {
        "run": header.run.model_dump(mode="json"),
        "robot": header.robot.model_dump(mode="json"),
        "world": header.world.model_dump(mode="json"),
    }
    if not folders:
        numbers = _without_folders(numbers)
        config = shared(config)
        creation_text = without_folders(creation_text)
        events = [_without_folders(event) for event in events]
        trip = None if trip is None else _without_folders(trip)
        run_verdict = _without_folders(run_verdict)
    every = numbers.to_dict() if folders else shared(numbers.to_dict())
    return str(
        _template().render(
            n=numbers,
            mood=_mood(numbers),
            headline=_headline(numbers, run_verdict),
            verdict=run_verdict,
            facts=_facts(numbers, run_verdict),
            tiles=_tiles(numbers),
            film=film,
            trip=trip,
            curves=drawings.curves,
            sections=drawings.sections,
            events=events[:_EVENTS_SHOWN],
            more_events=max(0, len(events) - _EVENTS_SHOWN),
            details=[
                (title, json.dumps(values, indent=2, ensure_ascii=False))
                for title, values in (("All numbers", every), ("Configuration", config))
            ],
            links=[(quote(name), name) for name in links],
            made=creation_text,
        )
    )


def _without_folders(facts: T) -> T:
    """Return a dataclass whose texts have no folders of the user's files."""
    values: Any = {field.name: shared(getattr(facts, field.name)) for field in fields(facts)}
    return replace(facts, **values)


@cache
def _template() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415  an extra

    folder = FileSystemLoader(Path(__file__).with_name("templates"))
    return Environment(
        loader=folder, autoescape=True, undefined=StrictUndefined, trim_blocks=True
    ).get_template("page.html")


def _mood(n: RunSummary) -> str:
    if n.trip is not None:
        return "bad"
    return "good" if n.is_measured and n.waypoints_reached == n.waypoints else "fair"


def _headline(n: RunSummary, run_verdict: RunVerdict) -> str:
    """Return the sentence of the verdict, with robot, motion, bus and missed deadlines."""
    where = "on the simulator" if n.backend == "sim" else f"on {n.backend}"
    late = n.missed_deadlines
    missed = f"{_count(late, 'deadline') if late else 'no deadline'} missed"
    return f"{n.robot} by {n.motion} {where}: {run_verdict.sentence}, {missed}."


def _facts(n: RunSummary, run_verdict: RunVerdict) -> tuple[tuple[str, object], ...]:
    return (
        ("robot", n.robot),
        ("ground", n.world),
        ("motion", n.motion),
        ("bus", "simulation" if n.backend == "sim" else n.backend),
        ("seed", n.seed),
        ("configuration", n.config_hash),
        ("pose", run_verdict.evidence),
        ("snakewalk", n.software),
    )


def _tiles(n: RunSummary) -> list[tuple[str, str, str]]:
    """Name, value and the line below it of each headline number."""
    wire = f"{_pct(n.wire_use_mean)} of the wire" if n.wire_use_mean is not None else ""
    if n.stalls:
        wire += f"; {n.stalls} pauses of the computer, {_fmt(n.stalled_s, 2)} s"
    torque = "" if n.peak_torque_n_m is None else f"{_fmt(n.peak_torque_n_m, 2)} N m"
    vetoes = _count(n.vetoes, "veto", "vetoes")
    missed = f"{n.missed_deadlines} of {n.cycles}"
    duration_text = f"in {_fmt(n.duration_s, 1)} s"
    tiles = [
        (
            "Waypoints",
            f"{_fmt(n.waypoints_reached, 0)} of {n.waypoints}",
            duration_text,
        ),
        (
            "Path error",
            f"{_fmt(n.path_error_mean_m, 3)} m",
            f"at most {_fmt(n.path_error_max_m, 3)} m",
        ),
        ("Speed", f"{_fmt(n.speed_m_s, 3)} m/s", "of the centre of mass, along the path"),
        (
            "Gain η",
            _fmt(n.eta, 2),
            f"of the links over the pulse; predicted {_fmt(n.eta_predicted, 2)}",
        ),
        ("Travelled", f"{_fmt(n.travelled_m, 2)} m", f"path of {_fmt(n.path_length_m, 2)} m"),
        ("Tracking", f"{_fmt(n.tracking_rms_rad, 3)} rad", f"RMS; lag {_fmt(n.lag_s, 3)} s"),
        ("Peak current", f"{_fmt(n.peak_current_a, 2)} A", torque),
        (
            "Energy",
            f"{_fmt(n.electrical_energy_j, 0)} J",
            f"cost of transport {_fmt(n.electrical_cost_of_transport, 2)}"
            + (", sampled" if n.energy_source == "sampled" else ""),
        ),
        (
            "Hottest servo",
            f"{_fmt(n.peak_temperature_c, 0)} °C",
            f"supply down to {_fmt(n.lowest_voltage_v, 1)} V",
        ),
        ("Missed deadlines", missed, wire),
        ("Safety", _count(n.clamps, "clamp"), f"{vetoes}, {_count(n.alarms, 'alarm')}"),
    ]
    if n.carrier_share is not None:
        tiles.insert(5, ("On wide waves", _pct(n.carrier_share), "of the walk's decisions"))
    law = n.assumptions["friction_law"]
    tiles.append(("Law of friction", str(law["value"]), f"{law['kind']}; {law['source']}"))
    friction_found = n.friction_found
    if friction_found is not None:
        (along, along_to), (across, across_to) = friction_found.along_95, friction_found.across_95
        tiles.append(
            (
                "Friction found",
                f"{friction_found.along:.2f} along, {friction_found.across:.2f} across",
                f"95 %: {along:.2f} to {along_to:.2f}, {across:.2f} to {across_to:.2f}; "
                f"world's file: {friction_found.along_file:g}, {friction_found.across_file:g}",
            )
        )
    if n.waypoints == 0:  # a gait has no path, and its shape need not go along the body
        tiles = [("Travelled", f"{_fmt(n.travelled_m, 2)} m", duration_text), *tiles[5:]]
    return [tile for tile in tiles if not tile[1].startswith("–")]


def film_on_page(film: Path, out_dir: Path, start_s: float = 0.0, speed_up: float = 1.0) -> Film:
    """Return a film for the page; one above ``INLINE_BYTES`` is linked relative to ``out_dir``.

    It begins at ``start_s`` of the run, and is ``speed_up`` times as fast.

    Raises:
        InputError: the file does not exist, or browsers do not play its type.

    """
    kind = _TYPES.get(film.suffix.lower())
    if kind is None:
        raise InputError(f"{film}: a film on the page is one of {', '.join(_TYPES)}")
    if not film.is_file():
        raise InputError(f"{film}: no such film")
    if film.stat().st_size <= INLINE_BYTES:
        source = f"data:{kind};base64," + base64.b64encode(film.read_bytes()).decode()
    else:
        source = quote(os.path.relpath(film.resolve(), out_dir.resolve()).replace(os.sep, "/"))
    return Film(source, kind.startswith("image"), f"{start_s:.3f}", f"{speed_up:g}")


def _fmt(value: float | None, decimals: int) -> str:
    return "–" if value is None else f"{value:.{decimals}f}"


def _count(number: int, singular: str, more: str = "") -> str:
    return f"{number} {singular if number == 1 else more or singular + 's'}"


def _pct(value: float) -> str:
    return f"{100.0 * value:.0f} %"
