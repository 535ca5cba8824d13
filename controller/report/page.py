"""The page: headline numbers first, then film, curves, figures, events and what ran; one file.

Everything that comes from the log is escaped.
"""

import base64
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from html import escape
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from snakewalk.config.errors import InputError
from snakewalk.controller.console.shared_text import shared, without_folders
from snakewalk.controller.metrics.summary import RunSummary
from snakewalk.controller.runlog.record import Event

_EVENTS_SHOWN = 300
INLINE_BYTES: Final = 8_000_000
_TYPES: Final = {".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif"}


@dataclass(frozen=True, slots=True)
class Section:
    """One figure on the page."""

    title: str
    caption: str
    image: str
    """Data URI."""
    is_folded: bool = False
    """Whether it is shown at a click only: the curves have it as well."""


def page(
    numbers: RunSummary,
    sections: Sequence[Section],
    *,
    film: str,
    events: Sequence[Event],
    config: Mapping[str, Any],
    curves: str = "",
    links: Sequence[str] = (),
    made: str = "",
    folders: bool = False,
) -> str:
    """Whole page.

    Args:
        numbers: of the run.
        sections: its figures.
        film: HTML made by ``film_html``, or empty.
        events: of the log.
        config: run, robot and world.
        curves: HTML made by ``curves_html``, or empty.
        links: names of files beside the page.
        made: by which command, where and when the page was made; empty: not said.
        folders: whether the texts keep the folders of the user's files.

    """
    if not folders:
        known = {field.name: getattr(numbers, field.name) for field in fields(numbers)}
        texts = {key: without_folders(one) for key, one in known.items() if isinstance(one, str)}
        numbers, config, made = replace(numbers, **texts), shared(config), without_folders(made)
        events = [replace(event, text=without_folders(event.text)) for event in events]
    title = f"{numbers.run} on {numbers.backend}"
    note = f'<p class="note">{escape(numbers.log_note)}</p>' if numbers.log_note else ""
    body = [
        f"<header><p class='kind'>snakewalk run</p><h1>{escape(str(numbers.run))}</h1>",
        f"<p class='{_mood(numbers)} outcome'>{escape(str(numbers.outcome))}</p>{note}",
        f"<p class='verdict'>{escape(_headline(numbers))}</p>",
        f"<p class='facts'>{_facts(numbers)}</p></header>",
        f"<section class='tiles'>{''.join(_tiles(numbers))}</section>",
        film,
        curves,
        *(_figure(s) for s in sections),
        _events(events),
        _details("All numbers", numbers.to_dict() if folders else shared(numbers.to_dict())),
        _details("Configuration", config),
        _footer(links, made),
    ]
    return (
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>{escape(title)}</title><style>{CSS}</style></head>\n<body><main>"
        + "\n".join(part for part in body if part)
        + f"</main><script>{SCRIPT}</script></body></html>\n"
    )


def _mood(n: RunSummary) -> str:
    if n.trip is not None:
        return "bad"
    return "good" if n.is_measured and n.waypoints_reached == n.waypoints else "fair"


def _headline(n: RunSummary) -> str:
    """One sentence: how far it came, how fast, how well it kept to its path, whether on time."""
    where = "on the simulator" if n.backend == "sim" else f"on {n.backend}"
    late = n.missed_deadlines
    missed = f"{_count(late, 'deadline') if late else 'no deadline'} missed."
    if not n.is_measured:
        return _believed_headline(n, where, missed)
    if n.waypoints == 0:
        return (
            f"{n.robot} moved by {n.motion} {where}: its centre of mass went "
            f"{_fmt(n.travelled_m, 1)} m in {_fmt(n.duration_s, 1)} s, {missed}"
        )
    return (
        f"{n.robot} reached {n.waypoints_reached} of {_count(n.waypoints, 'waypoint')} "
        f"{where}: {_fmt(n.travelled_m, 1)} m in {_fmt(n.duration_s, 1)} s, "
        f"{_centimetres(n.path_error_mean_m)} from its path on average, {missed}"
    )


