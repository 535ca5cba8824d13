"""One recording captured: frames read, the animal detected in them, track and pictures written.

A track that was captured before is corrected by the file that the user has saved from its review
page.
"""

from contextlib import nullcontext
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.config.reading import Fact, Facts, by_file, by_user, texts
from snakewalk.controller.capture.capture import (
    ADVICE,
    Capture,
    CaptureFile,
    RejectedFilmError,
    UnusableFilmError,
    load_capture,
    save_capture,
)
from snakewalk.controller.capture.corrections import apply_corrections, read_corrections
from snakewalk.controller.capture.film.film_options import CaptureOptions
from snakewalk.controller.capture.film.results import write_captures
from snakewalk.controller.capture.film.scale import scale_of_length, scale_of_marker
from snakewalk.controller.capture.film_parts import FEWEST_FRAMES, PART_FRAMES, FilmParts
from snakewalk.controller.capture.film_results import in_whole_film, write_looks
from snakewalk.controller.capture.opened_film import OpenedFilm, open_film
from snakewalk.controller.capture.options import check_options, settings_of
from snakewalk.controller.capture.part_folder import FinishedPart, PartFolder
from snakewalk.controller.capture.plots.capture import step_picture, trail_picture
from snakewalk.controller.capture.review import picture_scale
from snakewalk.controller.capture.verification.film_check import REJECTED
from snakewalk.controller.console.messages import LOGGER, stderr_console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import (
    atomic_write,
    check_ending,
    refuse_to_overwrite,
)
from snakewalk.controller.images.body_detector import (
    BodyDetector,
    make_detector,
    stands_out_both_ways,
)
from snakewalk.controller.images.region import WHOLE
from snakewalk.controller.images.resting import with_neighbours
from snakewalk.controller.images.video import Footage, in_8_bits
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.track import UNSURE_HEAD

MANY_LOST = 1.0 / 3.0
"""Share of the frames: from this number of lost ones, or below this number of used ones, the
outline of the animal may be unseen."""
_EXPLAINED_STATUSES = {
    FrameStatus.NOTHING,
    FrameStatus.CUT,
    FrameStatus.MERGED,
    FrameStatus.LEFT_OUT,
}
_UNCLEAR = REJECTED | {
    FrameStatus.SEVERAL,
    FrameStatus.BLOB,
    FrameStatus.PART,
    FrameStatus.GHOST,
}  # in most frames: the outline of the animal is not seen
_FEW_ROUGH = 0.25  # of the frames in which it should be seen: rough frames are then chance finds
_BROKEN = {
    FrameStatus.SEVERAL,
    FrameStatus.PART,
    FrameStatus.GHOST,
    FrameStatus.EMPTY,
    FrameStatus.LENGTH,
}  # the outline of the animal is not seen as one
_LEAST_AGREEING = 0.5  # of the frames with an outline
_VARIES = 0.15  # of the length: most animals do not change their length so much (ours)
_DOUBTFUL = 0.1  # of the length: expected error of a film with mostly broken outlines (ours)
_INACCURATE = 0.015  # of the length: a larger expected error needs a look


@dataclass(frozen=True, slots=True)
class CaptureFacts:
    """Counts and sizes of a captured recording, rounded for a reader."""

    recording: str
    track: str
    frames: int
    frames_used: int
    frames_rough: int
    frames_with_company: int
    """Frames with distractors."""
    verdicts: dict[str, int]
    """Frames of each status."""
    rate_hz: float
    rate_assumed: bool
    background: str
    animal: str
    """Whether it is dark or light on its ground."""
    length_px: float
    expected_error_px: float | None
    length_m: float | None
    head_by: str
    head_sure: float
    head_probability: float
    """Calibrated: nine of ten films with 0.9 have their head first."""
    frames_with_unsure_head: int
    frames_missing: int
    """Images whose number is missing in their folder; the times of the others keep the gaps."""
    places_recorded: bool
    """False where the images were cropped to the animal: they contain no travel."""
    frames_lost: int
    """Frames that should show a whole animal, and have no points."""
    frames_rejected: int
    """Frames whose finished skeleton their own pixels contradict; ``verdicts`` has the reasons."""
    warning: str | None
    """Doubts about the whole recording."""
    facts: dict[str, str]
    """Quantity, unit, order and time base of the film, with their sources."""
    notes: tuple[str, ...] = ()
    """Stored answers that were used."""


