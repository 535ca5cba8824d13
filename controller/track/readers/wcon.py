"""WCON, the worm trackers' JSON: midlines with units, in one or more records per animal.

``units`` state those of t, x, y. ``data`` is one record or a list of them, each with an ``id``, one
or more times ``t`` and equally many lists ``x`` and ``y``. ``head`` "L" is the first point, "R" the
last. ``ox, oy`` (else ``cx, cy``) are added to the points; null is missing.
"""

import math
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import DAMAGE, check_members, parse_json
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.file_units import si_value
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.frame_status import statuses_named
from snakewalk.controller.track.resample import equal_arc_length
from snakewalk.controller.track.track import Track, frame_numbers, track_from_points

_OWN_KEY = "@snakewalk"
"""Key of a record with facts for which WCON has no name."""


def load_wcon(file: Path, text: str, choice: Choice) -> Track:
    """Load the text of a WCON file; see ``load.load_file``."""
    try:
        document = parse_json(text)
    except ValueError as error:
        raise InputError(f"{file}: is no JSON: {error}") from None
    units = document.get("units") if isinstance(document, dict) else None
    if not isinstance(units, dict) or "data" not in document:
        raise InputError(f"{file}: expected a WCON object with units and data")
    second = _unit(file, units, "t", "s")
    if second is None:
        raise InputError(f"{file}: units: t: expected a time, such as s, not {units['t']!r}")
    choice.only(file, "WCON", "individual")
    metres = _metres(file, units)
    records = document["data"] if isinstance(document["data"], list) else [document["data"]]
    animals = sorted({str(r.get("id")) for r in records if isinstance(r, dict)})
    if len(animals) > 1 or choice.individual is not None:
        name_of_animal = choice.animal(file, animals, animals)
        records = [
            r for r in records if not isinstance(r, dict) or str(r.get("id")) == name_of_animal
        ]
    bodies, words = _all_bodies(file, records, metres)
    time = second * np.array([moment for moment, _ in bodies])
    step = float(np.median(np.diff(time)))
    if not (np.diff(time) > 0.0).all():
        raise InputError(f"{file}: a time twice: more than one body at a time")
    frame = frame_numbers(str(file), np.rint((time - time[0]) / step))
    if (np.diff(frame) == 0).any():  # too uneven to count frames
        frame = np.arange(len(time))
    track = track_from_points(
        file.stem,
        _resampled_bodies([points for _, points in bodies]),
        choice.rate or 1.0 / step,
        scale_m=None if metres["x"] is None else 1.0,
        frame=frame,
        time_s=time if choice.rate is None else None,
        status=statuses_named([word for _, word in sorted(words)])
        if len(words) == len(time)
        else (),
    )
    return _with_metadata(track, document.get("metadata"), records)


def _metres(file: Path, units: dict[str, Any]) -> dict[str, float | None]:
    """Unit of each coordinate in metres; None for all that are not lengths."""
    metres = {name: _unit(file, units, name, "m") for name in ("x", "y")}
    metres |= {
        name: _unit(file, units, name, "m") if name in units else metres[name[1]]
        for name in ("ox", "oy", "cx", "cy")
    }
    if len({value is None for value in metres.values()}) > 1:
        raise InputError(
            f"{file}: units: some are lengths and some are not; state one for each: "
            + ", ".join(f"{name} {units[name]!r}" for name in metres if name in units)
        )
    return metres


def _all_bodies(
    file: Path, records: list[Any], metres: dict[str, float | None]
) -> tuple[list[tuple[float, Floats]], list[tuple[float, str]]]:
    """Return the bodies of all records in the order of their times, and the words about them."""
    bodies: list[tuple[float, Floats]] = []
    words: list[tuple[float, str]] = []
    for number, record in enumerate(records):
        try:
            bodies += _bodies(record, metres)
            words += _statuses(record)
        except (TypeError, ValueError, KeyError, IndexError, AttributeError) as error:
            raise InputError(
                f"{file}: data[{number}]: expected id, t, x and y, as many lists x and y as times: "
                f"{error}"
            ) from None
    if len(bodies) < 2:
        raise InputError(f"{file}: a recording needs 2 or more times, found {len(bodies)}")
    lost = sum(not math.isfinite(moment) for moment, _ in bodies)
    if lost:
        raise InputError(f"{file}: {lost} of {len(bodies)} times t are not finite numbers")
    bodies.sort(key=lambda body: body[0])
    return bodies, words


