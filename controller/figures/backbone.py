"""Picture of a chain that is laid on a curve."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, BLUE, HEAD, INK
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.gaits.backbone import BackboneFit


def draw_fit(fit: BackboneFit, curve_m: list[list[float]], robot: str, path: Path) -> None:
    """Draw curve and chain in space on the left, joint angles on the right."""
    points = np.array(curve_m)
    with style():
        figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained")
        space = figure.add_subplot(1, 2, 1, projection="3d")
        space.plot(*points.T, color=AMBER, linewidth=2.0, label="curve")
        space.plot(*fit.points_m.T, "o-", color=BLUE, markersize=3.5, label="chain")
        space.plot(*fit.points_m[:1].T, "o", color=HEAD, label="head")
        space.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        space.set_box_aspect(np.maximum(np.ptp(points, axis=0), 0.1 * np.ptp(points)))
        space.locator_params(nbins=4)
        space.legend(loc="upper left")
        angles = figure.add_subplot(1, 2, 2)
        angles.bar(np.arange(1, len(fit.joint_rad) + 1), fit.joint_rad, color=BLUE)
        angles.axhline(0.0, color=INK, linewidth=0.5)
        angles.set(xlabel="joint, from the head", ylabel="angle (rad)")
        title = f"{robot}: at most {1000.0 * fit.residual_m:.1f} mm from the curve"
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
        save_picture(figure, path, dpi=110)
