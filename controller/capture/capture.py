"""A whole recording captured: bodies detected, outliers marked, head and tail kept."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.capture.image_file import scaled
from snakewalk.controller.capture.staged_film import StagedFilm, arrays_of
from snakewalk.controller.capture.stages.pipeline import stages
from snakewalk.controller.images.medial_axis import SEGMENTS, Skeleton, no_skeleton
from snakewalk.controller.track.frame_status import FrameStatus

_DISTRACTOR = 0.08  # of the body's area: more than dirt and noise
_OF_FRAMES = (
    "length_px",
    "head_margin",
    "expected_px",
    "company",
    "time_s",
)  # arrays (T,) of a file
_OF_FILM = ("rate_hz", "m_per_px", "head_sure", "rate_assumed", "places_recorded")  # single values
_STILL_BODY = 0.02  # of the length: a smaller change does not count as motion


ADVICE = {
    FrameStatus.NOTHING: "no contrast or no motion: nothing stands out from the background; "
    "give --background, or better light",
    FrameStatus.SEVERAL: "several animals: give --animals N or --animals auto",
    FrameStatus.CUT: "the body is cut by the edge of the image; give a larger --roi, or film more "
    "of the ground",
    FrameStatus.BLOB: "the clearest object is not a long body; give --roi around the animal",
}
"""Remedies for a film by the commonest status of its frames."""


class RejectedFilmError(InputError):
    """A film from which no track can be made with these options."""


class UnusableFilmError(RejectedFilmError):
    """Too few frames can be used; the commonest reason, and what would help."""

    def __init__(self, name: str, skeletons: Sequence[Skeleton]) -> None:
        """Find the commonest status of the frames of the film called ``name``."""
        reasons = [
            skeleton.status for skeleton in skeletons if skeleton.status is not FrameStatus.GOOD
        ]
        self.reason: FrameStatus | None = None
        """Commonest status of the frames without points; None: the film is too short."""
        if not reasons:
            super().__init__(f"{name}: one frame shows no motion; film longer")
            return
        self.reason = worst = max(dict.fromkeys(reasons), key=reasons.count)
        advice = ADVICE.get(
            worst,
            f"the body is never completely visible: {worst}; film until it is, or give --threshold",
        )
        super().__init__(f"{name}: {advice} ({reasons.count(worst)} of {len(skeletons)} frames)")


@dataclass(frozen=True, slots=True)
class Capture:
    """A recording as skeletons; all its T frames, NaN where neither ``good`` nor ``rough``."""

    points_px: Floats
    """(T, 101, 2) x, y, head first, 100 equal chords; y downwards."""
    radius_px: Floats
    """(T, 101) half the body's thickness."""
    length_px: Floats
    """(T,) length of the body in each frame, px."""
    status: tuple[FrameStatus, ...]
    expected_px: Floats
    """(T,) expected mean error of a point; NaN for a frame without a skeleton. Above a hundredth of
    the length the status is ``rough``: the frame has points, but they are less accurate than
    wanted."""
    distractors: Floats
    """(T,) area of the next largest object that stands out, over the body's."""
    margin: Floats
    """(T,) how surely the head is where it was in the frame before: ``identity.margins``."""
    rate_hz: float
    time_s: Floats
    """(T,) when the frames were taken; uneven where the film says so."""
    head_by: str
    """How head and tail were distinguished: ``given``, or the clearest sign of ``head.GROUPS``."""
    head_sure: float
    """Certainty of the distinction of head and tail, 0 to 1."""
    places_recorded: bool = True
    """Whether the points of all frames share one origin; images cropped to the animal have none."""

    @property
    def head_probability(self) -> float:
        """Probability that the head is first; calibrated on films with known heads."""
        return 0.5 * (1.0 + self.head_sure)

    @property
    def good(self) -> Bools:
        """(T,) frames whose points are expected within a hundredth of the length."""
        return np.array([frame_status is FrameStatus.GOOD for frame_status in self.status])

    @property
    def used(self) -> Bools:
        """(T,) frames that hold a skeleton, good or rough."""
        return np.isfinite(self.length_px)

    @property
    def with_distractors(self) -> Bools:
        """(T,) frames in which another object, larger than a speck, stands out: a small animal."""
        return self.distractors > _DISTRACTOR

    def roughened(self, least: float) -> "Capture":
        """Return the capture without good frames; errors are at least ``least`` of the length."""
        rough = {FrameStatus.GOOD: FrameStatus.ROUGH}
        return replace(
            self,
            expected_px=np.fmax(self.expected_px, least * self.length_px),
            status=tuple(rough.get(frame_status, frame_status) for frame_status in self.status),
        )

    def skeleton(self, k: int) -> Skeleton:
        """Return the body of a frame, independent of these arrays."""
        length_px = float(self.length_px[k])
        points_px, radius_px = self.points_px[k].copy(), self.radius_px[k].copy()
        return Skeleton(points_px, radius_px, length_px, self.status[k])

    @property
    def counts(self) -> dict[str, int]:
        """Frames of each status that occurs."""
        return {str(v): self.status.count(v) for v in FrameStatus if v in self.status}