def _believed_headline(n: RunSummary, where: str, missed: str) -> str:
    """Return the sentence of a run whose pose was dead-reckoned."""
    travelled = f"{_fmt(n.dead_reckoned_travelled_m, 1)} m in {_fmt(n.duration_s, 1)} s"
    unknown = "Nothing measured the pose: distances and arrivals are dead-reckoned."
    if n.waypoints == 0:
        moved = f"{n.robot} moved by {n.motion} {where} and believes it went"
        return f"{moved} {travelled}, {missed} {unknown}"
    return (
        f"{n.robot} believes it reached {n.dead_reckoned_waypoints_reached} of "
        f"{_count(n.waypoints, 'waypoint')} {where}: {travelled}, {missed} {unknown}"
    )


def _centimetres(length_m: float | None) -> str:
    return "–" if length_m is None else f"{100.0 * length_m:.1f} cm"


def _facts(n: RunSummary) -> str:
    backend = "simulation" if n.backend == "sim" else n.backend
    facts = (
        ("robot", n.robot), ("ground", n.world), ("motion", n.motion),
        ("bus", backend), ("seed", n.seed), ("configuration", n.config_hash),
        ("pose", _evidence(n)), ("snakewalk", n.software),
    )  # fmt: skip
    return " ".join(f"<span><b>{k}</b> {escape(str(v))}</span>" for k, v in facts)


def _evidence(n: RunSummary) -> str:
    if n.pose_source == "simulator":
        return "simulated"
    simulated = ", simulated" if n.pose_is_simulated or n.port_is_pseudo_terminal else ""
    return f"{n.pose_evidence} ({n.pose_source}{simulated})"


def _tiles(n: RunSummary) -> list[str]:
    wire = f"{_pct(n.wire_use_mean)} of the wire" if n.wire_use_mean is not None else ""
    torque = "" if n.peak_torque_n_m is None else f"{_fmt(n.peak_torque_n_m, 2)} N m"
    vetoes = _count(n.vetoes, "veto", "vetoes")
    missed = f"{n.missed_deadlines} of {n.cycles}"
    took = f"in {_fmt(n.duration_s, 1)} s"
    tiles = [
        _tile("Waypoints", f"{_fmt(n.waypoints_reached, 0)} of {n.waypoints}",
              f"in {_fmt(n.duration_s, 1)} s"),
        _tile("Path error", f"{_fmt(n.path_error_mean_m, 3)} m",
              f"at most {_fmt(n.path_error_max_m, 3)} m"),
        _tile("Speed", f"{_fmt(n.speed_m_s, 3)} m/s",
              f"predicted {_fmt(n.predicted_speed_m_s, 3)}"),
        _tile("Gain η", _fmt(n.eta, 2), "speed over pulse speed"),
        _tile("Travelled", f"{_fmt(n.travelled_m, 2)} m",
              f"path of {_fmt(n.path_length_m, 2)} m"),
        _tile("Tracking", f"{_fmt(n.tracking_rms_rad, 3)} rad",
              f"RMS; lag {_fmt(n.lag_s, 3)} s"),
        _tile("Peak current", f"{_fmt(n.peak_current_a, 2)} A", torque),
        _tile("Energy", f"{_fmt(n.electrical_energy_j, 0)} J",
              f"cost of transport {_fmt(n.electrical_cost_of_transport, 2)}"
              + (", sampled" if n.energy_source == "sampled" else "")),
        _tile("Hottest servo", f"{_fmt(n.peak_temperature_c, 0)} °C",
              f"supply down to {_fmt(n.lowest_voltage_v, 1)} V"),
        _tile("Missed deadlines", missed, wire),
        _tile("Safety", _count(n.clamps, "clamp"), f"{vetoes}, {_count(n.alarms, 'alarm')}"),
    ]  # fmt: skip
    found = n.friction_found
    if found is not None:
        (along, along_to), (across, across_to) = found.along_95, found.across_95
        tiles.append(
            _tile("Friction found", f"{found.along:.2f} along, {found.across:.2f} across",
                  f"95 %: {along:.2f} to {along_to:.2f}, {across:.2f} to {across_to:.2f}; "
                  f"world's file: {found.along_file:g}, {found.across_file:g}")
        )  # fmt: skip
    if n.waypoints == 0:  # a gait has no path, and its shape need not go along the body
        return [_tile("Travelled", f"{_fmt(n.travelled_m, 2)} m", took), *tiles[5:]]
    return tiles


