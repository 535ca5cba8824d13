"""A long log made by repeating a short one."""

import json
from pathlib import Path
from typing import Any, Final

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from snakewalk.controller.runlog import tables

_ONCE: Final = ("/config", "/path", "/waypoints", "/event")
_TOTALS: Final = ("electrical_j", "mechanical_j", "charge_ah")
_TIMES: Final = ("time_s", "deadline_s", "arrival_s")


def repeat_log(source: Path, target: Path, times: int, chunk_bytes: int = 1 << 20) -> Path:
    """Write ``source`` several times into ``target``: times and totals go on, events come once.

    The cycles have equal distances also between two repetitions. The body jumps there, so a
    replay on the simulator differs from the second repetition on.
    """
    with source.open("rb") as file:
        reader = make_reader(file)
        messages = [
            (schema, channel, json.loads(message.data), message.data.decode())
            for schema, channel, message in reader.iter_messages()
            if schema is not None
        ]
    stops = [m for m in messages if m[1].topic == "/event" and m[2]["kind"] == "stop"]
    starts = [m for m in messages if m[1].topic in _ONCE and m not in stops]
    rows = [m for m in messages if m[1].topic not in _ONCE]
    deadlines_s = [row["deadline_s"] for _, channel, row, _ in rows if channel.topic == "/cycle"]
    period_s = deadlines_s[-1] - deadlines_s[0] + deadlines_s[1] - deadlines_s[0]
    totals = {
        name: max([row[name] for _, _, row, _ in rows if row.get(name) is not None], default=0.0)
        for name in _TOTALS
    }
    channels: dict[str, int] = {}
    with target.open("wb") as out:
        writer: Any = Writer(out, chunk_size=chunk_bytes, enable_data_crcs=True)
        writer.start(profile="", library="snakewalk")

        def write(message: tuple[Any, Any, dict[str, Any], str], count: int) -> None:
            schema, channel, row, text = message
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "json", number)
            moved = dict.fromkeys(_TIMES, count * period_s)
            moved |= {name: count * total for name, total in totals.items()}
            for name, added in moved.items():
                if count and row.get(name) is not None:
                    before = text[text.index(f'"{name}":') :].split(",", 1)[0].rstrip("}")
                    text = text.replace(before, f'"{name}":{row[name] + added:.6f}', 1)
            stamp_ns = round((row.get("time_s", 0.0) + count * period_s) * 1e9)
            writer.add_message(channels[channel.topic], stamp_ns, text.encode(), stamp_ns)

        for message in starts:
            write(message, 0)
        for count in range(times):
            for message in rows:
                write(message, count)
        for message in stops:
            write(message, times - 1)
        writer.finish()
    return target


def pack_early(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    """Turn each few rows of a log into arrays, and four times as many into files."""
    monkeypatch.setattr(tables, "ROWS", rows)
