"""One recording captured: frames read, seen, followed, written and drawn."""

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError
from snakewalk.controller.app.report.plots.capture import contact_sheet, overlay_film, step_picture
from snakewalk.controller.app.result_files import atomic_write, refuse_to_overwrite
from snakewalk.controller.capture.body_detector import BodyDetector, make_detector
from snakewalk.controller.capture.capture import Capture, capture, save_capture
from snakewalk.controller.capture.image.video import Footage, open_footage, read_image
from snakewalk.controller.capture.scale import scale_of_length, scale_of_marker

_SAMPLE = 25  # frames from which the background is learnt
_FILMS = (".mp4", ".mkv", ".avi")
_SHEETS = (".png", ".jpg", ".jpeg")


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the command line was told; see its help."""

    recording: Path
    output: Path
    background: Path | None = None
    length_m: float | None = None
    marker: str | None = None
    rate_hz: float | None = None
    head: str | None = None
    cropped: bool = False
    overlay: Path | None = None
    sheet: Path | None = None
    steps: Path | None = None
    force: bool = False


def capture_file(wanted: Wanted) -> dict[str, object]:
    """Do all that is wanted, and tell what was found.

    Raises:
        InputError: nothing that can be used in the recording, a result that exists, a bad option.

    """
    _check(wanted)
    footage = open_footage(wanted.recording, wanted.rate_hz)
    head_px = None if wanted.head is None else _place(wanted.head)
    console = Console(stderr=True)
    with console.status("learning the background ..."):
        some = footage.some(_SAMPLE)
        given = None if wanted.background is None else _like(read_image(wanted.background), some[0])
        detector = make_detector(some, given)
        m_per_px = None
        if wanted.marker is not None:
            ground = some[0] if detector.background is None else detector.background
            m_per_px = scale_of_marker(wanted.marker, ground)
    fixed = not wanted.cropped and len({frame.shape for frame in some}) == 1
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("frames", total=footage.count)
        captured = capture(
            footage.read(),
            detector,
            footage.rate_hz,
            name=str(wanted.recording),
            head_px=head_px,
            fixed=fixed,
            on_progress=lambda: progress.advance(task),
        )
        if wanted.length_m is not None:
            m_per_px = scale_of_length(wanted.length_m, captured.length_px)
        with atomic_write(wanted.output) as part:
            save_capture(
                part,
                captured,
                name=wanted.recording.stem,
                m_per_px=m_per_px,
                source=f"captured from {wanted.recording.name}",
            )
        if wanted.sheet is not None:
            contact_sheet(wanted.sheet, footage.read(), captured)
        if wanted.steps is not None:
            number = int(np.argmax(captured.used))
            image = next(islice(footage.read(), number, None))
            step_picture(wanted.steps, image, detector, captured.points_px[number])
        if wanted.overlay is not None:
            task = progress.add_task("overlay film", total=footage.count)
            overlay_film(wanted.overlay, footage.read(), captured, lambda: progress.advance(task))
    return _facts(wanted, footage, detector, captured, m_per_px)


def _check(wanted: Wanted) -> None:
    if wanted.length_m is not None and wanted.marker is not None:
        raise InputError("--length-m and --marker both give the scale: say one of them")
    if wanted.length_m is not None and not 0.0 < wanted.length_m < float("inf"):
        raise InputError(f"--length-m: the animal must be longer than 0 m, not {wanted.length_m}")
    if wanted.output.suffix.lower() != ".npz":
        raise InputError(f"{wanted.output}: a track is an .npz")
    if wanted.overlay is not None and wanted.overlay.suffix.lower() not in _FILMS:
        raise InputError(f"{wanted.overlay}: an overlay film is one of {', '.join(_FILMS)}")
    for picture in (wanted.sheet, wanted.steps):
        if picture is not None and picture.suffix.lower() not in _SHEETS:
            raise InputError(f"{picture}: a picture is one of {', '.join(_SHEETS)}")
    refuse_to_overwrite([wanted.output, wanted.overlay, wanted.sheet, wanted.steps], wanted.force)


def _place(said: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in said.split(","))
    except ValueError:
        raise InputError(f"--head {said}: expected X,Y in pixels") from None
    if not np.isfinite([x, y]).all():
        raise InputError(f"--head {said}: expected X,Y in pixels")
    return x, y


def _like(background: Image, frame: Image) -> Image:
    """Grey where the frames are grey, colour where they are in colour."""
    if background.ndim == frame.ndim:
        return background
    if frame.ndim == 3:
        return np.dstack([background] * 3)
    return np.asarray(np.rint(background.mean(axis=2)), dtype=np.uint8)


def _facts(
    wanted: Wanted,
    footage: Footage,
    detector: BodyDetector,
    captured: Capture,
    m_per_px: float | None,
) -> dict[str, object]:
    length_px = float(np.nanmedian(captured.length_px))
    known = captured.expected_px[np.isfinite(captured.expected_px)]
    error_px = float(np.median(known)) if known.size else float("nan")
    unsure = int(np.count_nonzero(captured.margin < 0.1))
    return {
        "recording": str(wanted.recording),
        "track": str(wanted.output),
        "frames": len(captured.status),
        "frames_used": int(captured.used.sum()),
        "frames_rough": int((captured.used & ~captured.good).sum()),
        "frames_with_company": int(captured.with_distractors.sum()),
        "verdicts": captured.counts,
        "rate_hz": footage.rate_hz,
        "rate_assumed": footage.rate_assumed,
        "background": detector.background_source,
        "animal": str(detector.polarity),
        "length_px": round(length_px, 2),
        "expected_error_px": None if np.isnan(error_px) else round(error_px, 3),
        "length_m": None if m_per_px is None else round(length_px * m_per_px, 5),
        "head_by": captured.head_by,
        "head_sure": round(captured.head_sure, 3),
        "frames_with_unsure_head": unsure,
    }
