"""Writes the log row by row: a kill costs half a second at most, a disk fault stops the run."""

import logging
import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from mcap.writer import Writer
from numpy.typing import ArrayLike

from snakewalk.config.errors import InputError
from snakewalk.config.plain_text import plain
from snakewalk.controller.runlog.column import Table
from snakewalk.controller.runlog.record import Header
from snakewalk.controller.runlog.row_printer import RowPrinter
from snakewalk.controller.runlog.topics import (
    TABLES,
    ConfigTable,
    CycleTable,
    EventTable,
    ImuTable,
    PathTable,
    SlowTable,
    WaypointTable,
)
from snakewalk.drivers.types import JointState

Level = Literal["info", "warning", "error"]
_LOGGER = logging.getLogger("snakewalk")
_FLUSH_S = 0.5
_BATCH = 32
"""Rows printed together (ours): about ten cycles. A row in a batch costs a third of the time,
because the processor's caches forget the printing code between two cycles."""
_CHUNK_BYTES = 1 << 20


REPEATED = (ConfigTable, EventTable, PathTable, WaypointTable)
"""Tables whose newest row begins each part of a log; of events it is the start."""


@dataclass(frozen=True, slots=True)
class PartLimits:
    """Limits from which the next cycle begins a new part of a log."""

    size_mb: float = math.inf
    minutes: float = math.inf


ONE_PART = PartLimits()


