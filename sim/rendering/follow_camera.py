"""The camera of a film: it follows a body, shows all of it, and looks over hills that hide it."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.sim.rendering.view_frustum import camera_axes

SMOOTHING_S = 1.2
"""Time constant of the camera's smoothing, in seconds of film."""
TURN_SMOOTHING_S = 4.0
STRIDING_TURN_S = 1.5
"""Time constant of the camera's turn around a body on legs, whose heading does not sway with
waves."""
DISTANCE_LENGTHS = 1.2
"""Distance of the camera from the body, in lengths of the body."""
UPRIGHT_LENGTHS = 1.4
"""Distance of the camera from a body on legs, whose head and horns are above the bones."""
ELEVATIONS_DEG = (19.0, 26.0, 33.0, 40.0, 47.0, 54.0, 61.0, 68.0, 75.0, 82.0)
"""Heights of the camera above the horizon; the first one that sees the body is used."""
LEVEL = 33.0
"""First elevation for a body that lies on the ground: it is best seen from above."""
BEHIND_DEG = (28.0, -28.0, 62.0, -62.0, 118.0, -118.0, 152.0, -152.0)
"""Directions of view from the heading, by preference: behind the body, to its side, before it."""
BESIDE_DEG = (118.0, -118.0, 62.0, -62.0, 152.0, -152.0, 28.0, -28.0)
"""Directions for a body on legs: from behind, the hind legs hide the front legs."""
_RELUCTANCE_DEG = 4.0
"""Decrease of mean elevation that justifies another direction."""
_STRIDE = 5
"""Frames between two tests of the line of sight."""
_SAMPLES = 40
_EDGE = 0.9
"""Share of the half picture in which the body stays."""
_GIRTH = 0.08
"""Reach of the body around its bones, body lengths."""


@dataclass(frozen=True, slots=True)
class BodyTrack:
    """A body in each of F frames, and the picture that shows it."""

    parts_m: Floats
    """(F, P, 3) bones: the spine from the head, then the legs."""
    spine: int
    """Number of bones of the spine."""
    length_m: float
    """Length to show."""
    fps: int
    fovy_deg: float
    aspect: float
    """Width of the picture over its height."""

    @property
    def heading(self) -> Floats:
        """(F, 2) from the tail to the head."""
        return self.parts_m[:, 0, :2] - self.parts_m[:, self.spine - 1, :2]

    @property
    def is_upright(self) -> bool:
        """Whether the body has legs that are longer than their reach to the sides."""
        if self.parts_m.shape[1] - self.spine < 2:  # a tongue is one bone
            return False
        legs = self.parts_m[:, self.spine :]
        middle = self.parts_m[:, : self.spine].mean(axis=1)
        off = legs - middle[:, None]
        left = np.stack([-self.heading[:, 1], self.heading[:, 0]], axis=-1)
        left /= np.maximum(np.hypot(*left.T), 1e-9)[:, None]
        aside = np.abs(np.einsum("fpi,fi->fp", off[..., :2], left)).max(axis=1)
        return bool(np.median(-off[..., 2].min(axis=1)) > np.median(aside))


def follow(track: BodyTrack, ground: HeightField | None) -> Floats:
    """Camera of each frame (F, 6), smoothed in both directions.

    A camera is its look-at point, azimuth and elevation in degrees, and distance.
    """
    parts = track.parts_m
    is_upright = track.is_upright
    lookat = _smooth(0.5 * (parts.min(axis=1) + parts.max(axis=1)), SMOOTHING_S * track.fps)
    turn = _smooth(track.heading, (STRIDING_TURN_S if is_upright else TURN_SMOOTHING_S) * track.fps)
    heading_deg = np.degrees(np.unwrap(np.arctan2(turn[:, 1], turn[:, 0])))
    lengths = UPRIGHT_LENGTHS if is_upright else DISTANCE_LENGTHS
    distance = np.full(len(parts), lengths * track.length_m)
    level = ELEVATIONS_DEG[0] if is_upright else LEVEL
    offsets = BESIDE_DEG if is_upright else BEHIND_DEG
    best = None
    cost = np.inf
    for place, offset in enumerate(offsets):
        plain = np.column_stack([lookat, heading_deg + offset, heading_deg, distance])
        camera = _raised_cameras(track, plain, level, ground)
        rise = float((camera[:, 4] - level).mean()) + _RELUCTANCE_DEG * place
        if rise < cost:
            best = camera
            cost = rise
        if cost <= _RELUCTANCE_DEG * (place + 1):
            break  # no other direction can cost less
    assert best is not None, "there are directions"
    return best


