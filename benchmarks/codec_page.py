"""Figures of the control cycle for the pages, from the benchmark's own rows.

``python -m benchmarks.codec_page`` runs ``benchmarks.cycle_codec``, writes the table of
``docs/benchmarks/control-cycle.md``, and replaces the rows of ``docs/measured.md``.
"""

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.cycle_codec import run
from benchmarks.provenance import PAGES, ROOT, provenance, write_tables
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


def table(lines: Sequence[Line]) -> str:
    """Markdown."""
    text = [
        "| cycle | CPU, us | of `dynamixel-sdk` | of `rustypot` | over the wire time |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for each in lines:
        sdk, rusty = (
            "" if value is None else f"{value:.2f}" for value in (each.of_sdk, each.of_rustypot)
        )
        text.append(
            f"| {each.what} | {each.cpu_us:.0f} | {sdk} | {rusty} | {100 * each.over_wire:.1f} % |"
        )
    return "\n".join(text)


def measured_rows(lines: Sequence[Line]) -> dict[str, str]:
    """Rows of ``docs/measured.md``, by how they begin."""
    ours = [each for each in lines if each.what.endswith(": cycle")]
    plain = [each for each in ours if "fast" not in each.what]
    fast = [each for each in ours if "fast" in each.what]
    rusty = [each for each in lines if each.what.endswith(": rustypot")]

    def span(values: Sequence[float | None], digits: int = 2) -> str:
        known = [each for each in values if each is not None]
        return f"{min(known):.{digits}f} to {max(known):.{digits}f}" if known else "not measured"

    def over(some: Sequence[Line]) -> str:
        return span([100 * each.over_wire for each in some], 1)

    source = f"`{COMMAND}` ([control cycle](benchmarks/control-cycle.md))"
    of_sdk = span([each.of_sdk for each in ours])
    of_plain, of_fast = (span([each.of_rustypot for each in some]) for some in (plain, fast))
    cpu = "| control cycle of 16 servos, CPU |"
    wire = "| the same, over the wire time |"
    return {
        cpu: (
            f"{cpu} {of_sdk} of `dynamixel-sdk`; {of_plain} of `rustypot` with sync reads, "
            f"{of_fast} with fast ones, at 1, 3 and 4 Mbaud | {source} |"
        ),
        wire: (
            f"{wire} {over(plain)} % with sync reads, {over(fast)} % with fast ones (aim: 6); "
            f"`rustypot` {over(rusty)} % | the same |"
        ),
    }


def main() -> None:
    """Measure, show, and write the pages."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument("--rows", type=Path, help="rows of an earlier run, as JSON")
    given = parser.parse_args()
    if given.rows is None:
        load = os.getloadavg()[0]
        lines = lines_of(run())
        head = f"{provenance(COMMAND)} Load average at the start: {load:.1f}."
    else:
        rows = json.loads(given.rows.read_text(encoding="utf-8"))["rows"]["cycle_codec"]
        keys = ("what", "value", "unit", "against", "ratio", "target")
        lines = lines_of([Row(**{key: each[key] for key in keys}) for each in rows])
        head = provenance(f"{COMMAND} --rows {given.rows.name}")
    text = f"{head}\n\n{table(lines)}"
    print(text)
    write_tables(PAGES / "control-cycle.md", "cycle", text)
    new = measured_rows(lines)
    page = [
        next((row for begin, row in new.items() if line.startswith(begin)), line)
        for line in MEASURED.read_text(encoding="utf-8").splitlines()
    ]
    MEASURED.write_text("\n".join(page) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
