"""Ratios of a comparison as a picture; importing this module imports matplotlib."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt

from snakewalk.config.colours import BLUE, INK, PALE, RED
from snakewalk.controller.figures.style import save_picture
from snakewalk.controller.validation.comparison import Compared
from snakewalk.controller.validation.measurement import NEAR

matplotlib.use("Agg")
_COLOURS = {"ok": BLUE, "reported": INK, "outside": RED, "failed": RED}


def draw_ratios(rows: Sequence[Compared], path: Path) -> None:
    """Draw the ratio of each row, with its stated range and the band that counts as near."""
    figure, panel = plt.subplots(figsize=(8.0, 0.22 * len(rows) + 1.2), layout="constrained")
    panel.axvspan(*NEAR, color=PALE)
    panel.axvline(1.0, color=INK, linewidth=0.8)
    for place, row in enumerate(rows):
        colour = _COLOURS[row.state]
        panel.plot(row.range, (place, place), color=colour, linewidth=0.8)
        marker = "o" if row.counts else "D"
        if row.simulated is not None:
            panel.plot(row.ratio, place, marker, color=colour, markersize=4)
    panel.set_yticks(range(len(rows)), [f"{row.file}: {row.row}" for row in rows], fontsize=7)
    panel.invert_yaxis()
    panel.set_xscale("log")
    panel.set_xlabel("simulated / measured; circles: measured, travelling, unfitted")
    save_picture(figure, path)
