"""``python -m benchmarks [NAME ...] [--json FILE]``: run all benchmarks, or some, and show them."""

import argparse
import json
import math
import platform
import sys
from dataclasses import asdict
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.rows import Row

MODULES = tuple(
    name
    for name in (
        "hil_loop",
        "bus_faults",
        "bellies",
        "step_length",
        "cycle_codec",
        "frames",
        "walk_step",
        "joins",
        "capture",
        "overhead",
        "disturbed_views",
        "hard_views",
        "camera_run",
        "repertoire",
        "support",
        "gym_steps",
        "startup",
        "run_path",
        "replanning",
        "busy_calibrations",
        "light_install",
        "equal_chords",
    )
    if find_spec(f"benchmarks.{name}") is not None
)


def main() -> int:
    """Run; 1 if a target is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(MODULES)}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows there, too")
    given = parser.parse_args()
    unknown = [name for name in given.names if name not in MODULES]
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(MODULES)}")
    console, errors = Console(), Console(stderr=True)
    found: dict[str, list[Row]] = {}
    for name in given.names or MODULES:
        with errors.status(f"{name} ..."):
            module = import_module(f"benchmarks.{name}")
            found[name] = module.run()
        console.print(table(module.TITLE, found[name]))
    if given.json is not None:
        content = {
            "python": platform.python_version(),
            "machine": platform.machine(),
            "rows": {name: [plain(row) for row in rows] for name, rows in found.items()},
        }
        given.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return int(any(row.met is False for rows in found.values() for row in rows))


def table(title: str, rows: list[Row]) -> Table:
    """Rows as a table."""
    shown = Table(
        title=title, title_justify="left", title_style="bold", box=None, pad_edge=False,
        padding=(0, 1, 0, 0),
    )  # fmt: skip
    shown.add_column("")
    shown.add_column("value", justify="right")
    shown.add_column("unit")
    shown.add_column("ratio", justify="right")
    shown.add_column("to")
    shown.add_column("target", justify="right")
    for row in rows:
        colour = {None: "", True: "green", False: "red"}[row.met]
        ratio = f"{row.ratio:.3g}" if math.isfinite(row.ratio) else ""
        shown.add_row(
            row.what,
            f"{row.value:.4g}",
            row.unit,
            f"[{colour}]{ratio}[/]" if colour else ratio,
            row.against,
            "" if row.target is None else f"<= {row.target:g}",
        )
    return shown


def plain(row: Row) -> dict[str, object]:
    """A row for JSON, which knows no NaN."""
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in asdict(row).items()
    } | {"met": row.met}


if __name__ == "__main__":
    sys.exit(main())