@dataclass(frozen=True, slots=True)
class CorrectionFacts:
    """Counts of a corrected recording."""

    corrected: str
    track: str
    frames: int
    frames_used: int
    frames_flipped: int
    frames_left_out: int
    frames_redrawn: int
    verdicts: dict[str, int]
    """Frames of each status."""
    frames_with_unsure_head: int


def correct_recording(options: CaptureOptions) -> CorrectionFacts:
    """Correct a captured track by the file of ``--corrections`` and write it again.

    Raises:
        InputError: no captured track, no corrections of it, another option, a result that exists.

    """
    if options.corrections is None:
        raise ValueError("--corrections: needs a file of corrections")
    others = {"recording", "output", "corrections", "force"}
    if options.model_dump(exclude_defaults=True, exclude=others):
        raise InputError(
            "--corrections: works with TRACK.npz of an earlier capture, -o and --force only; "
            "leave the other options out"
        )
    check_ending(options.output, "a corrected track", ".npz")
    refuse_to_overwrite([options.output], options.force)
    said = read_corrections(options.corrections)
    corrected = apply_corrections(load_capture(options.recording), said, str(options.corrections))
    with atomic_write(options.output) as part:
        save_capture(part, corrected)
    captured = corrected.captured
    return CorrectionFacts(
        corrected=str(options.recording),
        track=str(options.output),
        frames=len(captured.status),
        frames_used=int(captured.used.sum()),
        frames_flipped=len(said.flipped),
        frames_left_out=len(said.left_out),
        frames_redrawn=len(said.redrawn),
        verdicts=captured.counts,
        frames_with_unsure_head=_unsure_heads(captured),
    )


def capture_recording(options: CaptureOptions) -> CaptureFacts:
    """Capture a recording and write all results that the options name.

    Raises:
        InputError: nothing that can be used in the recording, a result that exists, a bad option.

    """
    check_options(options)
    folder = part_folder(options)
    finished = folder.start(resume=options.resume, force=options.force)
    console = stderr_console()
    with console.status("learning the background ..."):
        film = open_film(options)
        detector = make_detector(
            film.some,
            film.background,
            cropped=options.cropped,
            inside=film.region.inside,
            threshold=film.threshold,
        )
        m_per_px = marker_scale(options, detector, film)
    footage = film.footage
    scale = 1.0
    if options.review is not None:
        scale = picture_scale(film.some[::3], footage.count, str(options.recording))
    parts = _parts(options, film, folder, finished)
    with ProgressBar("frames", footage.count, transient=True, remaining=True) as bar:
        captured = _captured_clearly(options, parts, film, detector, bar)
        captured = in_whole_film(options, film, captured)
        if options.length_m is not None:
            m_per_px = scale_of_length(options.length_m, captured.length_px)
        capture_file = CaptureFile(
            captured,
            name=options.recording.stem,
            m_per_px=m_per_px,
            rate_assumed=footage.rate_assumed,
            source=f"captured from {options.recording.name}"
            + (f", positions from {options.keypoints.name}" if options.keypoints else ""),
        )
        write_captures(options.output, [capture_file], wide=options.wide)
        _write_pictures(options, film, detector, capture_file, bar, scale)
    if parts.folder is not None:
        parts.folder.clear()
    facts = facts_of(options, footage, detector, captured, m_per_px, options.output)
    warn_of(options, footage, facts)
    return facts


def part_folder(options: CaptureOptions) -> PartFolder:
    """Return the folder of the finished parts of a capture."""
    return PartFolder(
        options.output.with_name(options.output.name + ".part"),
        settings_of(options) | {"frames_of_a_part": PART_FRAMES},
    )


def _parts(
    options: CaptureOptions, film: OpenedFilm, folder: PartFolder, finished: list[FinishedPart]
) -> FilmParts:
    """Return the film in parts, with those that an interrupted capture has finished."""
    for part in finished:
        film.stated_s.extend(part.time_s)
    return FilmParts(
        film.footage.rate_hz,
        film.footage.count,
        str(options.recording),
        film.heads_px[0] if film.heads_px else None,
        not options.cropped and film.one_size,
        folder,
        finished=finished,
        part_frames=PART_FRAMES,
    )