def _tile(name: str, value: str, below: str) -> str:
    return (
        f"<div><span>{escape(name)}</span><strong>{escape(value)}</strong>"
        f"<small>{escape(below)}</small></div>"
    )


def _figure(section: Section) -> str:
    shown = (
        f"<figure><div class='wide'><img src='{section.image}' alt='{escape(section.title)}'></div>"
        f"<figcaption>{escape(section.caption)}</figcaption></figure>"
    )
    if section.is_folded:
        name = f"{escape(section.title)}, as a picture"
        return f"<details><summary>{name}</summary>{shown}</details>"
    return f"<section><h2>{escape(section.title)}</h2>{shown}</section>"


def _footer(links: Sequence[str], made: str) -> str:
    """Files beside the page, and what made it."""
    named = ", ".join(f"<a href='{quote(name)}'>{escape(name)}</a>" for name in links)
    lines = [f"Beside this page: {named}." if named else "", escape(made)]
    return "".join(f"<p class='facts made'>{line}</p>" for line in lines if line)


def _events(events: Sequence[Event]) -> str:
    if not events:
        return ""
    rows = "".join(
        f"<tr class='{escape(e.level)}'><td><button data-time='{e.time_s:.3f}'>{e.time_s:.2f} s"
        f"</button></td><td>{escape(e.kind)}</td>"
        f"<td>{escape(e.text)}</td></tr>"
        for e in events[:_EVENTS_SHOWN]
    )
    rest = len(events) - _EVENTS_SHOWN
    more = f"<p class='facts'>and {rest} more in the log</p>" if rest > 0 else ""
    hint = "<p class='facts'>A time leads to its place in the film and in the curves.</p>"
    return f"<section><h2>What happened</h2>{hint}<table>{rows}</table>{more}</section>"


