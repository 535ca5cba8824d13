"""Log to page: reads the log, writes ``summary.json`` and ``report.html`` beside each other."""

import json
from pathlib import Path

from snakewalk.config.extras import require_extra
from snakewalk.controller.app.report.film_on_page import film_html
from snakewalk.controller.app.report.page import Section, page
from snakewalk.controller.app.result_files import atomic_write
from snakewalk.controller.metrics.summary import Summary, summary
from snakewalk.controller.runlog.reader import read_log
from snakewalk.controller.runlog.record import RunRecord


def build_report(log_path: Path, out_dir: Path, film: Path | None = None) -> Path:
    """Make ``out_dir/report.html`` (returned) and ``out_dir/summary.json`` from a log alone.

    Raises:
        controller.runlog.reader.LogError: the log cannot be read.
        InputError: the film cannot be used, or matplotlib is not installed.

    """
    record = read_log(log_path)
    numbers = write_summary(record, out_dir)
    shown = "" if film is None else film_html(film, out_dir)
    header = record.header
    config = {
        "run": header.run.model_dump(mode="json"),
        "robot": header.robot.model_dump(mode="json"),
        "world": header.world.model_dump(mode="json"),
    }
    html = page(numbers, _sections(record), film=shown, events=record.events, config=config)
    path = out_dir / "report.html"
    with atomic_write(path) as part:
        part.write_text(html, encoding="utf-8")
    return path


def write_summary(record: RunRecord, out_dir: Path) -> Summary:
    """Write ``out_dir/summary.json`` and return the numbers; needs no matplotlib."""
    numbers = summary(record)
    text = json.dumps(numbers, indent=2, ensure_ascii=False, allow_nan=False)
    with atomic_write(out_dir / "summary.json") as part:
        part.write_text(text + "\n", encoding="utf-8")
    return numbers


def _sections(record: RunRecord) -> list[Section]:
    require_extra("the report needs", "matplotlib")
    from snakewalk.controller.app.report.figures.all import sections  # noqa: PLC0415  (an extra)

    return sections(record)
