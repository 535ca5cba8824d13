"""One capture for each animal of a film: its own blob in each frame, all others painted out."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from snakewalk.config.arrays import DeepImage, Floats, SignedInts
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import ADVICE, Capture, RejectedFilmError
from snakewalk.controller.capture.film_parts import PART_FRAMES, FilmParts
from snakewalk.controller.capture.part_folder import PartFolder
from snakewalk.controller.capture.several.blobs import (
    SMALLEST,
    Blobs,
    blobs_of,
    mask_of_other_animals,
    own_window,
    usual_area,
)
from snakewalk.controller.capture.several.identities import Identity, identities_of
from snakewalk.controller.capture.several.tracklets import TrackletBuilder
from snakewalk.controller.images.background import background_candidates
from snakewalk.controller.images.body_detector import BodyDetector, Detection
from snakewalk.controller.images.resting import Neighbours, with_neighbours
from snakewalk.controller.images.silhouette import Polarity, as_deep_as
from snakewalk.controller.track.frame_status import FrameStatus

_DIRT = 0.05  # of the usual area: smaller objects are not mentioned
_WINDOW_LENGTHS = 3.0  # of the length of a blob, around it: a faint tail goes on beyond the blob
_LEAST_WINDOW_PX = 24
_COVER_PX = 9  # side of a square: the blurred edge of an animal
_GAP_PX = 25  # the same, for a part that the first background contains
_INPAINT_PX = 5.0  # radius from which a ground that is never free is continued
_FEWEST_FREE = 5  # frames without an animal at a place
_UNSEEN_FRAME = -1
_MERGED_FRAME = -2
_JOINED_AREA = 1.25  # of the animal's own area: a silhouette contains another animal (ours)


@dataclass(frozen=True, slots=True)
class AnimalsFound:
    """The animals of a film."""

    identities: tuple[Identity, ...]
    """Identities of the animals in the order of their tracks: from left to right where they are
    first seen."""
    left_out: int
    """Blobs that were followed, but not long enough for an animal."""
    usual_px: float
    """Usual area of an animal."""
    frames: int
    smaller: int = 0
    """Objects in most frames that are too small for an animal of this area."""


@dataclass(frozen=True, slots=True)
class CapturedAnimal:
    """One animal's capture, or why it failed."""

    captured: Capture | None
    identity: Identity
    fault: str | None = None


def find_animals(
    frames: Iterable[DeepImage],
    some: Sequence[DeepImage],
    detector: BodyDetector,
    *,
    requested_count: int | None,
    name: str,
    on_progress: Callable[[], None] = lambda: None,
) -> AnimalsFound:
    """Follow all animals through a film.

    Args:
        frames: all, in order.
        some: a few, spread over the film.
        detector: from ``detector_of_several``.
        requested_count: number of animals; None: those that are followed through half of the film.
        name: of the film, for faults.
        on_progress: called after each frame.

    Raises:
        InputError: fewer animals than wanted, or none.

    """
    blob_frames = [blobs_of(sample_frame, detector) for sample_frame in some]
    usual = usual_area(blob_frames)
    sample = [blobs.area_px for blobs in blob_frames]
    if usual <= 0.0:
        raise RejectedFilmError(f"{name}: {ADVICE[FrameStatus.NOTHING]}")
    builder = TrackletBuilder(usual)
    count = 0
    for frame in frames:
        builder.add(blobs_of(frame, detector, usual))
        count += 1
        on_progress()
    every = identities_of(builder.done())
    kept = [identity for identity in every if identity.is_animal(count)]
    if requested_count is not None:
        kept = every[:requested_count]
    if not kept or (requested_count is not None and len(kept) < requested_count):
        asked = "auto" if requested_count is None else str(requested_count)
        raise RejectedFilmError(
            f"{name}: --animals {asked}: {len(kept)} animals can be followed; give --background, "
            "or another number"
        )
    kept.sort(key=lambda kept_identity: float(kept_identity.tracklets[0].middles[0][0]))
    small = [
        int(((areas_px > _DIRT * usual) & (areas_px < SMALLEST * usual)).sum())
        for areas_px in sample
    ]
    return AnimalsFound(
        tuple(kept), len(every) - len(kept), usual, count, smaller=int(np.median(small))
    )