def _captured_clearly(
    options: CaptureOptions,
    parts: FilmParts,
    film: OpenedFilm,
    detector: BodyDetector,
    bar: ProgressBar,
) -> Capture:
    """Capture the film; an animal as bright as its ground, whose outline is unseen, is a fault."""
    fault = RejectedFilmError(
        f"{options.recording}: the animal is about as bright as its ground, or dark and light "
        "shapes are in view; use other light, or give --animals, --background, --cropped, --roi "
        "or --threshold"
    )
    try:
        captured = _captured_parts(parts, film, detector, bar)
    except UnusableFilmError as error:
        if error.reason not in {None, *_EXPLAINED_STATUSES} and stands_out_both_ways(film.some):
            raise fault from None
        raise
    few = captured.used.sum() < MANY_LOST * len(_expected_statuses(captured))
    if few and stands_out_both_ways(film.some):
        raise fault
    check_chance_finds(options, captured)
    return in_doubt(captured)


def check_chance_finds(options: CaptureOptions, captured: Capture) -> None:
    """Reject a film in which a few rough frames are all that is found of an unclear outline."""
    used = int(captured.used.sum())
    good = int(captured.good.sum())
    unclear = [frame_status for frame_status in captured.status if frame_status in _UNCLEAR]
    if used < _FEW_ROUGH * (used + len(unclear)) and good <= 0.5 * used:
        reason = max(dict.fromkeys(unclear), key=unclear.count)
        raise RejectedFilmError(
            f"{options.recording}: only {used} of {len(captured.status)} frames show a complete "
            f"body, and these are rough; mostly: {reason}; use other light, or give --background, "
            "--roi or --threshold"
        )


def in_doubt(captured: Capture) -> Capture:
    """Return the capture; its frames are rough if most others contradict them.

    If most outlines are broken, the used lines may be parts of a patterned body. If the length
    varies and most other frames are not solved, two animals in contact may be taken for one.
    """
    used = int(captured.used.sum())
    broken = sum(frame_status in _BROKEN for frame_status in captured.status)
    unsolved = len(_expected_statuses(captured)) - used
    low, usual, high = np.nanpercentile(captured.length_px, (5.0, 50.0, 95.0))
    varies = float((high - low) / usual)
    contradicted = broken if varies < _VARIES else unsolved
    if used >= _LEAST_AGREEING * (used + contradicted):
        return captured
    return captured.roughened(max(_DOUBTFUL, varies))


def _expected_statuses(captured: Capture) -> list[FrameStatus]:
    """Statuses of the frames in which a whole animal is expected."""
    return [
        frame_status
        for frame_status in captured.status
        if frame_status.has_points or frame_status not in _EXPLAINED_STATUSES
    ]


def _captured_parts(
    parts: FilmParts, film: OpenedFilm, detector: BodyDetector, bar: ProgressBar
) -> Capture:
    first = len(film.stated_s)
    bar.update(first)
    kept = nullcontext() if parts.folder is None else parts.folder.kept_if_interrupted()
    with kept:
        shown = with_neighbours(film.frames, first)
        for number, (frame, neighbours) in enumerate(shown, start=first):
            detection = detector.detect(frame, neighbours=neighbours)
            if film.keypoints is not None:
                detection = film.keypoints.placed(detection, number)
            parts.add(frame, detection, film.stated_s[number])
            bar.advance()
    return parts.done()


def warn_of(options: CaptureOptions, footage: Footage, facts: CaptureFacts) -> None:
    """Warn of missing images, and of the reason for which a capture needs attention."""
    if footage.missing:
        LOGGER.warning(
            "%s: %d image numbers are missing; the times of the other frames keep the gaps",
            options.recording,
            footage.missing,
        )
    if facts.warning is not None:
        LOGGER.warning(facts.warning)


def marker_scale(options: CaptureOptions, detector: BodyDetector, film: OpenedFilm) -> float | None:
    """Return the scale by the marker in an image or in the background; None without a marker."""
    if options.marker is None:
        return None
    bare = detector.background if film.region is WHOLE else None
    return scale_of_marker(options.marker, in_8_bits(film.first if bare is None else bare))


def _write_pictures(
    options: CaptureOptions,
    film: OpenedFilm,
    detector: BodyDetector,
    file: CaptureFile,
    bar: ProgressBar,
    scale: float,
) -> None:
    """Write what the options ask for to look at; ``scale`` is that of the review page."""
    captured = file.captured
    footage = film.footage
    region = film.region
    if options.trail is not None:
        trail_picture(options.trail, footage.read(), captured, detector.polarity)
    if options.steps is not None:
        number = int(np.argmax(captured.used))
        shot = next(islice(footage.read(), number, None))
        image = film.cut(shot)
        line = captured.points_px[number] - np.array(region.origin_px)
        step_picture(options.steps, image, detector, line)
    write_looks(options, film, [file], [options.output], bar, scale)


