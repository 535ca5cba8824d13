"""A film that is opened to be captured: its frames cut to the region, some for the background."""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.arrays import DeepImage, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film.keypoint_lines import KeypointLines
from snakewalk.controller.capture.options import places_of
from snakewalk.controller.images.region import WHOLE, Region, region_of
from snakewalk.controller.images.silhouette import as_deep_as
from snakewalk.controller.images.video import Footage, frame_times, open_footage

_SAMPLE = 25  # frames from which the background is learnt


@dataclass(frozen=True, slots=True)
class OpenedFilm:
    """A film with its region."""

    footage: Footage
    region: Region
    first: DeepImage
    """Complete first frame."""
    some: tuple[DeepImage, ...]
    """Frames spread over the film, cut to the region."""
    one_size: bool
    """Whether all images have the same size."""
    in_colour: bool
    background: DeepImage | None
    """Background that the user gave, cut to the region."""
    threshold: float | None
    """Contrast threshold that the user gave, in the levels of 8 bit."""
    heads_px: tuple[tuple[float, float], ...]
    """Places of heads in the region that the user gave."""
    keypoints: KeypointLines | None
    """Bodies of another program, in the region."""
    stated_s: "array[float]" = field(default_factory=lambda: array("d"))
    """Times of the frames, as the film states them; filled by ``frames``."""

    def frames(self, first: int = 0) -> Iterator[DeepImage]:
        """All frames from number ``first``, cut to the region."""
        del self.stated_s[first:]
        for frame, at_s in self.footage.timed(first):
            self.stated_s.append(at_s)
            yield self.cut(frame)

    def cut(self, frame: DeepImage) -> DeepImage:
        """Cut a frame to the region; grey or in colour as the others."""
        return self.region.cut(_of_kind(frame, self.in_colour))

    def times(self, given_hz: float | None, time_s: Floats) -> tuple[Floats, float]:
        """Times of all frames that were read, and their rate; ``time_s``: by the given rate."""
        if given_hz is not None and not self.footage.missing:
            return time_s, self.footage.rate_hz
        return frame_times(self.stated_s, self.footage.rate_hz)


def open_film(options: CaptureOptions) -> OpenedFilm:
    """Open the film of the options.

    Raises:
        InputError: no film, or an option that does not fit it.

    """
    footage = open_footage(options.recording, options.rate_hz)
    heads_px = places_of(options)
    sample = footage.spread(_SAMPLE)
    one_size = len({frame.shape[:2] for frame in sample}) == 1
    if (options.roi or options.mask) and not one_size:
        raise InputError(
            f"{options.recording}: --roi and --mask need images of one size; leave them out"
        )
    region = region_of(options.roi, options.mask, sample[0].shape)
    for head_px in heads_px:
        _refuse_outside(head_px, region, sample, str(options.head))
    keypoints = None
    heads = tuple(region.place(*head_px) for head_px in heads_px)
    if options.keypoints is not None:
        keypoints = KeypointLines.of(options.keypoints, region.origin_px)
        x, y = next(iter(keypoints.bodies.values())).points_px[0].tolist()
        heads = heads or ((x, y),)
    in_colour = any(frame.ndim == 3 for frame in sample)
    background = None
    if options.background is not None:
        background = region.cut(_of_kind(footage.image(options.background), in_colour))
    return OpenedFilm(
        footage,
        region,
        sample[0],
        tuple(region.cut(_of_kind(frame, in_colour)) for frame in sample),
        one_size,
        in_colour,
        background,
        _threshold(options, footage),
        heads,
        keypoints,
    )


def _refuse_outside(
    head_px: tuple[float, float], region: Region, frames: Sequence[DeepImage], text: str
) -> None:
    """Refuse a place that no frame shows, or that is not looked at."""
    high, wide = (max(frame.shape[side] for frame in frames) for side in (0, 1))
    x, y = head_px
    if not (0.0 <= x < wide and 0.0 <= y < high):
        raise InputError(f"--head {text}: outside the images, which have {wide} x {high} pixels")
    high, wide = region.cut(frames[0]).shape[:2]
    x, y = region.place(x, y)
    if region is not WHOLE and not (0.0 <= x < wide and 0.0 <= y < high):
        raise InputError(f"--head {text}: outside --roi and --mask, which say where to look")


def _threshold(options: CaptureOptions, footage: Footage) -> float | None:
    """The contrast that the user knows, in the levels of 8 bit."""
    if options.threshold is None or footage.deep is None:
        return options.threshold
    return options.threshold * footage.deep.gain


def _of_kind(image: DeepImage, in_colour: bool) -> DeepImage:
    """The image in colour, or grey: a codec makes some frames of a grey film faintly coloured."""
    if (image.ndim == 3) is in_colour:
        return image
    if in_colour:
        return np.dstack([image] * 3)
    return as_deep_as(image, image.mean(axis=2))
