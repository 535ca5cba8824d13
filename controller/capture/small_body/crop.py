"""The part of a frame that shows a small body: its crop, and the view that is fitted."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.controller.capture.image_file import ImageFile, StoredImage
from snakewalk.controller.capture.small_body.ribbon import BENDS
from snakewalk.controller.capture.verification.frame_store import surroundings
from snakewalk.controller.images.thin_body_fit import spline_basis

LONGEST_PX = 120.0
"""Bodies up to this length are fitted."""
_MARGIN_LENGTHS = 0.3  # of the length, kept on each side
_LEAST_MARGIN_PX = 12.0
_SOFTEN = 0.4  # working px, before pixels are left out
_OWN_BLUR = 0.5  # working px: with that of going between pixels
_WORKING_PX = 48.0  # length of the body while it is fitted, at most
_REACH = 6.0  # working pixels on each side of the body that are fitted


@dataclass(frozen=True, slots=True)
class Crop:
    """A cut-out of a frame and of its ground."""

    image: DeepImage
    ground: DeepImage
    origin_px: tuple[int, int]
    """Position x, y of the crop's first pixel."""

    def shows(self, points_px: Floats) -> bool:
        """Whether any of (P, 2) points lies in it."""
        size = self.image.shape[1::-1]
        inside = (points_px >= self.origin_px) & (points_px < np.add(self.origin_px, size))
        return bool(inside.all(axis=1).any())


def crop_body(image: DeepImage, ground: DeepImage, points_px: Floats) -> Crop:
    """Cut the body of (P, 2) points out; the crop contains views of both images."""
    length = float(np.hypot(*np.diff(points_px, axis=0).T).sum())
    reach = max(_MARGIN_LENGTHS * length, _LEAST_MARGIN_PX)
    window, corner_px = surroundings(points_px, reach)
    return Crop(image[window], ground[window], corner_px)


@dataclass(frozen=True, slots=True)
class _StoredCrop:
    image: StoredImage
    ground: StoredImage | DeepImage
    """An image if it is a part of the shared ground."""
    origin_px: tuple[int, int]


@dataclass(slots=True)
class CropStore(Mapping[int, Crop]):
    """Crops by frame number; their pictures lie in a file."""

    file: ImageFile = field(default_factory=ImageFile)
    _crops: dict[int, _StoredCrop] = field(default_factory=dict)
    _ground: DeepImage | None = None
    """Ground of the first frame: that of all frames if the camera stands still."""

    def put(self, number: int, image: DeepImage, ground: DeepImage, points_px: Floats) -> None:
        """Keep the crop of a frame: ``crop_body``."""
        self._ground = ground if self._ground is None else self._ground
        crop = crop_body(image, ground, points_px)
        if not crop.image.size:
            return
        stored_ground = crop.ground if ground is self._ground else self.file.add(crop.ground)
        self._crops[number] = _StoredCrop(self.file.add(crop.image), stored_ground, crop.origin_px)

    def without(self, frames: Collection[int]) -> "CropStore":
        """Return the crops of all other frames."""
        kept = {k: crop for k, crop in self._crops.items() if k not in frames}
        return CropStore(self.file, kept)

    def __getitem__(self, number: int) -> Crop:
        """Read a crop."""
        stored_crop = self._crops[number]
        ground = (
            self.file.read(stored_crop.ground)
            if isinstance(stored_crop.ground, StoredImage)
            else stored_crop.ground
        )
        return Crop(self.file.read(stored_crop.image), ground, stored_crop.origin_px)

    def __iter__(self) -> Iterator[int]:
        """Numbers of the frames, in the order in which they were put."""
        return iter(self._crops)

    def __len__(self) -> int:
        """Count of the crops."""
        return len(self._crops)