def facts_of(
    options: CaptureOptions,
    footage: Footage,
    detector: BodyDetector,
    captured: Capture,
    m_per_px: float | None,
    track: Path,
) -> CaptureFacts:
    """Return the counts and sizes of a captured animal."""
    length_px = float(np.nanmedian(captured.length_px))
    finite_values = captured.expected_px[np.isfinite(captured.expected_px)]
    return CaptureFacts(
        recording=str(options.recording),
        track=str(track),
        frames=len(captured.status),
        frames_used=int(captured.used.sum()),
        frames_rough=int((captured.used & ~captured.good).sum()),
        frames_with_company=int(captured.with_distractors.sum()),
        verdicts=captured.counts,
        rate_hz=captured.rate_hz,
        rate_assumed=footage.rate_assumed,
        background=detector.background_source,
        animal=str(detector.polarity),
        length_px=round(length_px, 2),
        expected_error_px=round(float(np.median(finite_values)), 3) if finite_values.size else None,
        length_m=None if m_per_px is None else round(length_px * m_per_px, 5),
        head_by=captured.head_by,
        head_sure=round(captured.head_sure, 3),
        head_probability=round(captured.head_probability, 3),
        frames_with_unsure_head=_unsure_heads(captured),
        frames_missing=footage.missing,
        places_recorded=captured.places_recorded,
        frames_lost=len(_unexplained_statuses(captured)),
        frames_rejected=sum(frame_status in REJECTED for frame_status in captured.status),
        warning=warning_of(options, captured),
        facts=texts(film_facts(options, footage, captured, m_per_px)),
    )


def film_facts(
    options: CaptureOptions, footage: Footage, captured: Capture, m_per_px: float | None
) -> Facts:
    """Return the facts about a film, each with its source."""
    scale = None if m_per_px is None else f"{m_per_px:.4g} m a pixel"
    file = None if options.keypoints is None else str(options.keypoints)
    return {
        "quantity": by_file(str(file), file and "keypoints of an animal")
        or Fact("silhouettes of an animal", "file", "its pictures"),
        "unit": by_user("--length-m or --marker", scale)
        or Fact("px", "inferred", "no scale is given"),
        "order": by_user("--head", options.head and "head first")
        or by_file(str(file), file and "head first")
        or Fact(
            "head first",
            "inferred",
            f"{captured.head_by}, probability {captured.head_probability:.2f}",
        ),
        "time": footage.time_fact(captured.rate_hz, options.rate_hz),
    }


def warning_of(options: CaptureOptions, captured: Capture) -> str | None:
    """Doubts about the recording, in one sentence each; None without a doubt."""
    doubts = []
    x, y = captured.points_px[np.argmax(captured.used), -1]
    if captured.head_sure < UNSURE_HEAD:
        doubts.append(
            f"head and tail may be exchanged (the head is right with a probability of "
            f"{captured.head_probability:.2f}, from the {captured.head_by}); look at --sheet or "
            f"--review, and if they are, give --head {x:.0f},{y:.0f}"
        )
    if len(captured.status) < FEWEST_FRAMES:
        doubts.append(
            f"fewer than {FEWEST_FRAMES} frames show no usual length to compare with; film longer"
        )
    unused = _unexplained_statuses(captured)
    if len(unused) >= MANY_LOST * len(captured.status):
        reason = max(dict.fromkeys(unused), key=unused.count)
        doubts.append(
            f"{len(unused)} of {len(captured.status)} frames are not used, mostly because "
            f"({ADVICE.get(reason, reason)}); look at --sheet"
        )
    is_known = np.isfinite(captured.expected_px)
    if is_known.any():
        share = float(np.median(captured.expected_px[is_known] / captured.length_px[is_known]))
        if share > _INACCURATE:
            doubts.append(
                f"the points are expected to be off by {share:.1%} of the body in most frames; "
                "look at --sheet, and give --background or --threshold if a part of the animal "
                "is not found"
            )
    return f"{options.recording}: {'. '.join(doubts)}" if doubts else None


def _unexplained_statuses(captured: Capture) -> list[FrameStatus]:
    """Statuses of the frames that should show an animal and have no points."""
    return [
        frame_status
        for frame_status in captured.status
        if not frame_status.has_points and frame_status not in _EXPLAINED_STATUSES
    ]


def _unsure_heads(captured: Capture) -> int:
    return int(np.count_nonzero(captured.margin < 0.1))
