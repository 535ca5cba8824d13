"""Trials as a picture: a cell a case, its colour the share of complete runs, with the causes."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.patches import Rectangle

from snakewalk.config.colours import BLUE, INK, PALE, RED
from snakewalk.controller.figures.style import save_picture
from snakewalk.controller.studies.trials import CaseSummary

matplotlib.use("Agg")

_SHARE = LinearSegmentedColormap.from_list("share", [RED, "#f7f2e4", BLUE])
_BRIGHT = 0.5
"""Brightness of a cell from which its text is dark (ours)."""
_CAUSES = 3
"""Largest number of lines about causes in a cell."""


def draw_trials(rows: Sequence[CaseSummary], path: Path) -> None:
    """Draw a map over the first two varied quantities of the cases; a panel for all the rest.

    Keys come first, then relief, world, robot, motion and run.
    """
    cells = [_place(row) for row in rows]
    names = [name for name in cells[0] if len({cell[name] for cell in cells}) > 1]
    values = {name: list(dict.fromkeys(cell[name] for cell in cells)) for name in names}
    across = names[:1]
    up = names[1:2]
    rest = names[2:]
    panels = list(product(*(values[name] for name in rest)))
    columns, lines = (len(values[a[0]]) if a else 1 for a in (across, up))
    wide = min(len(panels), max(1, 8 // columns))
    figure, axes = plt.subplots(
        -(-len(panels) // wide),
        wide,
        figsize=(wide * (1.25 * columns + 1.2), -(-len(panels) // wide) * (0.8 * lines + 1.1)),
        squeeze=False,
        layout="constrained",
    )
    same = [f"{name} {value}" for name, value in cells[0].items() if value and name not in names]
    figure.suptitle("\n".join(["complete runs", *same]), x=0.0, ha="left", fontsize=10, color=INK)
    for panel in axes.flat[len(panels) :]:
        panel.axis("off")
    for panel, fixed in zip(axes.flat, panels, strict=False):
        some = [
            (row, cell)
            for row, cell in zip(rows, cells, strict=True)
            if tuple(cell[name] for name in rest) == fixed
        ]
        for row, cell in some:
            x, y = (values[a[0]].index(cell[a[0]]) if a else 0 for a in (across, up))
            _draw_cell(panel, x, y, row)
        panel.set_xlim(-0.5, columns - 0.5)
        panel.set_ylim(-0.5, lines - 0.5)
        panel.set_xticks(range(columns), values[across[0]] if across else [""])
        panel.set_yticks(range(lines), values[up[0]] if up else [""])
        panel.set_xlabel(_label(across))
        panel.set_ylabel(_label(up))
        panel.set_title("  ".join(fixed), fontsize=10, loc="left", color=INK)
        panel.tick_params(length=0, labelsize=9)
        panel.spines[:].set_visible(False)
    save_picture(figure, path, dpi=110)
    plt.close(figure)


def _place(row: CaseSummary) -> dict[str, str]:
    keys = {key: str(value) for key, value in row.keys.items()}
    fixed_keys = {"relief": f"{row.relief:g}", "world": row.world, "robot": row.robot}
    return keys | fixed_keys | {"motion": row.motion, "run": row.run}


def _label(names: list[str]) -> str:
    return names[0].replace("world.", "") if names else ""


def _shown_causes(row: CaseSummary) -> list[tuple[str, int]]:
    """Return the most frequent causes, and how many runs failed for all others."""
    causes = list(row.causes.items())
    if len(causes) <= _CAUSES:
        return causes
    shown = causes[: _CAUSES - 1]
    return [*shown, ("other", sum(row.causes.values()) - sum(count for _, count in shown))]


def _draw_cell(panel: Axes, x: int, y: int, row: CaseSummary) -> None:
    complete = row.runs - sum(row.causes.values())
    share = complete / row.runs if row.runs else 0.0
    colour = _SHARE(share) if row.runs else PALE
    panel.add_patch(Rectangle((x - 0.48, y - 0.48), 0.96, 0.96, color=colour, linewidth=0))
    red, green, blue, _ = to_rgba(colour)
    ink = INK if 0.3 * red + 0.59 * green + 0.11 * blue > _BRIGHT else "white"
    causes = [f"{count} {cause}" for cause, count in _shown_causes(row)]
    panel.text(
        x,
        y + 0.3,
        f"{complete} of {row.runs}",
        ha="center",
        va="center",
        fontsize=9,
        fontweight="bold",
        color=ink,
    )
    panel.text(x, y + 0.12, "\n".join(causes), ha="center", va="top", fontsize=8.5, color=ink)
