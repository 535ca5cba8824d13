"""Draw how the map of a run over unknown ground grew.

python docs/pictures/tools/unknown_ground.py runs/NAME docs/pictures/unknown-ground.png
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from snakewalk.config.colours import CENTRE, PALE, PATH, PURPLE, TO_COME
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import read_map
from snakewalk.controller.figures.style import GROUND, WIDTH_IN, style
from snakewalk.controller.runlog.reader import read_log

PANELS = 6


def main(folder: Path, file: Path) -> None:
    """Six moments: what was known, the path in force, the body and its track so far."""
    record = read_log(folder / "log.mcap")
    held = read_map(folder / "map.npz")
    with np.load(folder / "map.npz") as arrays:
        first_s = arrays["first_s"]
    true = build_ground(record.header.world)
    assert true is not None
    rows, columns = held.z_m.shape
    x = held.x0_m + held.spacing_m * np.arange(columns)
    y = held.y0_m + held.spacing_m * np.arange(rows)
    true_m = true.elevation_m(*np.meshgrid(x, y))
    pose, waypoints = record.pose, np.array(record.header.run.waypoints_m)
    low, high = pose.links_m[..., :2].min(axis=(0, 1)), pose.links_m[..., :2].max(axis=(0, 1))
    with style():
        figure = Figure(figsize=(WIDTH_IN, 4.9), layout="constrained")
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        moments_s = np.linspace(pose.time_s[0], record.end_s, PANELS)
        for axis, time_s in zip(axes.flat, moments_s.tolist(), strict=True):
            axis.contour(x, y, true_m, 10, colors=PALE, linewidths=0.6)
            known = np.where(held.known & (first_s <= time_s), held.z_m, np.nan)
            image = axis.imshow(
                known, origin="lower", extent=(x[0], x[-1], y[0], y[-1]), cmap=GROUND,
                vmin=true_m.min(), vmax=true_m.max(),
            )  # fmt: skip
            paths = [path for at_s, path in record.paths if at_s <= time_s]
            if paths:
                axis.plot(*paths[-1][:, :2].T, color=PATH, lw=1.2, ls="--", label="path in force")
            at = int(np.searchsorted(pose.time_s, time_s, "right")) - 1
            axis.plot(*pose.centre_m[:at, :2].T, color=CENTRE, lw=1.2, label="centre of mass")
            axis.plot(*pose.links_m[at, :, :2].T, color=PURPLE, lw=3.0, label="body")
            axis.plot(*waypoints.T, "^", color=TO_COME, ms=6, label="waypoints")
            axis.set_title(f"{time_s:.0f} s")
            axis.set_aspect("equal")
            axis.grid(visible=False)
        axes[0, 0].set_xlim(max(low[0] - 1.0, x[0]), min(high[0] + 1.0, x[-1]))
        axes[0, 0].set_ylim(max(low[1] - 1.0, y[0]), min(high[1] + 1.0, y[-1]))
        for axis in axes[:, 0]:
            axis.set_ylabel("y (m)")
        for axis in axes[1]:
            axis.set_xlabel("x (m)")
        figure.colorbar(image, ax=list(axes[:, -1]), aspect=30, label="height seen so far (m)")
        handles, labels = axes[1, 2].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4)
        figure.savefig(file, dpi=100)
    Image.open(file).convert("RGB").quantize(128).save(file, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
