"""Draw a rendered picture of hills and its disparities.

python docs/pictures/tools/stereo_pair.py docs/pictures/stereo-pair.jpg
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.mapping.disparity import match
from snakewalk.sim.rendering.stereo_view import StereoView

HEIGHT_M, TILT_RAD = 0.5, 0.55
COUNT = 160


def main(file: Path) -> None:
    """Draw the left picture, and the disparities of its pixels; unknown ones are grey."""
    robot, world = load_robot("alternating16"), load_world("jacksboro-basin")
    ground = build_ground(world)
    assert ground is not None
    lens_m = float(ground.elevation_m(0.0, 0.0)) + HEIGHT_M
    view = StereoView(robot, world, ground, focal_px=500.0, baseline_m=0.1, seed=0)
    left, right = view.pictures((0.0, 0.0, lens_m), 0.0, TILT_RAD)
    view.close()
    found = match(left, right, COUNT)
    high, wide = found.shape
    with style():
        figure = Figure(figsize=(WIDTH_IN, 3.1), layout="constrained")
        seen, known = figure.subplots(1, 2, sharey=True)
        seen.imshow(left)
        seen.set_title("left picture")
        known.set_facecolor("0.75")
        drawn = known.imshow(found, cmap="cividis", interpolation="nearest")
        known.set_title(f"disparity; grey: unknown ({np.isnan(found).mean():.0%})")
        seen.set_ylabel("y (px)")
        for axes in (seen, known):
            axes.set(xlim=(0, wide), ylim=(high, 0), xlabel="x (px)")
            axes.grid(visible=False)
        figure.colorbar(drawn, ax=known, label="px")
        save_picture(figure, file)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