class RunLog:
    """Log of one run, as a context manager: ``<path>.part``, renamed to ``path`` at the end.

    A log beyond ``limits`` continues in ``parts``, each of which can be read alone.
    Times must not be negative. Any method raises OSError if the disk does not accept the bytes.
    ``on_row`` gets the topic and the JSON of every row at once; without it the rows of fast topics
    are printed in batches, within ``_FLUSH_S``.
    """

    def __init__(
        self,
        path: Path,
        on_row: Callable[[str, bytes], None] | None = None,
        limits: PartLimits = ONE_PART,
    ) -> None:
        self.path = path
        """File of the part that is written."""
        self._paths = count_paths(path)
        self._on_row = on_row
        self._limits = limits
        self._repeated: dict[type[Table], tuple[float, bytes]] = {}
        self._has_config = self._has_cycles = False
        path.parent.mkdir(parents=True, exist_ok=True)
        self._open(0.0)

    def _open(self, time_s: float) -> None:
        self.path = next(self._paths)
        self._part = part_path(self.path)
        self._part_s = self._flushed_s = time_s
        self._file = self._part.open("w+b")
        try:
            self._begin()
        except BaseException:  # an interrupt: an empty log would be in the way of the next run
            self._file.close()
            self._part.unlink(missing_ok=True)
            raise

    def _begin(self) -> None:
        self._is_deleted = False
        self._writer: Any = Writer(  # half untyped
            self._file, chunk_size=_CHUNK_BYTES, enable_data_crcs=True
        )
        self._writer.start(profile="", library=f"snakewalk {version('snakewalk')}")
        self._channels: dict[type[Table], int] = {}
        self._printers: dict[type[Table], RowPrinter] = {}
        for table in TABLES:
            if not table.topic.is_optional:
                self._register(table)
        self._batch: list[tuple[type[Table], float, Mapping[str, Any] | bytes]] = []
        """Rows that are not written yet, of slow topics as they are printed."""
        self._last_rows: dict[type[Table], bytes] = {}
        """Newest row of each topic that holds only changes, without its time."""

    def _register(self, table: type[Table]) -> None:
        topic = table.topic
        schema = self._writer.register_schema(topic.schema_name, "jsonschema", topic.schema)
        self._channels[table] = self._writer.register_channel(topic.name, "json", schema)
        self._printers[table] = RowPrinter(topic)

    def __enter__(self) -> Self:
        """Start at once."""
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Finish the file also when the run ends with an error: the log says how it came to it.

        Nothing is left of a run that was refused before its first cycle, or that a signal ended
        before its configuration was written: nobody could read it. A log that the disk does
        not accept stays ``.part``, and the error names it.
        """
        try:
            self._finish()
        except OSError as fault:
            write_error = error if isinstance(error, OSError) else fault
            write_error.filename = write_error.filename or str(self._part)
            write_error.add_note(f"the run up to there: snakewalk log report {self._part}")
            if error is None:
                raise
            return
        is_refused = isinstance(error, InputError) and not self._has_cycles
        is_signal = isinstance(error, (KeyboardInterrupt, SystemExit))
        if is_refused or (is_signal and not self._has_config):
            self._part.unlink()
        else:
            self._part.replace(self.path)

    def _finish(self) -> None:
        try:
            self._write_batch()
            self._writer.finish()
            self._restore()
        finally:
            self._file.close()

    def _begin_part(self, time_s: float) -> None:
        """End the part of the log, and begin the next one with the rows that it needs."""
        self._finish()
        self._part.replace(self.path)
        self._open(time_s)
        self._batch = [(table, *row) for table, row in self._repeated.items()]

    def config(self, header: Header) -> None:
        """Log the configuration, once and first; the ground is thinned for reports."""
        self._write(ConfigTable, 0.0, header.row())
        self._has_config = True
        self._flush()

    def add(self, table: type[Table], time_s: float, **values: Any) -> None:
        """Log a row of a topic, by field; a field that has a default may be left out.

        Raises:
            TypeError: a required field is missing, or a value is not a field of the topic.

        """
        if table.topic.only_changes:
            now = b"".join([np.asarray(value).tobytes() for value in values.values()])
            if now == self._last_rows.get(table):
                return
            self._last_rows[table] = now
        values["time_s"] = time_s
        self._write(table, time_s, values)

    def cycle(
        self,
        time_s: float,
        asked_rad: ArrayLike,
        sent_rad: ArrayLike,
        state: JointState,
        **values: Any,
    ) -> None:
        """Log a control cycle with the readings of the servos and the IMU.

        ``values`` are the other fields of ``CycleTable``.
        """
        self._has_cycles = True
        if (
            time_s - self._part_s >= 60.0 * self._limits.minutes
            or self._file.tell() >= 1e6 * self._limits.size_mb
        ):
            self._begin_part(time_s)
        self.add(
            CycleTable,
            time_s,
            asked_rad=asked_rad,
            sent_rad=sent_rad,
            measured_rad=state.position_rad,
            velocity_rad_s=state.velocity_rad_s,
            current_a=state.current_a,
            age_s=state.age_s,
            valid=state.valid,
            error=state.error,
            **values,
        )
        self.add(
            SlowTable,
            time_s,
            temperature_c=state.temperature_c,
            voltage_v=state.voltage_v,
            hardware_error=state.hardware_error,
            stalled_s=state.stalled_s,
        )
        if state.imu is not None:
            imu = state.imu
            self.add(
                ImuTable, time_s, rotation=imu.rotation, rate_rad_s=imu.rate_rad_s, age_s=imu.age_s
            )

    def event(self, time_s: float, kind: str, text: str, level: Level = "info") -> None:
        """Log an event; above ``info`` it is on the disk when this returns."""
        self.add(EventTable, time_s, level=level, kind=kind, text=plain(text))
        if level != "info":
            self._flush()

    def _write(self, table: type[Table], time_s: float, row: Mapping[str, Any]) -> None:
        if table not in self._channels:
            self._register(table)
        if table.topic.is_fast and self._on_row is None:
            self._batch.append((table, time_s, _stored_fields(row)))
        else:
            data = self._printers[table].row(row).encode()
            self._batch.append((table, time_s, data))
            if table in REPEATED and row.get("kind", "start") == "start":
                self._repeated[table] = time_s, data
            if self._on_row is not None:
                self._on_row(table.topic.name, data)
        if time_s - self._flushed_s >= _FLUSH_S:
            self._flushed_s = time_s
            self._flush()
            self._report_deletion()
        elif len(self._batch) >= _BATCH:
            self._write_batch()

    def _flush(self) -> None:
        self._write_batch()
        self._writer.flush()

    def _write_batch(self) -> None:
        batch = self._batch
        self._batch = []
        for table, time_s, row in batch:
            data = row if isinstance(row, bytes) else self._printers[table].row(row).encode()
            stamp_ns = round(time_s * 1e9)
            self._writer.add_message(self._channels[table], stamp_ns, data, publish_time=stamp_ns)

    def _report_deletion(self) -> None:
        """Warn once if the file lost its name, because it or its folder was deleted or moved."""
        if self._is_deleted or self._has_its_name():
            return
        self._is_deleted = True
        how = "moved" if os.fstat(self._file.fileno()).st_nlink > 0 else "deleted"
        _LOGGER.warning(
            "%s: was %s during the run; it is kept open, and written again at the end",
            self._part,
            how,
        )

    def _has_its_name(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self._part.stat())
        except OSError:
            return False

    def _restore(self) -> None:
        """Write a file that was deleted or moved meanwhile again, from its descriptor.

        Raises:
            OSError: the disk is full.

        """
        if self._has_its_name():
            return
        self._part.parent.mkdir(parents=True, exist_ok=True)
        self._file.flush()
        self._file.seek(0)
        with self._part.open("wb") as copy:
            shutil.copyfileobj(self._file, copy)


def _stored_fields(row: Mapping[str, Any]) -> Mapping[str, Any]:
    return {
        name: value.copy() if isinstance(value, np.ndarray) and value.flags.writeable else value
        for name, value in row.items()
    }


def count_paths(log: Path) -> Iterator[Path]:
    """Yield the path of a log, and of its next parts, without an end."""
    yield log
    for number in count(2):
        yield log.with_name(f"{log.stem}.part{number}{log.suffix}")


def part_path(path: Path) -> Path:
    """Where a log is while it is being written, and stays when the run is killed."""
    return path.with_name(path.name + ".part")
