"""Films on disk to the input of matching: grey pictures and the fish's silhouettes."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.matching import SilhouetteFrame
from snakewalk.controller.images.body_detector import BodyDetector, make_detector, whole_share
from snakewalk.controller.images.silhouette import Polarity, contrast, silhouette_of
from snakewalk.controller.images.video import Footage, in_8_bits, open_footage
from snakewalk.controller.track.frame_status import FrameStatus

_FOR_BACKGROUND = 25
_LEAST_WHOLE_BODIES = 0.5
"""Share of those frames that must show a whole body on the ground that was found (ours)."""
_THIN_PART_LEVEL = (
    0.5  # share of the silhouette's threshold: connected pixels above it belong to the body
)
_SURE_CONTRAST = 12.0  # grey values above the ground at least


@dataclass(frozen=True, slots=True)
class FishFilm:
    """One camera's film, its ground, and how the fish stands out from it."""

    footage: Footage
    detector: BodyDetector
    """Detector of the ground, or of the body in each frame."""
    size_px: tuple[int, int]
    """Rows and columns of a frame."""

    def frames(self) -> Iterator[SilhouetteFrame]:
        """Every frame, from the start each time.

        Raises:
            InputError: a frame of another size than the background, or that cannot be read.

        """
        rows, columns = self.size_px
        for image in self.footage.shown():
            if image.shape[:2] != self.size_px:
                raise InputError(
                    f"{self.footage.path}: a frame of {image.shape[1]} x {image.shape[0]} pixels "
                    f"over a background of {columns} x {rows}"
                )
            ground = in_8_bits(self.detector.ground_of(grey(image)))
            yield silhouette_frame(image, ground, self.detector.polarity)


def open_film(path: Path, background: Path | None = None, rate_hz: float | None = None) -> FishFilm:
    """Open a video or a folder of images.

    Without a background the ground is found as for any animal (``make_detector``). If the fish
    swims about, the ground is the median of the frames. If it holds station, the ground is the
    median of frames in which the fish is painted out, or the surroundings of the fish in each
    frame.

    Args:
        path: of the film.
        background: picture of the empty scene.
        rate_hz: frames a second, instead of the rate in the file.

    Raises:
        InputError: nothing that can be read, or no ground on which a whole body is seen.

    """
    footage = open_footage(path, rate_hz)
    some = [grey(in_8_bits(image)) for image in footage.spread(_FOR_BACKGROUND)]
    if len({image.shape for image in some}) > 1:
        raise InputError(f"{path}: its frames differ in size")
    empty = None if background is None else grey(in_8_bits(footage.image(background)))
    if empty is not None and empty.shape != some[0].shape:
        raise InputError(
            f"{background}: {empty.shape[1]} x {empty.shape[0]} pixels; the film has "
            f"{some[0].shape[1]} x {some[0].shape[0]}"
        )
    detector = make_detector(some, empty)
    if empty is None and whole_share(detector, some) < _LEAST_WHOLE_BODIES:
        raise InputError(
            f"{path}: fewer than half of the frames show a complete fish on an empty ground; if "
            "it stays at one place, give a picture of the empty scene with --background (for "
            "the side view --side-background)"
        )
    return FishFilm(footage, detector, some[0].shape)


def silhouette_frame(image: Image, background: Image, polarity: Polarity) -> SilhouetteFrame:
    """Cut the fish out of one frame; the mask is empty where nothing stands out.

    A tail fin seen on edge is thinner than the blur of the picture and has not half the body's
    contrast. So an area that is connected to the body at a lower threshold belongs to it.

    Args:
        image: (H, W) or (H, W, 3), 8 bit.
        background: (H, W) the same without the fish.
        polarity: whether the fish is darker or lighter than its ground.

    """
    plain = grey(image)
    silhouette = silhouette_of(plain, background, polarity)
    mask = np.zeros(plain.shape, dtype=bool)
    if silhouette.area_px > 0.0:
        part = silhouette.window(max(4, max(silhouette.level.shape) // 4))
        smooth_contrast = cv2.GaussianBlur(
            contrast(plain[part], background[part], polarity), (3, 3), 0.0
        )
        low = max(
            _THIN_PART_LEVEL * silhouette.threshold,
            float(np.median(smooth_contrast)) + _SURE_CONTRAST,
        )
        _, label = cv2.connectedComponents((smooth_contrast > low).astype(np.uint8), connectivity=8)
        core = np.zeros(label.shape, dtype=bool)
        core[silhouette.window_within(part)] = silhouette.mask
        kept = np.unique(label[core])
        mask[part] = np.isin(label, kept[kept > 0])
    return SilhouetteFrame(
        plain, mask, "" if silhouette.status is FrameStatus.GOOD else str(silhouette.status)
    )


def grey(image: Image) -> Image:
    """(H, W) brightness of a grey or colour image."""
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
