"""One recording captured: frames read, the animal detected in them, track and pictures written.

A track that was captured before is corrected by the file that the user has saved from its review
page.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import DeepImage
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.capture import (
    Capture,
    CaptureFile,
    capture,
    load_capture,
    save_capture,
)
from snakewalk.controller.capture.corrections import apply_corrections, read_corrections
from snakewalk.controller.capture.plots.capture import contact_sheet, overlay_film, step_picture
from snakewalk.controller.capture.review import picture_scale, review_page
from snakewalk.controller.capture.scale import scale_of_length, scale_of_marker
from snakewalk.controller.capture.verification.film_check import REJECTED
from snakewalk.controller.console.messages import LOGGER, stderr_console
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.controller.images.body_detector import BodyDetector, make_detector
from snakewalk.controller.images.region import WHOLE, Region, region_of
from snakewalk.controller.images.silhouette import as_deep_as
from snakewalk.controller.images.video import Footage, frame_times, in_8_bits, open_footage
from snakewalk.controller.track.track import UNSURE_HEAD

_SAMPLE = 25  # frames from which the background is learnt
_FILMS = (".mp4", ".mkv", ".avi")
_PAGES = (".html", ".htm")
_SHEETS = (".png", ".jpg", ".jpeg")


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """The options of ``snakewalk capture``; see its help."""

    recording: Path
    output: Path
    background: Path | None = None
    length_m: float | None = None
    marker: str | None = None
    rate_hz: float | None = None
    head: str | None = None
    cropped: bool = False
    roi: str | None = None
    mask: Path | None = None
    threshold: float | None = None
    overlay: Path | None = None
    sheet: Path | None = None
    steps: Path | None = None
    review: Path | None = None
    corrections: Path | None = None
    force: bool = False


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
    frames_with_unsure_head: int
    frames_missing: int
    """Images whose number is missing in their folder; the times of the others keep the gaps."""
    places_recorded: bool
    """False where the images were cropped to the animal: they contain no travel."""
    frames_rejected: int
    """Frames whose finished skeleton their own pixels contradict; ``verdicts`` has the reasons."""
    warning: str | None
    """A doubt about the whole recording."""


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
    plain = CaptureOptions(
        options.recording, options.output, corrections=options.corrections, force=options.force
    )
    if options != plain:
        raise InputError(
            "--corrections: works with TRACK.npz of an earlier capture, -o and --force only; "
            "leave the other options out"
        )
    if options.output.suffix.lower() != ".npz":
        raise InputError(f"{options.output}: a track is an .npz")
    refuse_to_overwrite([options.output], options.force)
    said = read_corrections(options.corrections)
    held = apply_corrections(load_capture(options.recording), said, str(options.corrections))
    with atomic_write(options.output) as part:
        save_capture(part, held)
    captured = held.captured
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
    _check(options)
    footage = open_footage(options.recording, options.rate_hz)
    head_px = None if options.head is None else _place(options.head)
    console = stderr_console()
    with console.status("learning the background ..."):
        whole = footage.spread(_SAMPLE)
        if (options.roi or options.mask) and len({frame.shape[:2] for frame in whole}) > 1:
            raise InputError(
                f"{options.recording}: --roi and --mask need images of one size; these differ"
            )
        region = region_of(options.roi, options.mask, whole[0].shape)
        if head_px is not None:
            _refuse_outside(head_px, region, whole, str(options.head))
        in_colour = any(frame.ndim == 3 for frame in whole)
        some = [region.cut(_of_kind(frame, in_colour)) for frame in whole]
        background = (
            None
            if options.background is None
            else region.cut(_of_kind(footage.image(options.background), in_colour))
        )
        detector = make_detector(
            some,
            background,
            cropped=options.cropped,
            inside=region.inside,
            threshold=_threshold(options, footage),
        )
        m_per_px = _marker_scale(options, detector, region, whole[0])
    scale = 1.0
    if options.review is not None:
        scale = picture_scale(some[::3], footage.count, str(options.recording))
    fixed = not options.cropped and len({frame.shape[:2] for frame in whole}) == 1
    stated_s: list[float] = []

    def cut_frames() -> Iterator[DeepImage]:
        for frame, at_s in footage.timed():
            stated_s.append(at_s)
            yield region.cut(_of_kind(frame, in_colour))

    with ProgressBar("frames", footage.count, transient=True) as bar:
        captured = capture(
            cut_frames(),
            detector,
            footage.rate_hz,
            name=str(options.recording),
            head_px=None if head_px is None else region.place(*head_px),
            fixed=fixed,
            on_progress=bar.advance,
        )
        time_s, rate_hz = captured.time_s, captured.rate_hz
        if options.rate_hz is None or footage.missing:
            time_s, rate_hz = frame_times(stated_s, footage.rate_hz)
        captured = replace(
            captured, points_px=region.moved(captured.points_px), time_s=time_s, rate_hz=rate_hz
        )
        if options.length_m is not None:
            m_per_px = scale_of_length(options.length_m, captured.length_px)
        held = CaptureFile(
            captured,
            name=options.recording.stem,
            m_per_px=m_per_px,
            rate_assumed=footage.rate_assumed,
            source=f"captured from {options.recording.name}",
        )
        with atomic_write(options.output) as part:
            save_capture(part, held)
        _write_pictures(options, footage, region, detector, held, bar, scale, in_colour)
    facts = _facts(options, footage, detector, captured, m_per_px)
    _warn(options, footage, facts)
    return facts


def _warn(options: CaptureOptions, footage: Footage, facts: CaptureFacts) -> None:
    """Warn of missing images, and of the reason for which a capture needs attention."""
    if footage.missing:
        LOGGER.warning(
            "%s: %d image numbers are missing; the times of the other frames keep the gaps",
            options.recording,
            footage.missing,
        )
    if facts.warning is not None:
        LOGGER.warning(facts.warning)


def _marker_scale(
    options: CaptureOptions, detector: BodyDetector, region: Region, image: DeepImage
) -> float | None:
    """Return the scale by the marker in an image or in the background; None without a marker."""
    if options.marker is None:
        return None
    bare = detector.background if region is WHOLE else None
    return scale_of_marker(options.marker, in_8_bits(image if bare is None else bare))


def _write_pictures(
    options: CaptureOptions,
    footage: Footage,
    region: Region,
    detector: BodyDetector,
    held: CaptureFile,
    bar: ProgressBar,
    scale: float,
    in_colour: bool,
) -> None:
    """Write what the options ask for to look at; ``scale`` is that of the review page."""
    captured = held.captured
    if options.sheet is not None:
        contact_sheet(options.sheet, footage.read(), captured)
    if options.steps is not None:
        number = int(np.argmax(captured.used))
        shot = next(islice(footage.read(), number, None))
        image = region.cut(_of_kind(shot, in_colour))
        line = captured.points_px[number] - np.array(region.origin_px)
        step_picture(options.steps, image, detector, line)
    if options.overlay is not None:
        bar.update(0, footage.count, description="overlay film")
        overlay_film(options.overlay, footage.read(), captured, bar.advance)
    if options.review is not None:
        bar.update(0, footage.count, description="review page")
        text = review_page(
            held,
            map(region.cut, footage.read()),
            scale=scale,
            track=options.output,
            origin_px=region.origin_px,
            on_progress=bar.advance,
        )
        with atomic_write(options.review) as part:
            part.write_text(text, encoding="utf-8")


def _check(options: CaptureOptions) -> None:
    if options.cropped and options.background is not None:
        raise InputError("--cropped and --background: a camera that moves has no one background")
    if options.length_m is not None and options.marker is not None:
        raise InputError("--length-m and --marker both give the scale: say one of them")
    if options.length_m is not None and not 0.0 < options.length_m < float("inf"):
        raise InputError(f"--length-m: the animal must be longer than 0 m, not {options.length_m}")
    if options.threshold is not None and not 0.0 < options.threshold < float("inf"):
        raise InputError(
            f"--threshold {options.threshold:g}: expected the grey levels, above 0, by which the "
            "body stands out from its background at its boundary"
        )
    if options.output.suffix.lower() != ".npz":
        raise InputError(f"{options.output}: a track is an .npz")
    if options.overlay is not None and options.overlay.suffix.lower() not in _FILMS:
        raise InputError(f"{options.overlay}: an overlay film is one of {', '.join(_FILMS)}")
    for picture in (options.sheet, options.steps):
        if picture is not None and picture.suffix.lower() not in _SHEETS:
            raise InputError(f"{picture}: a picture is one of {', '.join(_SHEETS)}")
    if options.review is not None and options.review.suffix.lower() not in _PAGES:
        raise InputError(f"{options.review}: a review page is an .html")
    refuse_to_overwrite(
        [options.output, options.overlay, options.sheet, options.steps, options.review],
        options.force,
    )


def _place(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--head {text}: expected X,Y in pixels") from None
    if not np.isfinite([x, y]).all():
        raise InputError(f"--head {text}: expected X,Y in pixels")
    return x, y


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


def _facts(
    options: CaptureOptions,
    footage: Footage,
    detector: BodyDetector,
    captured: Capture,
    m_per_px: float | None,
) -> CaptureFacts:
    length_px = float(np.nanmedian(captured.length_px))
    known = captured.expected_px[np.isfinite(captured.expected_px)]
    error_px = float(np.median(known)) if known.size else float("nan")
    return CaptureFacts(
        recording=str(options.recording),
        track=str(options.output),
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
        expected_error_px=None if np.isnan(error_px) else round(error_px, 3),
        length_m=None if m_per_px is None else round(length_px * m_per_px, 5),
        head_by=captured.head_by,
        head_sure=round(captured.head_sure, 3),
        frames_with_unsure_head=_unsure_heads(captured),
        frames_missing=footage.missing,
        places_recorded=captured.places_recorded,
        frames_rejected=sum(one in REJECTED for one in captured.status),
        warning=_warning(options, captured),
    )


def _warning(options: CaptureOptions, captured: Capture) -> str | None:
    if captured.head_sure >= UNSURE_HEAD:
        return None
    return (
        f"{options.recording}: head and tail may be exchanged (sure by {captured.head_sure:.2f}, "
        f"from the {captured.head_by}); look at --sheet or --review, and give --head X,Y"
    )


def _unsure_heads(captured: Capture) -> int:
    return int(np.count_nonzero(captured.margin < 0.1))