def _with_metadata(track: Track, about: Any, records: list[Any]) -> Track:
    if isinstance(about, dict):
        stated = [about.get(name) for name in ("source", "licence")]
        source, licence = (
            statement if isinstance(statement, str) else "not stated" for statement in stated
        )
        recorded = about.get("places_recorded") is not False
        track = replace(track, source=source, licence=licence, places_recorded=recorded)
    our_records = [record for record in records if isinstance(record.get(_OWN_KEY), dict)]
    if len(our_records) == len(records):
        sure = [our_record[_OWN_KEY].get("head_sure") for our_record in our_records]
        numbers = [float(sure_value) for sure_value in sure if isinstance(sure_value, (int, float))]
        source = our_records[0][_OWN_KEY].get("source", track.source)
        track = replace(track, name=str(our_records[0].get("id")), source=str(source))
        return replace(track, head_sure=min(numbers, default=None))
    return track


def _statuses(record: dict[str, Any]) -> list[tuple[float, str]]:
    """Times and names of the statuses of a record; empty where they are not stated."""
    our_words = record.get(_OWN_KEY)
    words = our_words.get("status") if isinstance(our_words, dict) else None
    times = record["t"] if isinstance(record["t"], list) else [record["t"]]
    if not isinstance(words, list) or len(words) != len(times):
        return []
    return [(float(moment), str(word)) for moment, word in zip(times, words, strict=True)]


def zipped_text(file: Path) -> str | None:
    """Text of the JSON in an archive; None if it holds arrays (.npz)."""
    try:
        with zipfile.ZipFile(file) as archive:
            names = archive.namelist()
            if any(name.endswith(".npy") for name in names) or not names:
                return None
            member = archive.getinfo(names[0])
            check_members(file, [member], text=True)
            with archive.open(member) as stream:
                return stream.read(member.file_size).decode("utf-8-sig")
    except (*DAMAGE, OSError):
        return None


def _bodies(record: Any, metres: dict[str, float | None]) -> list[tuple[float, Floats]]:
    """Times and head-first points (P, 2) of a record, in metres if its units are lengths."""
    has_times = isinstance(record["t"], list)
    times, xs, ys = (record[k] if has_times else [record[k]] for k in ("t", "x", "y"))
    if not len(times) == len(xs) == len(ys):
        raise ValueError(f"{len(times)} times, {len(xs)} x, {len(ys)} y")
    from_ = ("ox", "oy") if "ox" in record else ("cx", "cy")
    bodies = []
    for k, (moment, x, y) in enumerate(zip(times, xs, ys, strict=True)):
        points = np.stack(
            [_floats(x) * (metres["x"] or 1.0), _floats(y) * (metres["y"] or 1.0)], axis=-1
        )
        points = points + [
            float(_element_at(record.get(name, 0.0), k)) * (metres[name] or 1.0) for name in from_
        ]
        head = _element_at(record.get("head", "L"), k)
        bodies.append((float(moment), points[::-1] if head == "R" else points))
    return bodies


def _element_at(value: Any, k: int) -> Any:
    return value[k] if isinstance(value, list) else value


def _floats(values: Any) -> Floats:
    listed = values if isinstance(values, list) else [values]
    return np.array([np.nan if v is None else float(v) for v in listed])


def _resampled_bodies(bodies: list[Floats]) -> Floats:
    """Bodies (T, P, 2); bodies with different point counts are resampled to the largest."""
    counts = {len(points) for points in bodies}
    if len(counts) == 1:
        return np.stack(bodies)
    most = max(counts)
    even = np.full((len(bodies), most, 2), np.nan)
    for k, points in enumerate(bodies):
        if len(points) >= 4 and np.isfinite(points).all():
            even[k] = equal_arc_length(points, most - 1)
    return even


def _unit(file: Path, units: dict[str, Any], name: str, dimension: str) -> float | None:
    if not isinstance(units.get(name), str):
        raise InputError(f"{file}: units: {name} must be given, such as {dimension!r}")
    return si_value(units[name], dimension)