def distance_to_show(track: BodyTrack, camera: Floats) -> Floats:
    """(F,) least distances of cameras (F, 6) from which every bone is in the picture."""
    ahead, right, up = camera_axes(camera[:, 3], -camera[:, 4])
    off = track.parts_m - camera[:, None, :3]
    half = _EDGE * np.tan(np.radians(0.5 * track.fovy_deg))
    girth = _GIRTH * track.length_m
    along = np.einsum("fpi,fi->fp", off, ahead)
    least = [
        (np.abs(np.einsum("fpi,fi->fp", off, axis)) + girth) / reach - along
        for axis, reach in ((right, half * track.aspect), (up, half))
    ]
    return np.asarray(np.maximum(*least).max(axis=1))


def hidden(eye_m: Floats, target_m: Floats, ground: HeightField) -> Bools:
    """(...) whether the ground hides points (..., 3) from an eye (..., 3)."""
    share = np.linspace(0.0, 0.96, _SAMPLES)[:, None]
    line = eye_m[..., None, :] + share * (target_m - eye_m)[..., None, :]
    inside = ground.contains(line[..., 0], line[..., 1])
    above = line[..., 2] > ground.elevation_m(line[..., 0], line[..., 1])
    return np.asarray((inside & ~above).any(axis=-1))


def _raised_cameras(
    track: BodyTrack, plain: Floats, first_deg: float, ground: HeightField | None
) -> Floats:
    """Cameras (F, 6) that rise until the ground hides no bone, or to the last elevation.

    ``first_deg`` replaces the elevations of ``plain`` (F, 6).
    """
    frames = len(plain)
    rows = np.arange(0, frames, _STRIDE)
    shown = track.parts_m[rows][:, np.linspace(0, track.parts_m.shape[1] - 1, 9).astype(int)]
    levels = np.array(
        [elevation_deg for elevation_deg in ELEVATIONS_DEG if elevation_deg >= first_deg]
    )
    level = np.zeros(len(rows), dtype=np.intp)
    camera = plain.copy()
    while True:
        camera[:, 4] = _spread(levels[level][np.arange(frames) // _STRIDE], track.fps)
        least = np.maximum(plain[:, 5], distance_to_show(track, camera))
        camera[:, 5] = _spread(least, track.fps)
        if ground is None:
            return camera
        ahead, _, _ = camera_axes(camera[rows, 3], -camera[rows, 4])
        eye = camera[rows, :3] - camera[rows, 5:] * ahead
        covered = hidden(np.broadcast_to(eye[:, None], shown.shape), shown, ground).any(axis=1)
        covered &= level + 1 < len(levels)
        if not covered.any():
            return camera
        level[covered] += 1


def _smooth(values: Floats, frames: float) -> Floats:
    """Smooth rows (F, n); a constant speed is kept to both ends."""
    if len(values) < 2:
        return values
    beyond = round(4.0 * frames)
    longer = np.pad(values, ((beyond, beyond), (0, 0)), mode="reflect", reflect_type="odd")
    return gaussian_filter1d(longer, frames, axis=0)[beyond:-beyond]


def _spread(values: Floats, fps: int) -> Floats:
    """Smooth values (F,) that never fall below the given ones by much."""
    window = 2 * round(SMOOTHING_S * fps) + 1
    widest = maximum_filter1d(values, window, mode="nearest")
    return gaussian_filter1d(widest, 0.4 * SMOOTHING_S * fps, mode="nearest")
