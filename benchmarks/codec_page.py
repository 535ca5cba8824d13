"""Figures of the control cycle for the pages, from the benchmark's own rows.

``python -m benchmarks.codec_page`` runs ``benchmarks.cycle_codec``, writes the table of
``docs/driver.md``, and replaces the rows of ``docs/measured.md``.
"""

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.cycle_codec import run
from benchmarks.provenance import ROOT, provenance, write_tables
from benchmarks.rows import Row

COMMAND = "python -m benchmarks.codec_page"
MEASURED = ROOT / "docs" / "measured.md"


@dataclass(frozen=True)
class Line:
    """One way to make a cycle, at one baud rate."""

    what: str
    cpu_us: float
    of_sdk: float | None
    of_rustypot: float | None
    over_wire: float


CALLS = 3
"""How often the benchmark runs; two calls of the same code differ (docs/benchmarks)."""


def lines_of(rows: Sequence[Row]) -> list[Line]:
    """Rows of the benchmark, one line for each way."""
    found = []
    for k, row in enumerate(rows):
        if row.unit != "us" or row.what.startswith(" ") or "Mbaud" not in row.what:
            continue
        end = next((j for j in range(k + 1, len(rows)) if not rows[j].what.startswith(" ")), None)
        rest = rows[k + 1 : end]
        rusty = [each.ratio for each in rest if each.against == "rustypot"]
        (wire,) = [each.ratio for each in rest if each.against == "wire time"]
        sdk = row.ratio if row.against == "dynamixel-sdk" else None
        found.append(Line(row.what, row.value, sdk, rusty[0] if rusty else None, wire - 1.0))
    return found


def span(values: Sequence[float | None], digits: int = 2, empty: str = "not measured") -> str:
    """Least and greatest of the known values, or ``empty``."""
    known = [each for each in values if each is not None]
    if not known:
        return empty
    low, high = (f"{value:.{digits}f}" for value in (min(known), max(known)))
    return low if low == high else f"{low} to {high}"


def table(lines: Sequence[Line]) -> str:
    """Markdown; a way of several calls is one row with its ranges."""
    text = [
        "| cycle | CPU, us | of `dynamixel-sdk` | of `rustypot` | over the wire time |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for what in dict.fromkeys(each.what for each in lines):
        some = [each for each in lines if each.what == what]
        cells = (
            span([each.cpu_us for each in some], 0),
            span([each.of_sdk for each in some], empty=""),
            span([each.of_rustypot for each in some], empty=""),
            span([100 * each.over_wire for each in some], 1) + " %",
        )
        text.append(f"| {what} | {' | '.join(cells)} |")
    return "\n".join(text)


QUIET_LOAD = 1.5
"""Load average up to which wall times say something about the programs (ours)."""


def measured_rows(lines: Sequence[Line], *, is_quiet: bool) -> dict[str, str]:
    """Rows of ``docs/measured.md``, by how they begin; wall times need a quiet machine."""
    ours = [each for each in lines if each.what.endswith(": cycle")]
    plain = [each for each in ours if "fast" not in each.what]
    fast = [each for each in ours if "fast" in each.what]
    rusty = [each for each in lines if each.what.endswith(": rustypot")]

    def over(some: Sequence[Line]) -> str:
        return span([100 * each.over_wire for each in some], 1)

    source = f"`{COMMAND}` ([control cycle](driver.md#cpu-time-of-a-cycle))"
    of_sdk = span([each.of_sdk for each in ours])
    of_plain, of_fast = (span([each.of_rustypot for each in some]) for some in (plain, fast))
    cpu = "| control cycle of 16 servos, CPU |"
    wire = "| the same, over the wire time |"
    times = (
        f"{over(plain)} % with sync reads, {over(fast)} % with fast ones (aim: 6); `rustypot` "
        f"{over(rusty)} %"
    )
    return {
        cpu: (
            f"{cpu} {of_sdk} of `dynamixel-sdk`; {of_plain} of `rustypot` with sync reads, "
            f"{of_fast} with fast ones, at 1, 3 and 4 Mbaud | {source} |"
        ),
        wire: f"{wire} {times if is_quiet else 'not measured on a quiet machine'} | the same |",
    }


def main() -> None:
    """Measure, show, and write the pages."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument("--rows", type=Path, help="rows of an earlier run, as JSON")
    parser.add_argument("--calls", type=int, default=CALLS, help="default: %(default)s")
    given = parser.parse_args()
    load = 0.0
    if given.rows is None:
        load = os.getloadavg()[0]
        lines = [each for _ in range(given.calls) for each in lines_of(run())]
        head = f"{provenance(COMMAND)} Calls: {given.calls}. Load average at the start: {load:.1f}."
    else:
        rows = json.loads(given.rows.read_text(encoding="utf-8"))["rows"]["cycle_codec"]
        keys = ("what", "value", "unit", "against", "ratio", "target")
        lines = lines_of([Row(**{key: each[key] for key in keys}) for each in rows])
        head = provenance(f"{COMMAND} --rows {given.rows.name}")
    text = f"{head}\n\n{table(lines)}"
    print(text)
    write_tables("driver", "cycle", text)
    new = measured_rows(lines, is_quiet=load <= QUIET_LOAD)
    page = [
        next((row for begin, row in new.items() if line.startswith(begin)), line)
        for line in MEASURED.read_text(encoding="utf-8").splitlines()
    ]
    MEASURED.write_text("\n".join(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
