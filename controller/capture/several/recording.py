"""A film of several animals captured: identities, one track each, one page, one film for all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.controller.capture import film_parts
from snakewalk.controller.capture.capture import CaptureFile, RejectedFilmError
from snakewalk.controller.capture.capturing import (
    CaptureFacts,
    facts_of,
    marker_scale,
    part_folder,
)
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film.results import write_captures
from snakewalk.controller.capture.film.scale import scale_of_length
from snakewalk.controller.capture.film_results import in_whole_film, write_looks
from snakewalk.controller.capture.opened_film import OpenedFilm, open_film
from snakewalk.controller.capture.options import AUTO, check_options, track_files
from snakewalk.controller.capture.review import picture_scale
from snakewalk.controller.capture.several.animal_films import (
    AnimalsFound,
    CapturedAnimal,
    capture_animals,
    films_of,
    find_animals,
    with_bare_ground,
)
from snakewalk.controller.capture.several.blobs import SMALLEST, detector_of_several
from snakewalk.controller.console.messages import LOGGER, stderr_console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import refuse_to_overwrite
from snakewalk.controller.images.body_detector import BodyDetector
from snakewalk.controller.track.frame_status import FrameStatus


@dataclass(frozen=True, slots=True)
class AnimalFacts:
    """One animal of a film."""

    animal: int
    """Number, from 1."""
    frames_merged: int
    """Frames in which it is in one silhouette with others; they have no points."""
    contacts_bridged: int
    """Gaps, mostly contacts, through which the animal is followed."""
    identity_uncertain_after: tuple[int, ...]
    """Frames after which it may be another animal."""
    capture: CaptureFacts | None
    """Facts of the capture; None: the animal has no track, and ``fault`` says why."""
    fault: str | None


@dataclass(frozen=True, slots=True)
class AnimalsFacts:
    """The animals of a film."""

    recording: str
    frames: int
    animals: tuple[AnimalFacts, ...]
    left_out: int
    """Objects that were followed for too short a time to be one of the animals."""
    smaller_objects: int
    """Objects in most frames whose area is less than 0.3 of the usual one; they have no track."""
    background: str
    notes: tuple[str, ...] = ()
    """Stored answers that were used."""


def capture_several(options: CaptureOptions) -> AnimalsFacts:
    """Capture all animals of a film and write all results that the options name.

    Raises:
        InputError: no animal that can be used, a result that exists, or a bad option.

    """
    check_options(options)
    folder = part_folder(options)
    folder.start(resume=options.resume, force=options.force)
    requested_count = None if options.animals == AUTO else int(str(options.animals))
    if requested_count is not None:
        refuse_to_overwrite(track_files(options, requested_count), options.force)
    with stderr_console().status("learning the background ..."):
        film = open_film(options)
        name = str(options.recording)
        if not film.one_size:
            raise InputError(f"{name}: --animals needs images of one size; leave it out")
        detector = detector_of_several(
            film.some,
            film.background,
            inside=film.region.inside,
            threshold=film.threshold,
            requested_count=requested_count,
        )
        if film.background is None:
            detector = with_bare_ground(detector, film.some)
    count = film.footage.count
    scale = 1.0
    if options.review is not None:
        scale = picture_scale(film.some[::3], count, name)
    with ProgressBar("identities", count, transient=True) as bar:
        animals_found = find_animals(
            film.frames(),
            film.some,
            detector,
            requested_count=requested_count,
            name=name,
            on_progress=bar.advance,
        )
        refuse_to_overwrite(track_files(options, len(animals_found.identities)), options.force)
        bar.update(0, count, description="frames")
        films = films_of(
            animals_found,
            film.footage.rate_hz,
            name,
            folder,
            resume=options.resume,
            part_frames=film_parts.PART_FRAMES,
            heads_px=film.heads_px,
        )
        with folder.kept_if_interrupted():
            animals = capture_animals(
                film.frames, detector, animals_found, films, on_progress=bar.advance
            )
        files = _files(options, film, detector, animals)
        _write(options, film, files, bar, scale)
    folder.clear()
    facts = _facts(options, film, detector, animals_found, animals, files)
    _warn(options, facts)
    return facts


def _files(
    options: CaptureOptions,
    film: OpenedFilm,
    detector: BodyDetector,
    animals: Sequence[CapturedAnimal],
) -> list[CaptureFile | None]:
    """The file of each animal, or None for an animal without a track.

    Raises:
        InputError: no animal has a track.

    """
    good = [animal.captured for animal in animals if animal.captured is not None]
    if not good:
        raise RejectedFilmError(str(animals[0].fault))
    m_per_px = marker_scale(options, detector, film)
    if options.length_m is not None:
        lengths = np.concatenate([captured.length_px for captured in good])
        m_per_px = scale_of_length(options.length_m, lengths)
    return [
        None
        if animal.captured is None
        else CaptureFile(
            in_whole_film(options, film, animal.captured),
            name=f"{options.recording.stem}-{number}",
            m_per_px=m_per_px,
            rate_assumed=film.footage.rate_assumed,
            source=f"captured from {options.recording.name}, animal {number}",
            identity_uncertain_after=animal.identity.uncertain_after,
        )
        for number, animal in enumerate(animals, start=1)
    ]


def _write(
    options: CaptureOptions,
    film: OpenedFilm,
    capture_files: Sequence[CaptureFile | None],
    bar: ProgressBar,
    scale: float,
) -> None:
    files = track_files(options, len(capture_files))
    by_file = {
        file: capture_file
        for file, capture_file in zip(files, capture_files, strict=True)
        if capture_file is not None
    }
    good = [capture_file for capture_file in capture_files if capture_file is not None]
    for file, capture_file in by_file.items():
        several = [capture_file] if file.suffix.lower() == ".npz" else good
        write_captures(file, several, wide=options.wide)
    write_looks(options, film, good, list(by_file), bar, scale)


def _facts(
    options: CaptureOptions,
    film: OpenedFilm,
    detector: BodyDetector,
    animals_found: AnimalsFound,
    animals: Sequence[CapturedAnimal],
    capture_files: Sequence[CaptureFile | None],
) -> AnimalsFacts:
    listed = []
    tracks = track_files(options, len(capture_files))
    for number, (animal, file, track) in enumerate(
        zip(animals, capture_files, tracks, strict=True), start=1
    ):
        facts = None
        merged = 0
        if file is not None:
            captured = file.captured
            facts = facts_of(options, film.footage, detector, captured, file.m_per_px, track)
            merged = captured.status.count(FrameStatus.MERGED)
        listed.append(
            AnimalFacts(
                number,
                merged,
                animal.identity.bridged,
                animal.identity.uncertain_after,
                facts,
                animal.fault,
            )
        )
    return AnimalsFacts(
        recording=str(options.recording),
        frames=animals_found.frames,
        animals=tuple(listed),
        left_out=animals_found.left_out,
        smaller_objects=animals_found.smaller,
        background=detector.background_source,
    )


def _warn(options: CaptureOptions, facts: AnimalsFacts) -> None:
    """Warn of animals without a track, of doubtful identities and of doubtful heads."""
    if facts.smaller_objects:
        LOGGER.warning(
            "%s: %d smaller objects, of less than %g of the usual area, are not captured; if they "
            "are animals, capture them alone with --roi",
            options.recording,
            facts.smaller_objects,
            SMALLEST,
        )
    for animal in facts.animals:
        if animal.fault is not None:
            LOGGER.warning("%s", animal.fault)
        if animal.identity_uncertain_after:
            frames = ", ".join(map(str, animal.identity_uncertain_after))
            LOGGER.warning(
                "%s: animal %d: identity uncertain after frame %s; look at --review or --overlay",
                options.recording,
                animal.animal,
                frames,
            )
        if animal.capture is not None and animal.capture.warning is not None:
            LOGGER.warning("animal %d: %s", animal.animal, animal.capture.warning)
