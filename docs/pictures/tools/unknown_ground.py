"""Draw how the map of a run over unknown ground grew.

python docs/pictures/tools/unknown_ground.py runs/NAME docs/pictures/unknown-ground.png
"""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import read_map
from snakewalk.controller.runlog.reader import read_log

PANELS = 6


def main(folder: Path, file: Path) -> None:
    """Six moments: what was known, the path in force, the body and its way so far."""
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
    figure, axes = plt.subplots(2, 3, figsize=(9.6, 6.4), sharex=True, sharey=True)
    moments_s = np.linspace(pose.time_s[0], record.end_s, PANELS)
    for axis, time_s in zip(axes.flat, moments_s.tolist(), strict=True):
        axis.contour(x, y, true_m, 14, colors="0.82", linewidths=0.5)
        known = np.where(held.known & (first_s <= time_s), held.z_m, np.nan)
        axis.imshow(
            known, origin="lower", extent=(x[0], x[-1], y[0], y[-1]), cmap="terrain",
            vmin=true_m.min(), vmax=true_m.max(),
        )  # fmt: skip
        paths = [path for at_s, path in record.paths if at_s <= time_s]
        if paths:
            axis.plot(*paths[-1][:, :2].T, color="tab:blue", lw=1.2)
        at = int(np.searchsorted(pose.time_s, time_s, "right")) - 1
        axis.plot(*pose.centre_m[:at, :2].T, color="tab:red", lw=0.8)
        axis.plot(*pose.links_m[at, :, :2].T, color="black", lw=2.5)
        axis.plot(*waypoints.T, "^", color="tab:purple", ms=5)
        axis.set_title(f"{time_s:.0f} s", fontsize=9)
        axis.tick_params(labelsize=7)
    low, high = pose.links_m[..., :2].min(axis=(0, 1)), pose.links_m[..., :2].max(axis=(0, 1))
    axes[0, 0].set_xlim(max(low[0] - 1.5, x[0]), min(high[0] + 1.5, x[-1]))
    axes[0, 0].set_ylim(max(low[1] - 2.0, y[0]), min(high[1] + 2.0, y[-1]))
    figure.tight_layout()
    figure.savefig(file, dpi=75)
    Image.open(file).convert("RGB").quantize(128).save(file, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
