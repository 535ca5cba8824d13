"""Faults of a figure: axes without labels, cut or small text, rainbows."""

from typing import Final

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.text import Text

READ_AT_PX: Final = 600.0
"""Width at which a figure must be legible."""
LEAST_TEXT_PX: Final = 8.0
"""Least size of text at that width."""
RAINBOWS: Final = frozenset(
    {"jet", "rainbow", "gist_rainbow", "hsv", "nipy_spectral", "gist_ncar", "turbo", "terrain"}
)


def figure_faults(figure: Figure) -> list[str]:
    """Return a sentence for each fault of a figure that has been drawn."""
    figure.draw_without_rendering()  # a file may have another resolution
    faults = []
    for axes in figure.findobj(Axes):
        if axes.get_visible() and axes.axison and axes.name != "3d":
            faults += _axis_faults(axes)
            texts = [axes.title, axes._left_title, axes.xaxis.label, axes.yaxis.label, *axes.texts]
            faults += [fault for text in texts for fault in _text_faults(figure, text)]
    for part in figure.findobj(lambda artist: isinstance(artist, ScalarMappable)):
        name = part.get_cmap().name.removesuffix("_r")
        faults += [f"colours {name}: a rainbow"] if name in RAINBOWS else []
    for legend in (*figure.legends, *(one for axes in figure.axes if (one := axes.get_legend()))):
        for text in legend.get_texts():
            faults += _text_faults(figure, text)
    return list(dict.fromkeys(faults))


def _axis_faults(axes: Axes) -> list[str]:
    """Return which axes with numbers have no label, neither their own nor that of a shared axis."""
    if axes.get_label() == "<colorbar>":
        is_labelled = bool(axes.get_ylabel() or axes.get_xlabel())
        return [] if is_labelled else ["a colour bar has no label"]
    faults = []
    for which in ("x", "y"):
        axis = getattr(axes, f"{which}axis")
        shared = getattr(axes, f"get_shared_{which}_axes")().get_siblings(axes)
        labels = [getattr(one, f"get_{which}label")() for one in shared]
        if not any(labels) and any(_is_number(text) for text in axis.get_ticklabels()):
            faults.append(f"panel {axes.get_title('left')!r}: {which} axis has no label")
    return faults


def _is_number(text: Text) -> bool:
    return text.get_text().replace("−", "").replace(".", "").isdigit()


def _text_faults(figure: Figure, text: Text) -> list[str]:
    words = text.get_text().strip()
    if not words or not text.get_visible():
        return []
    faults = []
    size_px = text.get_fontsize() * READ_AT_PX / (72.0 * figure.get_figwidth())
    if size_px < LEAST_TEXT_PX:
        faults.append(f"{words!r}: {size_px:.1f} px high at a width of {READ_AT_PX:.0f} px")
    box, whole = text.get_window_extent(), figure.bbox
    slack = 0.01 * whole.width
    if (
        box.x0 < whole.x0 - slack
        or box.x1 > whole.x1 + slack
        or box.y0 < whole.y0 - slack
        or box.y1 > whole.y1 + slack
    ):
        faults.append(f"{words!r}: outside the figure")
    return faults