def captured_from(
    detections: Detections,
    rate_hz: float,
    *,
    name: str = "recording",
    head_px: tuple[float, float] | None = None,
    fixed: bool = True,
    part: bool = False,
) -> Capture:
    """Make a capture of the detections of a film; see ``animal capture``.

    A ``part`` of a film may be without motion or without any body.
    """
    nan = np.full(len(detections.skeletons), np.nan)
    film = StagedFilm(
        detections, tuple(detections.skeletons), nan, nan > 0.0, rate_hz, fixed, head_px
    )
    for stage in stages():
        film = stage.run(film)
        if sum(skeleton.status.has_points for skeleton in film.skeletons) < 2:
            if part:
                return _without_body(film)
            raise UnusableFilmError(name, film.skeletons)
    captured = _captured(film)
    if not part and _change(captured) < _STILL_BODY:
        raise RejectedFilmError(
            f"{name}: no motion: the body changes by less than {_STILL_BODY:.0%} of its length in "
            f"{len(film.skeletons)} frames; film while it moves"
        )
    return captured


def _captured(film: StagedFilm) -> Capture:
    score, by = film.head
    return Capture(
        **arrays_of(film.skeletons),
        expected_px=film.expected_px,
        distractors=np.array(film.detections.distractors),
        rate_hz=film.rate_hz,
        time_s=np.arange(len(film.skeletons)) / film.rate_hz,
        head_by=by,
        head_sure=min(1.0, abs(score)),
        places_recorded=film.fixed,
    )


def _without_body(film: StagedFilm) -> Capture:
    """Return a part of a film in which no body is seen well."""
    bodies = [
        no_skeleton(FrameStatus.BLOB if skeleton.status.has_points else skeleton.status)
        for skeleton in film.skeletons
    ]
    nan = np.full(len(bodies), np.nan)
    return _captured(replace(film, skeletons=tuple(bodies), expected_px=nan, head=(0.0, "taper")))


@dataclass(frozen=True, slots=True)
class CaptureFile:
    """Content of a file of a captured recording."""

    captured: Capture
    name: str
    m_per_px: float | None = None
    """Scale of the picture; None: unknown."""
    rate_assumed: bool = False
    source: str = "not stated"
    licence: str = "not stated"
    identity_uncertain_after: tuple[int, ...] = ()
    """Frames after which it may be another animal of the film."""

    @property
    def fingerprint(self) -> str:
        """Digest of the points: another capture, or a corrected one, has another digest."""
        points = np.ascontiguousarray(self.captured.points_px, dtype="<f8")
        return hashlib.sha256(points.tobytes()).hexdigest()[:16]


_FIELDS = fields(Capture)
_KEYS = {"status": "verdict", "margin": "head_margin", "distractors": "company"}
"""Names in a file of fields that have other names there."""