def with_bare_ground(detector: BodyDetector, frames: Sequence[DeepImage]) -> BodyDetector:
    """The detector with a background from which the animals are left out with their faint tails.

    A tail that rests in half of the frames would otherwise be a part of the background.

    Args:
        detector: from ``detector_of_several``, with its own background.
        frames: (H, W[, C]), spread over the film.

    """
    first = detector.background
    if first is None:
        return detector
    usual = usual_area([blobs_of(frame, detector) for frame in frames])
    stack = np.stack(frames)
    covered = np.zeros(stack.shape[:3], dtype=np.uint8)
    box, gap = (np.ones((side, side), dtype=np.uint8) for side in (_COVER_PX, _GAP_PX))
    shown_frames = with_neighbours(lambda number: frames[number:])
    for cover, (frame, neighbours) in zip(covered, shown_frames, strict=True):
        blobs = blobs_of(frame, detector, usual)
        for number in range(len(blobs.area_px)):
            _, detection = _detected_animal(frame, first, detector, blobs, number, neighbours)
            cover[detection.silhouette.window()] |= detection.silhouette.mask
        cover[:] = cv2.morphologyEx(cv2.dilate(cover, box), cv2.MORPH_CLOSE, gap)
    free = len(frames) - covered.sum(axis=0, dtype=int)
    grounds = {polarity: ground for ground, polarity, _ in background_candidates(frames)}
    ground = grounds.get(detector.polarity, grounds[None])
    brighter = np.median(ground.astype(np.float32) - grounds[None], axis=(0, 1))
    ground = as_deep_as(first, np.maximum(ground - brighter, 0.0))
    learnt = (free >= _FEWEST_FREE) & (free < len(frames))
    levels = stack[:, learnt].astype(np.float32)
    levels[covered[:, learnt] > 0] = np.nan
    bare = np.nanmedian(levels, axis=0)
    if detector.polarity is not Polarity.BOTH:  # an unseen part of a tail is not covered
        lighter = detector.polarity is Polarity.DARK
        bare = np.maximum(bare, ground[learnt]) if lighter else np.minimum(bare, ground[learnt])
    ground[learnt] = bare
    if ground.dtype == np.uint8:
        hidden = (free < _FEWEST_FREE).astype(np.uint8)
        ground = np.asarray(cv2.inpaint(ground, hidden, _INPAINT_PX, cv2.INPAINT_TELEA))
    return replace(detector, background=ground)


def films_of(
    animals_found: AnimalsFound,
    rate_hz: float,
    name: str,
    folder: PartFolder | None = None,
    *,
    resume: bool = False,
    part_frames: int = PART_FRAMES,
    heads_px: Sequence[tuple[float, float]] = (),
) -> list[FilmParts]:
    """One film for each animal, with the parts that an interrupted capture has finished.

    Each place in ``heads_px`` is near the head of the animal that is first seen nearest to it.

    Raises:
        InputError: a finished part is damaged.

    """
    out = []
    first_px = np.array([identity.tracklets[0].middles[0] for identity in animals_found.identities])
    heads = {int(np.argmin(np.hypot(*(first_px - head).T))): head for head in heads_px}
    for number in range(1, len(animals_found.identities) + 1):
        animal_folder = None if folder is None else folder.of_animal(number)
        finished = [] if animal_folder is None or not resume else animal_folder.parts()
        out.append(
            FilmParts(
                rate_hz,
                animals_found.frames,
                f"{name}: animal {number}",
                heads.get(number - 1),
                folder=animal_folder,
                finished=finished,
                part_frames=part_frames,
            )
        )
    return out


