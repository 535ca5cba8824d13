"""The page of all measurements: ``docs/validation.md``."""

from collections.abc import Sequence

from snakewalk.controller.validation.comparison import SHOWN, Compared, median_ratio
from snakewalk.controller.validation.measurement import PublishedResults

_HEAD = """# Comparison with reality

This page compares the simulator with published results. Each row repeats one result with the same
body, ground and motion, as far as the source states them. To add your robot, see
[add a measurement](how-to/add-a-measurement.md).

    snakewalk trials validate                  # all rows; exit code 1 if one leaves its range
    snakewalk trials validate lamprey --json
    snakewalk trials validate --page docs/validation.md --force

"""
_TERMS = """
- **Ratio**: simulated / measured.
- **State**: `ok` if the ratio is within 0.8 to 1.25. `reported` if it is within the `range` of its
  file only; the file then states the most likely cause. `outside` if it left this range. The range
  contains today's ratio; it is not a tolerance.

| kind | evidence |
| --- | --- |
| measured | a measurement; no constant of the simulator comes from this source |
| data sheet | a value of the manufacturer |
| published model | a value computed from the equations of a publication |
| held out | a measurement; constants come from other results of the same source |
| fitted | a measurement from which a constant comes |
"""
_LIMITS = """
## Limits of this comparison

- The crawler has hobby servos, and its friction was not measured. No row has a crawler with
  measured friction, so no row decides which law of friction holds.
- Each source has one robot or one animal.
- No row has joint angles that a DYNAMIXEL snake measured. The repository VanguardDream/snake_RL
  (GitHub) has logs of a robot with 14 servos, which is shipped as `horcrux14`. A row needs these
  columns: time (s), angle or goal of each joint (rad), x and y of the head or the centre (m). It
  needs once: supply (V), P gain, and the friction of the floor along and across, with its law.
- In water, neither added mass nor the wake of a link is simulated ([swimming](swimming.md)).
"""


def page_text(loaded: Sequence[tuple[str, PublishedResults]], rows: Sequence[Compared]) -> str:
    """Return the page with a section for each file."""
    ratio, count = median_ratio(rows)
    near = sum(row.state == "ok" for row in rows if row.counts)
    parts = [_HEAD]
    if count:
        parts.append(
            f"**The median ratio of the {count} measured rows is {ratio:.2f}.** They are rows of "
            f"bodies that travel, without fitted constants. {near} of them are within 0.8 to "
            f"1.25. All files have {len(rows)} rows.\n"
        )
    parts.append(_TERMS)
    for name, measurement in loaded:
        parts.append(_section(name, measurement, [row for row in rows if row.file == name]))
    return "".join([*parts, _LIMITS])


def _section(name: str, measurement: PublishedResults, rows: Sequence[Compared]) -> str:
    lines = [f"\n## {measurement.title[0].upper()}{measurement.title[1:]}"]
    near = [row for row in rows if row.kind == "data sheet" and row.state == "ok"]
    if near:
        ratios = sorted(map(ratio_text, near))
        lines.append(
            f"\n{len(near)} of {len(rows)} rows are values of data sheets with the state `ok` and "
            f"ratios of {ratios[0]} to {ratios[-1]}.\n`snakewalk trials validate {name}` prints "
            "each of them."
        )
    listed = [row for row in rows if row not in near]
    if listed:
        lines += [
            "\n| row | quantity | measured | simulated | ratio | kind | state |",
            "| --- | --- | ---: | ---: | ---: | --- | --- |",
        ]
    for row in listed:
        what = quantity_text(row)
        if row.over is not None:
            what += f" over that of `{row.over}`"
        values = [value_text(row, value) for value in (row.measured, row.simulated)]
        cells = (row.row, what, *values, ratio_text(row))
        lines.append(f"| {' | '.join(cells)} | {row.kind} | {row.state} |")
    lines.append(
        f"\n`config/measurements/{name}.toml`. Source: {measurement.source}. Licence: "
        f"{measurement.licence}.\n"
    )
    lines.append(f"- Measured: {measurement.method}. Uncertainty: {measurement.uncertainty}.")
    lines += [f"- Assumed: {text}." for text in measurement.assumed]
    causes: dict[str, list[str]] = {}
    for row in rows:
        if row.cause:
            causes.setdefault(row.cause, []).append(row.row)
    for cause, names in causes.items():
        of = "all" if len(names) == len(rows) else ", ".join(f"`{row_name}`" for row_name in names)
        lines.append(f"- Most likely cause: {cause}. Rows: {of}.")
    return "\n".join(lines) + "\n"


def quantity_text(row: Compared) -> str:
    """Return the name of a quantity with its unit; a quotient has no unit."""
    quantity, unit, _ = SHOWN[row.quantity]
    return f"{quantity}, {unit}" if unit and row.over is None else quantity


def value_text(row: Compared, value: float | None) -> str:
    """Return a value in the unit of its quantity, with three digits, or a dash."""
    if value is None:
        return "-"
    factor = 1.0 if row.over is not None else SHOWN[row.quantity][2]
    return f"{value * factor:.3g}"


def ratio_text(row: Compared) -> str:
    """Return the ratio with two digits behind the point, or a dash."""
    return "-" if row.simulated is None else f"{row.ratio:.2f}"
