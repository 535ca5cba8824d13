"""Draw what the overhead camera sees, as docs/overhead-camera.md shows it."""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from snakewalk.config.camera import CameraConfig
from snakewalk.config.colours import SKY, TO_COME
from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.cameras.pose_fit import fit_both_ends
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.rendering.top_view import TopView


def main(file: Path) -> None:
    """Frame, silhouette, and links fitted to the seen axis."""
    robot, world, camera = load_robot("yaw16"), load_world("flat"), CameraConfig()
    view = TopView(robot, world, camera, (0.0, 0.0))
    model = CameraModel.straight_down(camera, (0.0, 0.0))
    detector = OverheadDetector(model, view.empty_floor(), robot.body_radius_m, camera.shade)
    plant = MujocoPlant(robot, world)
    plant.reset((0.9, 0.3), 0.4, 0.45 * np.sin(0.5 + 0.55 * np.arange(robot.joint_count)))
    image = view.picture(plant.qpos)
    view.close()
    shape, line_m = detector.detect_px(image).silhouette, detector.detect(image, 0.0).line_m
    fits = fit_both_ends(robot, line_m, plant.position_rad)
    fit = min(fits, key=lambda one: one.error_m)
    links = model.in_image(fit.links_m, robot.body_radius_m)
    line = model.in_image(line_m, robot.body_radius_m)
    left, top = line.min(axis=0) - 15
    right, bottom = line.max(axis=0) + 15
    with style():
        figure = Figure(figsize=(WIDTH_IN, 2.9), layout="constrained")
        whole, cut, fitted = figure.subplots(1, 3)
        whole.imshow(image)
        whole.set_title("frame")
        cut.imshow(shape.level, cmap="gray")
        cut.contour(shape.level, [shape.threshold], colors=TO_COME, linewidths=1.0)
        cut.set_title("contrast, silhouette")
        fitted.imshow(image)
        fitted.plot(*line.T, "-", color="white", linewidth=1.0, label="visible axis")
        fitted.plot(*links.T, "o", color=SKY, markersize=4, label="fitted links")
        fitted.plot(*links[0], "o", color=TO_COME, markersize=7, label="head")
        fitted.set(xlim=(left, right), ylim=(bottom, top))
        off_mm = 1e3 * np.hypot(*(fit.links_m - plant.link_positions_m[:, :2]).T).mean()
        fitted.set_title(f"links, off by {off_mm:.1f} mm")
        whole.set_ylabel("y (px)")
        for axes in (whole, cut, fitted):
            axes.set_xlabel("x (px)")
            axes.grid(visible=False)
        figure.legend(
            *fitted.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=3,
            frameon=True,
            facecolor="0.6",
        )
        save_picture(figure, file)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("picture", type=Path, help=".png or .jpg")
    main(options.parse_args().picture)