def capture_animals(
    frames: Callable[[int], Iterable[DeepImage]],
    detector: BodyDetector,
    animals_found: AnimalsFound,
    films: Sequence[FilmParts],
    *,
    on_progress: Callable[[], None] = lambda: None,
) -> list[CapturedAnimal]:
    """Capture each animal as if it were alone; frames in which it is not alone have no points.

    Args:
        frames: the frames from a number on.
        detector: from ``detector_of_several``.
        animals_found: the animals.
        films: from ``films_of``; frames of their finished parts are not captured again.
        on_progress: called after each frame.

    """
    identities = animals_found.identities
    plans = [_plan(identity, animals_found.frames) for identity in identities]
    places = [identity.tracklets[0].middles[0] for identity in identities]
    before = [animal_film.done_frames for animal_film in films]
    first = min(before)
    for _ in range(first):
        on_progress()
    shown_frames = with_neighbours(frames, first)
    for number, (frame, neighbours) in enumerate(shown_frames, start=first):
        ground = detector.ground_of(frame)
        blobs = blobs_of(frame, detector, animals_found.usual_px, ground)
        followed = {int(plan[number]) for plan in plans}
        others = [k for k in range(len(blobs.area_px)) if k not in followed]
        for animal, (plan, film) in enumerate(zip(plans, films, strict=True)):
            index = int(plan[number])
            if index >= 0:
                places[animal] = blobs.middle_px[index]
            if number < before[animal]:
                continue
            if index == _UNSEEN_FRAME:
                film.skip(FrameStatus.NOTHING)
            elif index == _MERGED_FRAME:
                own_px = identities[animal].tracklets[0].area_px
                film.skip(merged_status(blobs, others, places[animal], own_px))
            else:
                shown, detection = _detected_animal(
                    frame, ground, detector, blobs, index, neighbours
                )
                film.add(shown, detection)
        on_progress()
    return [
        _captured_animal(*identity_and_film)
        for identity_and_film in zip(identities, films, strict=True)
    ]


def merged_status(
    blobs: Blobs, others: Sequence[int], place_px: Floats, own_px: float
) -> FrameStatus:
    """Status of a frame in which an animal is not followed: only a joined silhouette touches.

    Args:
        blobs: of the frame.
        others: blobs other than the followed animals.
        place_px: (2,) last place of the animal.
        own_px: its area.

    """
    if not others:
        return FrameStatus.NOTHING
    away = blobs.middle_px[list(others)] - place_px
    nearest = others[int(np.argmin(np.hypot(*away.T)))]
    joined = blobs.area_px[nearest] > _JOINED_AREA * own_px
    return FrameStatus.MERGED if joined else FrameStatus.PART


def _captured_animal(identity: Identity, film: FilmParts) -> CapturedAnimal:
    try:
        return CapturedAnimal(film.done(), identity)
    except InputError as error:
        return CapturedAnimal(None, identity, str(error))


def _plan(identity: Identity, count: int) -> SignedInts:
    """(T,) the animal's blob in each frame, or why it is missing: a key of ``_MISSING``."""
    first, last = identity.tracklets[0], identity.tracklets[-1]
    out = np.full(count, _UNSEEN_FRAME, dtype=np.int32)
    if first.begins_in is not None:
        out[: first.frames[0]] = _MERGED_FRAME
    if last.ends_in is not None:
        out[last.frames[-1] + 1 :] = _MERGED_FRAME
    touched = False
    next_frame = first.frames[0]
    for tracklet in identity.tracklets:
        touched = touched or (tracklet is not first and tracklet.begins_in is not None)
        if touched:
            out[next_frame : tracklet.frames[0]] = _MERGED_FRAME
        next_frame = tracklet.frames[-1] + 1
        touched = tracklet.ends_in is not None
        out[tracklet.frames[0] : next_frame] = tracklet.blobs
    return out


def _detected_animal(
    frame: DeepImage,
    ground: DeepImage,
    detector: BodyDetector,
    blobs: Blobs,
    number: int,
    neighbours: Neighbours,
) -> tuple[DeepImage, Detection]:
    """The frame with this animal alone, and the animal in it."""
    length, width = np.exp(blobs.shape[number][:2])
    window = own_window(
        blobs, number, max(_LEAST_WINDOW_PX, round(_WINDOW_LENGTHS * float(length)))
    )
    covered = mask_of_other_animals(blobs, number, window, round(0.5 * float(width)) + 3)

    def alone(image: DeepImage) -> DeepImage:
        part = image[window].copy()
        part[covered] = ground[window][covered]
        return part

    part = alone(frame)
    inside = None if detector.inside is None else detector.inside[window]
    local = replace(detector, inside=inside)
    shown_alone = [map(alone, side) for side in neighbours]
    detection = local.detect(part, np.ascontiguousarray(ground[window]), shown_alone)
    corner = np.array([window[1].start, window[0].start], dtype=float)
    shown = ground.copy()
    shown[window] = part
    silhouette = detection.silhouette
    x, y = np.add(silhouette.origin_px, corner)
    return shown, replace(
        detection,
        silhouette=replace(silhouette, origin_px=(float(x), float(y))),
        skeleton=replace(detection.skeleton, points_px=detection.skeleton.points_px + corner),
        background=ground,
    )
