"""How well a posture explains a frame: [TH] Eq. 1-3, on areas and on Canny edges."""

from dataclasses import dataclass

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Floats, Image, Singles
from snakewalk.controller.animals.fish.raster import Window, draw_area, draw_edge, draw_pieces

EDGE_WEIGHT = 0.3
"""Weight W of the edges in Eq. 3."""
LEAST_VALUE = 0.3
"""A posture of a smaller V explains nothing: the fish is lost."""


def agreement(drawn: Image, observed: Image) -> float:
    """Eq. 1 and 2: ``(f(P and S) - f(P xor S)) / f(P)``; 1 for the same area, below it otherwise.

    With shaded pixels the smaller of two values is their AND, and the difference is their XOR. So
    ``f(P xor S) = f(P) + f(S) - 2 f(P and S)`` as for plain ones. -inf if nothing was drawn.
    """
    area = float(cv2.sumElems(drawn)[0])
    if area <= 0.0:
        return float("-inf")
    both = float(cv2.sumElems(cv2.min(drawn, observed))[0])
    return (3.0 * both - area - float(cv2.sumElems(observed)[0])) / area


@dataclass(frozen=True, slots=True)
class SilhouetteFrame:
    """One frame of one camera."""

    grey: Image
    """(H, W) grey image as filmed."""
    mask: Bools
    """(H, W) where the fish differs from the background."""
    reason: str = ""
    """Why the frame cannot be used; empty for a good one."""


class Target:
    """One frame at one size, against which postures are scored."""

    def __init__(self, frame: SilhouetteFrame, window: Window, blur_px: int) -> None:
        """Reduce the frame.

        Args:
            frame: grey picture and silhouette.
            window: which part, how small.
            blur_px: width of edges on the canvas; wide ones are found from further away.

        """
        self.window = window
        self._thickness = blur_px
        mask = frame.mask.astype(np.uint8) * 255
        self._area = window.crop(mask)
        self._edge = _edges(window.crop(frame.grey), self._area, blur_px)
        self._canvas = np.zeros(window.shape, dtype=np.uint8)
        self.soft_area = self._soften(self._area)

    def area(self, outline_px: Floats) -> float:
        """J of an outline (n, 2), Eq. 1."""
        draw_area(self._canvas, self.window, outline_px)
        return agreement(self._canvas, self._area)

    def edge(self, outline_px: Floats) -> float:
        """K of an outline (n, 2), Eq. 2; 0 in a frame without edges."""
        if self._edge is None:
            return 0.0
        draw_edge(self._canvas, self.window, outline_px, self._thickness)
        return agreement(self._canvas, self._edge)

    def value(self, outline_px: Floats, weight: float = EDGE_WEIGHT) -> float:
        """V = J + W K, Eq. 3."""
        return self.area(outline_px) + weight * self.edge(outline_px)

    def soft(self, outline_px: Floats) -> Singles:
        """Area of an outline, blurred as ``soft_area`` is."""
        draw_area(self._canvas, self.window, outline_px)
        return self._soften(self._canvas)

    def _soften(self, area: Image) -> Singles:
        width = 2 * self._thickness + 1
        blurred = cv2.blur(area, (width, width))
        return np.asarray(blurred, dtype=np.float32) * np.float32(1.0 / 255.0)

    def value_of_pieces(self, pieces_px: list[Floats]) -> float:
        """V of convex pieces that overlap: the rim of their union is the outline."""
        draw_pieces(self._canvas, self.window, pieces_px)
        area = agreement(self._canvas, self._area)
        if self._edge is None or area == float("-inf"):
            return area
        near = np.ones((self._thickness, self._thickness), dtype=np.uint8)
        rim = cv2.subtract(cv2.dilate(self._canvas, near), cv2.erode(self._canvas, near))
        return area + EDGE_WEIGHT * agreement(np.asarray(rim, dtype=np.uint8), self._edge)


def _edges(grey: Image, area: Image, width_px: int) -> Image | None:
    """Canny edges near the silhouette's rim, ``width_px`` wide; None without edges.

    Thresholds come from the contrast between fish and surroundings. Only edges near the rim count,
    because marks on back and ground have edges, too.
    """
    inside = area > 127
    if not inside.any() or inside.all():
        return None
    contrast = abs(float(grey[inside].mean()) - float(grey[~inside].mean()))
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    edges = cv2.Canny(smooth, 0.5 * contrast, 1.2 * contrast)
    block = inside.astype(np.uint8)
    near = np.ones((5, 5), dtype=np.uint8)
    rim = cv2.dilate(block, near) - cv2.erode(block, near)
    edges = np.where(rim > 0, edges, 0).astype(np.uint8)
    if not edges.any():
        return None
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width_px, width_px))
    return np.asarray(cv2.dilate(edges, disc), dtype=np.uint8)
