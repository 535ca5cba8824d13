"""The body model: an ellipse at each skeleton point ([PT] 2.2).

Its half width is the distance to the silhouette's boundary in the top view. Its half height follows
from a constant ratio, or from a side view.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.archive import read_arrays
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.images.body_detector import make_detector
from snakewalk.controller.images.video import IMAGES, read_image
from snakewalk.controller.track.frame_status import FrameStatus
from snakewalk.controller.track.resample import SEGMENTS, equal_arc_length

ASPECT = 0.85
"""Default height over width: a snake is a little flatter than round."""
THICKEST = 0.025
"""Default half width over length."""
_PAIRS = (("points_px", "radius_px"), ("points", "radius_m"), ("skeletons", "radius_px"))


@dataclass(frozen=True, slots=True)
class BodyModel:
    """Cross sections at 101 points of equal arc length, head first; lengths over the body's."""

    half_width: Floats
    """(101,) half axes of the ellipses to the sides."""
    half_height: Floats
    """(101,) half axes upwards."""
    length_m: float | None
    """Length of the body; None without scale."""
    measured: bool
    """Whether the widths come from a recording."""

    @property
    def profile(self) -> tuple[float, ...]:
        """Nine relative half widths, largest 1: ``body_profile`` of a robot's file.

        Means over an eighth of the body each: a skeleton's tips have no width.
        """
        along = np.linspace(0.0, 1.0, len(self.half_width))
        near = np.abs(along[None] - np.linspace(0.0, 1.0, 9)[:, None]) <= 1.0 / 16.0
        radius = (near * self.half_width).sum(axis=1) / near.sum(axis=1)
        return tuple(round(max(0.06, float(r)), 3) for r in radius / radius.max())


@dataclass(frozen=True, slots=True)
class Silhouettes:
    """Skeletons with their distances to the boundary, as a file holds them."""

    points: Floats
    """(T, P, 2), in the file's unit."""
    radius: Floats
    """(T, P) radii in the file's unit."""
    length_m: float | None
    pixels: bool
    """Whether the points are pixels, rows downwards."""


def spindle(length_m: float | None = None) -> BodyModel:
    """A plain body for recordings without widths: a slim neck, thickest before the middle."""
    s = np.linspace(0.0, 1.0, SEGMENTS + 1)
    rise = 0.80 + 0.20 * np.sin(0.5 * np.pi * np.minimum(s / 0.55, 1.0))
    fall = 1.0 - 0.85 * np.clip((s - 0.55) / 0.45, 0.0, None) ** 1.5
    width = THICKEST * rise * fall
    return BodyModel(width, ASPECT * width, length_m, measured=False)


def read_silhouettes(file: Path) -> Silhouettes:
    """Read skeletons and radii from an .npz, or find the one body in a picture, thicker end first.

    An .npz contains points and radii of one unit: ``points_px`` and ``radius_px``, ``points`` and
    ``radius_m``, or ``skeletons`` and ``radius_px`` or ``width`` (whole widths). Radii are (T, P),
    (P,) or, of the segments, one fewer.

    Raises:
        InputError: no such file, arrays or body, or the shapes of the arrays do not match.

    """
    if file.suffix.lower() in IMAGES:
        return _in_picture(file)
    try:
        arrays, _ = read_arrays(file)
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except (ValueError, OSError):
        raise InputError(f"{file}: a body is made of an .npz with skeletons and widths") from None
    if "width" in arrays and arrays["width"].dtype.kind == "f":
        arrays.setdefault("radius_px", 0.5 * arrays["width"])
    for where, how in _PAIRS:
        if where in arrays and how in arrays:
            points = arrays[where].astype(float)
            radius = arrays[how].astype(float)
            break
    else:
        raise InputError(
            f"{file}: expected points_px and radius_px, points and radius_m, or skeletons and "
            f"width; found {', '.join(sorted(arrays))}"
        )
    if points.ndim != 3 or points.shape[-1] != 2 or points.shape[1] < 4:
        raise InputError(f"{file}: {where} must be (frames, 4 or more, 2), not {points.shape}")
    count = points.shape[1]
    if radius.shape[-1] == count - 1:
        ends = np.concatenate([radius[..., :1], radius, radius[..., -1:]], axis=-1)
        radius = 0.5 * (ends[..., 1:] + ends[..., :-1])
    if radius.shape not in ((count,), points.shape[:2]):
        raise InputError(f"{file}: {how} {radius.shape} does not fit {where} {points.shape}")
    length = arrays.get("length_m", np.array(np.nan))
    length_m = float(length) if length.size == 1 and np.isfinite(length) else None
    return Silhouettes(
        points, np.broadcast_to(radius, points.shape[:2]), length_m, where != "points"
    )


def _in_picture(file: Path) -> Silhouettes:
    image = read_image(file)
    body = make_detector([image]).detect(image).skeleton
    if body.status is not FrameStatus.GOOD:
        raise InputError(
            f"{file}: {body.status}; photograph one body alone, on an even ground in another colour"
        )
    if body.radius_px[:50].mean() < body.radius_px.mean():
        body = body.reversed()
    radius_px = gaussian_filter1d(body.radius_px, 2.0)  # distances change by whole pixels
    return Silhouettes(body.points_px[None], radius_px[None], None, pixels=True)


def body_model(
    top: Silhouettes, side: Silhouettes | None = None, aspect: float = ASPECT
) -> BodyModel:
    """Median cross sections of all frames that hold a whole body.

    Args:
        top: view from above.
        side: view from the side; None uses ``aspect``.
        aspect: height over width.

    Raises:
        InputError: no complete frame, or an aspect out of range.

    """
    if not 0.1 <= aspect <= 10.0:
        raise InputError(f"aspect: height over width must be from 0.1 to 10, not {aspect}")
    width = _median_radius(top)
    height = aspect * width if side is None else _median_radius(side)
    return BodyModel(width, height, top.length_m, measured=True)


def _median_radius(body: Silhouettes) -> Floats:
    """(101,) radii over the body's length."""
    is_complete = np.isfinite(body.points).all(axis=(1, 2)) & np.isfinite(body.radius).all(axis=1)
    if not is_complete.any():
        raise InputError("body: no frame contains a complete skeleton with its widths")
    chord = np.hypot(*np.diff(body.points[is_complete], axis=1).transpose(2, 0, 1))
    length = chord.sum(axis=1)
    arc = np.concatenate([np.zeros((len(chord), 1)), np.cumsum(chord, axis=1)], axis=1)
    station = np.linspace(0.0, 1.0, SEGMENTS + 1)
    even = [
        np.interp(station, a / d, r) / d
        for a, d, r in zip(arc, length, body.radius[is_complete], strict=True)
    ]
    radius = np.median(even, axis=0)
    if not (radius >= 0.0).all() or radius.max() <= 0.0:
        raise InputError("body: the widths must be above 0")
    return np.asarray(radius)


def pose(points: Floats) -> Floats:
    """Skeleton (101, 2) of one frame at equal arcs, body lengths, head's tip at the origin.

    Raises:
        ValueError: fewer than 4 distinct points.

    """
    even = equal_arc_length(points)
    length = np.hypot(*np.diff(even, axis=0).T).sum()
    return np.asarray((even - even[0]) / length)


def straight() -> Floats:
    """Skeleton (101, 2) of a straight body that faces along x."""
    return np.stack([-np.linspace(0.0, 1.0, SEGMENTS + 1), np.zeros(SEGMENTS + 1)], axis=-1)