def film_html(film: Path, out_dir: Path, start_s: float = 0.0, speed_up: float = 1.0) -> str:
    """HTML for a film; one above ``INLINE_BYTES`` is linked relative to ``out_dir``.

    It begins at ``start_s`` of the run, and is ``speed_up`` times as fast.

    Raises:
        InputError: there is no such file, or browsers do not play its type.

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
    if kind.startswith("image"):
        shown = f"<img src='{escape(source)}' alt='Film of the run'>"
    else:
        time = f"data-start='{start_s:.3f}' data-speed='{speed_up:g}'"
        how = f"controls autoplay muted loop playsinline {time}"
        shown = f"<video {how} src='{escape(source)}'></video>"
    return f"<section><h2>Film</h2><figure>{shown}</figure></section>"


def _details(title: str, values: Mapping[str, Any]) -> str:
    text = escape(json.dumps(values, indent=2, ensure_ascii=False))
    return f"<details><summary>{escape(title)}</summary><pre>{text}</pre></details>"


def _fmt(value: float | None, decimals: int) -> str:
    return "–" if value is None else f"{value:.{decimals}f}"


def _count(number: int, one: str, more: str = "") -> str:
    return f"{number} {one if number == 1 else more or one + 's'}"


def _pct(value: float) -> str:
    return f"{100.0 * value:.0f} %"


CSS: Final = """
:root { --ink: #22303c; --grey: #5d6c7a; --line: #e1e7ec; --blue: #0072b2; }
* { box-sizing: border-box; }
body { margin: 0; background: #f5f7f9; color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 1160px; margin: 0 auto; padding: 28px 20px 60px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 8px; }
h2 { font-size: 18px; margin: 0 0 10px; }
.kind { margin: 0; color: var(--grey); font-size: 13px; letter-spacing: .04em; }
.outcome { display: inline-block; margin: 0 0 10px; padding: 3px 12px; border-radius: 14px;
  font-weight: 600; }
.outcome.good { background: #d8f1e7; color: #00593f; }
.outcome.fair { background: #fcefcf; color: #6e4c00; }
.outcome.bad { background: #fbe0d2; color: #8c3a00; }
.verdict { margin: 0 0 10px; font-size: 16px; }
.note { margin: 0 0 10px; color: #8c3a00; }
.facts { margin: 0; color: var(--grey); font-size: 13px; }
.facts span { margin-right: 16px; white-space: nowrap; }
.facts b { font-weight: 600; color: var(--ink); }
.tiles { display: grid; gap: 10px; margin: 20px 0; padding: 0; background: none; border: 0;
  grid-template-columns: repeat(auto-fit, minmax(190px, 1fr)); }
.tiles div, section, details { background: #fff; border: 1px solid var(--line);
  border-radius: 8px; }
.tiles div { padding: 10px 14px; }
.tiles span { display: block; color: var(--grey); font-size: 13px; }
.tiles strong { display: block; font-size: 23px; line-height: 1.3; }
.tiles small { color: var(--grey); font-size: 13px; }
section { margin: 0 0 16px; padding: 16px 20px; }
figure { margin: 0; }
figure img, figure video { display: block; width: 100%; height: auto; }
td button { font: inherit; color: var(--blue); background: none; border: 0; padding: 0;
  cursor: pointer; font-variant-numeric: tabular-nums; }
select { font: inherit; }
.made { margin-top: 10px; overflow-wrap: anywhere; }
details figure { margin-top: 12px; }
figcaption { margin-top: 8px; color: var(--grey); font-size: 13px; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
td { padding: 4px 14px 4px 0; border-top: 1px solid var(--line); vertical-align: top; }
td:first-child { white-space: nowrap; font-variant-numeric: tabular-nums; }
tr:first-child td { border-top: 0; }
td:last-child { width: 100%; }
tr.warning td:nth-child(2) { color: #9a6a00; font-weight: 600; }
tr.error td:nth-child(2) { color: #b34700; font-weight: 600; }
details { margin: 0 0 10px; padding: 10px 20px; }
summary { cursor: pointer; font-weight: 600; }
pre { overflow-x: auto; font-size: 12.5px; }
@media (max-width: 640px) {
  main { padding: 14px 8px 40px; }
  h1 { font-size: 24px; }
  section, details { padding: 12px 10px; }
  .tiles { grid-template-columns: 1fr 1fr; gap: 8px; }
  .tiles strong { font-size: 19px; }
  .facts span { white-space: normal; }
  .wide { overflow-x: auto; }
  .wide img { width: 860px; max-width: none; }
  .wide::before { content: "it goes on to the right →"; display: block; position: sticky;
    left: 0; color: var(--grey); font-size: 13px; }
  td { padding-right: 8px; }
  td:last-child { overflow-wrap: anywhere; }
}
@media print { body { background: #fff; } section { break-inside: avoid; } }
"""

SCRIPT: Final = """
const film = document.querySelector("video");
const plot = document.getElementById("plot");
let mark = null;
const toFilm = t => (t - film.dataset.start) / film.dataset.speed;
const toRun = t => +film.dataset.start + t * film.dataset.speed;
document.querySelectorAll("button[data-time]").forEach(b => b.addEventListener("click", () => {
  const t = +b.dataset.time;
  if (film) { film.pause(); film.currentTime = Math.max(toFilm(t), 0); }
  if (mark) mark(t);
  (film || plot || b).scrollIntoView({ behavior: "smooth", block: "center" });
}));
(async () => {
  if (!plot) return;
  const unpacked = id => {
    const packed = atob(document.getElementById(id).textContent);
    const bytes = Uint8Array.from(packed, c => c.charCodeAt(0));
    const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(plain).text();
  };
  const library = document.createElement("script");
  library.textContent = await unpacked("plotly");
  document.head.append(library);
  const spec = JSON.parse(await unpacked("curves-data"));
  const shapes = spec.layout.shapes;
  const now = { type: "line", x0: 0, x1: 0, yref: "paper", y0: 0, y1: 1,
    line: { color: "#22303c", width: 1.2 } };
  spec.layout.height = spec.height;
  spec.layout.shapes = [...shapes, now];
  await Plotly.newPlot(plot, spec.traces, spec.layout, { responsive: true,
    displaylogo: false, displayModeBar: innerWidth > 640 && "hover" });
  mark = t => Plotly.relayout(plot, { [`shapes[${shapes.length}].x0`]: t,
    [`shapes[${shapes.length}].x1`]: t });
  if (film) film.addEventListener("timeupdate", () => mark(toRun(film.currentTime)));
  document.getElementById("joint").addEventListener("change", change => {
    const rows = spec.joints[+change.target.value];
    Plotly.restyle(plot, { y: rows }, rows.map((_, k) => spec.first + k));
  });
})();
"""
