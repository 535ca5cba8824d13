"""Result of matching: the model over frames of the film, and the spine angles over time."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from snakewalk.config.colours import AMBER, HEAD, INK, SERIES, SKY
from snakewalk.controller.animals.fish.match_film import FilmMatch
from snakewalk.controller.animals.fish.postures import Postures
from snakewalk.controller.animals.fish.silhouettes import grey
from snakewalk.controller.console.result_files import check_picture
from snakewalk.controller.figures.style import WIDTH_IN, save_picture, style
from snakewalk.controller.images.video import open_footage

_PANELS = 6


def draw_match(
    file: Path,
    postures: Postures,
    true_postures: Postures | None,
    matched: FilmMatch | None,
    footage: Path,
) -> None:
    """Draw frames with the model's outline (of a film), and spine angles, dotted where known.

    Raises:
        InputError: the ending is not a picture's.

    """
    check_picture(file)
    with style():
        tall = (
            1.2 + (1.15 if postures.angles_rad.shape[1] < 6 else 0.8) * postures.angles_rad.shape[1]
        )
        figure = Figure(
            figsize=(WIDTH_IN, tall + (2.9 if matched else 0.0)), layout="constrained", dpi=110
        )
        if matched is None:
            bottom = figure
        else:
            top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=[2.9, tall])[:, 0]
            panels = top.subplots(2, _PANELS // 2, squeeze=False).ravel()
            _frames(list(panels), matched, footage)
        rows = bottom.subplots(
            postures.angles_rad.shape[1], 1, sharex=True, sharey=True, squeeze=False
        )
        _angles(list(rows[:, 0]), postures, true_postures)
        save_picture(figure, file)


def _frames(panels: list[Axes], matched: FilmMatch, footage: Path) -> None:
    """Crop frames to the fish; outline, spine, base of the head."""
    indices = np.flatnonzero(np.isfinite(matched.parameters[:, 2]))
    shown = indices[np.linspace(0, len(indices) - 1, min(len(panels), len(indices))).astype(int)]
    model = matched.model
    shown_frames = set(shown.tolist())
    reach = 0.7 * model.length_px
    images = (
        (k, image) for k, image in enumerate(open_footage(footage).shown()) if k in shown_frames
    )
    for axes, (k, image) in zip(panels, images, strict=False):
        parameters = matched.parameters[k]
        spine = model.midline(parameters[:2], float(parameters[2]), parameters[3:])
        outline = model.outline(spine)
        middle = spine[:, :2].mean(axis=0)
        axes.imshow(grey(image), cmap="gray", vmin=0, vmax=255)
        axes.fill(outline[:, 0], -outline[:, 1], fill=False, edgecolor=AMBER, linewidth=1.1)
        axes.plot(spine[:, 0], -spine[:, 1], color=SKY, linewidth=1.0)
        axes.plot(parameters[0], -parameters[1], "o", color=HEAD, markersize=3.5)
        axes.set_xlim(middle[0] - reach, middle[0] + reach)
        axes.set_ylim(-middle[1] + 0.5 * reach, -middle[1] - 0.5 * reach)
        axes.set_title(f"frame {k}")
        axes.set_axis_off()
    for axes in panels[len(shown) :]:
        axes.set_axis_off()


def _angles(rows: list[Axes], postures: Postures, true_postures: Postures | None) -> None:
    time = np.arange(postures.frames) / postures.rate_hz
    for k, axes in enumerate(rows):
        if true_postures is not None:
            axes.plot(
                time,
                np.degrees(true_postures.angles_rad[:, k]),
                color=INK,
                linewidth=2.6,
                alpha=0.28,
            )
        colour = SERIES[k % len(SERIES)]
        axes.plot(time, np.degrees(postures.angles_rad[:, k]), color=colour, linewidth=1.2)
        axes.set_ylabel(f"A{k} (deg)")
    rows[0].set_title(
        "spine angles"
        + (": matched (line) over known (grey band)" if true_postures is not None else "")
    )
    rows[-1].set_xlabel("time (s)")