@dataclass(frozen=True, slots=True)
class Workspace:
    """The grid on which a film is fitted: whole pixels, or larger ones for longer bodies."""

    scale: float
    """Working pixels a pixel, at most 1."""
    channels: Floats
    """(C,) how channels are weighted: as the body stands out; 1 for grey images."""

    @classmethod
    def of(cls, crops: Sequence[Crop], length_px: float) -> "Workspace":
        """Choose the background from some frames."""
        scale = min(1.0, _WORKING_PX / length_px)
        if crops[0].image.ndim == 2:
            # the strongest pixels decide the sign that makes the body positive
            strong = np.concatenate([_strongest(crop) for crop in crops])
            return cls(scale, np.array([np.sign(np.median(strong)) or 1.0]))
        difference = np.median(np.concatenate([_strongest(crop) for crop in crops]), axis=0)
        return cls(scale, difference / max(float(np.linalg.norm(difference)), 1e-9))

    def to_px(self, points: Floats) -> Floats:
        """Pixels of working coordinates."""
        return (points + 0.5) / self.scale - 0.5

    def from_px(self, points_px: Floats) -> Floats:
        """Working coordinates of pixels."""
        return (points_px + 0.5) * self.scale - 0.5

    def blur_px(self, spot: float) -> float:
        """Blur of the image, from that on the working grid, which adds its own."""
        blur = 0.0 if self.scale == 1.0 else _OWN_BLUR
        return float(np.sqrt(max(spot**2 - blur**2, 0.09))) / self.scale

    def contrast(self, crop: Crop) -> tuple[Floats, tuple[int, int]]:
        """Picture (h, w) on the working grid, above 0 where the body is, and its first pixel."""
        contrast_image = crop.ground.astype(np.float32) - crop.image.astype(np.float32)
        contrast_image = contrast_image.reshape(
            *contrast_image.shape[:2], -1
        ) @ self.channels.astype(np.float32)
        if self.scale == 1.0:
            return np.asarray(contrast_image, dtype=float), crop.origin_px
        contrast_image = np.asarray(
            cv2.GaussianBlur(contrast_image, (0, 0), _SOFTEN / self.scale), dtype=np.float32
        )
        size = np.array(contrast_image.shape[::-1])
        first = np.ceil(self.from_px(np.array(crop.origin_px, dtype=float))).astype(int)
        last = np.floor(self.from_px(np.array(crop.origin_px) + size - 1.0)).astype(int)
        there = self.to_px(first.astype(float)) - crop.origin_px
        back = np.array([[1.0 / self.scale, 0.0, there[0]], [0.0, 1.0 / self.scale, there[1]]])
        wide, high = (int(v) for v in last - first + 1)
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        small = cv2.warpAffine(contrast_image, back, (wide, high), flags=how)
        return np.asarray(small, dtype=float), (int(first[0]), int(first[1]))


def _strongest(crop: Crop) -> Floats:
    """(K[, C]) contrast of the twelfth part of the pixels that stands out most."""
    difference = crop.ground.astype(float) - crop.image.astype(float)
    much = np.abs(difference) if difference.ndim == 2 else np.linalg.norm(difference, axis=2)
    return np.asarray(difference[much >= np.percentile(much, 92.0)])


@dataclass(frozen=True, slots=True)
class View:
    """The neighbourhood of one body."""

    picture: Floats
    """(h, w) contrast, above 0 where the body is."""
    use: Floats
    """(h, w) 1 near the body, 0 elsewhere."""
    first: tuple[int, int]
    """Position x, y of the first pixel on the working grid."""
    start: Floats
    """(FRAME,) a first guess; places relative to the first pixel."""

    @classmethod
    def of(cls, crop: Crop, points_px: Floats, radius_px: float, space: Workspace) -> "View":
        """View a frame whose body lies roughly along ``points_px`` (P, 2)."""
        picture, first = space.contrast(crop)
        line = space.from_px(points_px) - first
        paper = np.full(picture.shape, 255, dtype=np.uint8)
        drawn = np.rint(line * 16.0).astype(np.int32)
        cv2.polylines(paper, [drawn], False, 0, 1, cv2.LINE_8, 4)
        reach = _REACH + 1.5 * radius_px * space.scale
        use = np.asarray(cv2.distanceTransform(paper, cv2.DIST_L2, 5)) <= reach
        rows, columns = np.flatnonzero(use.any(axis=1)), np.flatnonzero(use.any(axis=0))
        window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        corner = np.array([columns[0], rows[0]])
        # blur dims a thin body: its own contrast is between what is seen and that of black
        peak = max(float(np.percentile(picture[use], 95.0)), 4.0)
        contrast = float(np.sqrt(peak * max(peak, float(np.median(crop.ground)))))
        middle = 0.5 * (line[1:] + line[:-1]).mean(axis=0) - corner
        return cls(
            np.ascontiguousarray(picture[window]),
            use[window].astype(float),
            (first[0] + int(corner[0]), first[1] + int(corner[1])),
            np.concatenate([middle, bends_of(line), [contrast], np.zeros(3)]),
        )


def bends_of(line: Floats, bends: int = BENDS) -> Floats:
    """(bends,) of a line (P, 2), head first, of equal steps."""
    step = -np.diff(line, axis=0)
    angle = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    place = (np.arange(len(angle)) + 0.5) / len(angle)
    return np.asarray(np.linalg.lstsq(spline_basis(place, bends), angle, rcond=None)[0])


def reversed_body(frame: Floats) -> Floats:
    """The crop's place with the other end of the body first."""
    other = frame.copy()
    other[2 : 2 + BENDS] = frame[2 : 2 + BENDS][::-1] + np.pi
    return other