def save_capture(path: Path, file: CaptureFile) -> None:
    """Write an .npz that ``load_track`` reads, with the track and the data of every frame.

    The track consists of ``points`` (T, 101, 2) head first, m (pixels without a scale), y upwards;
    ``rate_hz``, ``time_s`` (T,), ``rate_assumed``, ``length_m`` (NaN: no scale), ``name``,
    ``source``, ``licence``. Each frame, used or not, has ``verdict`` (T,) its status in words,
    ``points_px`` (T, 101, 2) as in the image, ``radius_px`` (T, 101), ``length_px`` (T,), and
    ``head_margin`` (T,). It also has ``expected_px`` (T,), the error of a point, and ``company``
    (T,), the size of the next largest object. Once: ``m_per_px`` (NaN: no scale), ``head_by``,
    ``head_sure``, ``head_probability``, ``places_recorded``, and if the film shows several animals
    ``identity_uncertain_after``: frames after which it may be another animal.
    """
    captured = file.captured
    scale = 1.0 if file.m_per_px is None else file.m_per_px
    length_m = np.nan if file.m_per_px is None else float(np.nanmedian(captured.length_px)) * scale
    doubts = file.identity_uncertain_after
    more: dict[str, Any] = {"identity_uncertain_after": np.array(doubts)} if doubts else {}
    values = {_KEYS.get(entry.name, entry.name): getattr(captured, entry.name) for entry in _FIELDS}
    values["verdict"] = np.array([*map(str, captured.status)])
    with path.open("wb") as stream:
        np.savez_compressed(
            stream,
            **values,
            points=scaled(captured.points_px, (scale, -scale), (0.0, 0.0), path.parent),
            rate_assumed=file.rate_assumed,
            length_m=length_m,
            name=file.name,
            source=file.source,
            licence=file.licence,
            m_per_px=np.nan if file.m_per_px is None else file.m_per_px,
            head_probability=captured.head_probability,
            **more,
        )


def load_capture(path: Path) -> CaptureFile:
    """Read what ``save_capture`` wrote.

    Raises:
        InputError: it was not captured from a film.
        OSError: it cannot be read.

    """
    try:
        arrays, _ = read_arrays(path)
    except ValueError:
        raise InputError(f"{path}: is no .npz; give a track that `animal capture` wrote") from None
    frames = len(arrays["verdict"]) if "verdict" in arrays and arrays["verdict"].ndim == 1 else 0
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(_OF_FRAMES, (frames,)),
        **dict.fromkeys(_OF_FILM, ()),
        "points_px": (frames, SEGMENTS + 1, 2),
        "radius_px": (frames, SEGMENTS + 1),
    }
    verdicts = {*map(str, FrameStatus)}
    is_complete = (
        frames > 0
        and {*map(str, arrays["verdict"])} <= verdicts
        and all(
            name in arrays and arrays[name].shape == shape and arrays[name].dtype.kind in "biuf"
            for name, shape in shapes.items()
        )
        and {"name", "source", "licence", "head_by"} <= arrays.keys()
    )
    if not is_complete:
        raise InputError(
            f"{path}: is not a track that `animal capture` wrote: data of its frames are "
            "missing; choose another file"
        )
    scale = float(arrays["m_per_px"])
    values: dict[str, Any] = {}
    for entry in _FIELDS:
        value = arrays[_KEYS.get(entry.name, entry.name)]
        is_list = entry.type == Floats
        values[entry.name] = np.asarray(value, dtype=float) if is_list else value.tolist()
    values["status"] = tuple(map(FrameStatus, values["status"]))
    return CaptureFile(
        Capture(**values),
        name=str(arrays["name"]),
        m_per_px=scale if np.isfinite(scale) else None,
        rate_assumed=bool(arrays["rate_assumed"]),
        source=str(arrays["source"]),
        licence=str(arrays["licence"]),
        identity_uncertain_after=tuple(
            int(number) for number in np.ravel(arrays.get("identity_uncertain_after", ()))
        ),
    )


def _change(captured: Capture) -> float:
    """Greatest mean change of place or shape since the first frame, in body lengths."""
    good = captured.points_px[captured.used]
    length = float(captured.length_px[captured.used][0])
    return float(np.hypot(*(good - good[0]).transpose(2, 0, 1)).mean(axis=1).max()) / length
