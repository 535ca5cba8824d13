"""The file of a run's summary."""

import json
from pathlib import Path

from snakewalk.controller.console.result_files import SUMMARY, atomic_write
from snakewalk.controller.metrics.summary import RunSummary


def write_summary(numbers: RunSummary, out_dir: Path) -> RunSummary:
    """Write ``out_dir/summary.json`` and return the numbers; needs no matplotlib."""
    text = json.dumps(numbers.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    with atomic_write(out_dir / SUMMARY) as part:
        part.write_text(text + "\n", encoding="utf-8")
    return numbers
