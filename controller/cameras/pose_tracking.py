"""The pose of a chain of known shape in a frame, near its expected pose.

The joints are measured and the last pose is known, so the complete chain is searched. First its
axis is fitted on a ridge filter of the difference from the floor. Then the middles of the
difference across the body, section by section, are fitted rigidly. Only the surroundings of the
body are used.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from snakewalk.config.arrays import Bools, Floats, Singles
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.markers.floor_markers import Bump
from snakewalk.controller.images.compression import Compression
from snakewalk.controller.images.cross_profile import values_at
from snakewalk.drivers.attitude import about_up
from snakewalk.drivers.least_squares import least_squares

REACH_M = 0.10
"""Largest distance of the body from its believed place."""
_TURN_RAD = 0.15
_STEP_M, _STEP_RAD = 0.0125, 0.0375  # of the search
_ROUNDS = 8
_WIDE_SECTIONS = 2.0  # initial half width of a section, radii
_NARROW_SECTIONS = 1.5  # final one
_LEAST_STEP_M = 3e-4  # a smaller step ends the fit
_SAMPLES = 17
_OUTER_SPOTS = 2  # of them, at each end of a section
_FREE_SECTION = 0.3  # share of the body's contrast there, without another object (ours)
_LEAST_FREE_SHARE = 0.5  # of the sections: with fewer free ones all are used
_TIP_IN_BLOCKS_M = 0.009  # of a tip in a compressed frame, whose sections are worse (ours)
_SECTION_M = 0.003  # usual error of a section's middle
_TIP_M = 0.012  # of a tip: heads and tails differ from the model
_CAP = 0.4  # of the radius: a tip beyond its link
_REGULAR = np.array([1e-6, 1e-6, 1e-6])
_LEAST_SEEN_SHARE = 0.7  # of the sections
_LEAST_HALF_SHARE = 0.5  # of those of each half of the body
_LARGEST_ERROR_RADII = 0.3  # of the radius: largest residual of an accepted fit
_OFF_IN_BLOCKS = 0.2  # the same in a compressed frame (ours)
_TIP_OFF = 1.3  # of the radius: largest distance of a tip
_NO_TIP = "a tip of the body is not where it must be"
_NO_TIP_HIDDEN = np.array([False, False])
_ONE_TIP_HIDDEN = np.array([True, False]), np.array([False, True])
_SURE_SIGMA_M = 0.008  # largest standard deviation of a pose with one hidden tip (ours)
_UNKNOWN = np.array([REACH_M, REACH_M, _TURN_RAD])  # if the frame shows nothing
_COMMON_VARIANCE = 1.0  # adjacent sections have similar errors (ours)
_COMMON_VARIANCE_IN_BLOCKS = 4.0  # the same in a compressed frame (ours)
_SHAPE = 0.04  # radii: common error of all sections, from the body's look (ours)
_THINNEST_SECTION = 0.2
_THICKEST_SECTION = 1.5  # of the body's width: limits of a section's content


ToPixels = Callable[[Floats], Floats]
"""Places (..., 2) in the world, as high as the body's axis, to pixels of the frame."""


@dataclass(frozen=True, slots=True)
class BodyPrior:
    """Expected chain at the time of a frame."""

    links_m: Floats
    """(L, 2) centres of the links in the world, the head's first."""
    forward: Floats
    """(L, 2) directions of the links, towards the head."""


@dataclass(frozen=True, slots=True)
class TrackedPose:
    """Result of a frame for an expected pose."""

    time_s: float
    """Time at which the image was taken."""
    head_m: Floats
    """(2,) centre of the head link."""
    heading_rad: float
    """Heading of the head link, in (-pi, pi]."""
    error_m: float
    """Root of the mean square distance of the sections' middles from the chain."""
    covariance: Floats
    """(3, 3) of the head's x, y (m) and of its heading (rad)."""
    fault: str
    """Reason for rejecting the pose; empty if it is valid."""
    bump: Bump | None = None
    """Bump of the camera since it was set up."""

    @property
    def sigma_m(self) -> float:
        """Standard deviation of the head's place in its least certain direction."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))


@dataclass(frozen=True, slots=True)
class StandingOut:
    """Difference from the floor in a window of a frame."""

    share: Singles
    """(h, w) share of the body in each pixel; 0: floor, 1: body."""
    origin_px: Floats
    """(2,) x, y of its first pixel in the frame."""
    to_px: ToPixels
    compression: Compression | None = None
    """Compression of a frame whose colours are blurred over blocks; None for other frames."""

    def at(self, places_m: Floats) -> Floats:
        """(...,) share at places (..., 2)."""
        return values_at(self.share, self.to_px(places_m) - self.origin_px)


def track_pose(
    robot: RobotConfig, standing_out: StandingOut, prior: BodyPrior, time_s: float
) -> TrackedPose:
    """Find the chain near its expected place.

    The expectation is usually close, so a search is made only if a fit from it fails.
    """
    chain = _chain(robot, prior)
    fit = _fit(robot, standing_out, chain, time_s, (np.zeros(2), 0.0))
    if not fit.fault:
        return fit
    start = _search(standing_out, chain.places_m, chain.middle_m, robot.body_radius_m)
    fit = _fit(robot, standing_out, chain, time_s, start)
    blocks = standing_out.compression
    if fit.fault and blocks is not None and blocks.explains_faults:
        is_blocked = fit.fault == str(blocks)
        return replace(fit, fault=str(blocks) if is_blocked else f"{fit.fault}; {blocks}")
    return fit


@dataclass(frozen=True, slots=True)
class _Chain:
    """Sections and tips of an expected body."""

    places_m: Floats
    """(S, 2) two sections a link."""
    ahead: Floats
    """(S, 2) directions of the body at the stations."""
    tips_m: Floats
    """(2, 2) head's, tail's."""
    out: Floats
    """(2, 2) directions out of the body at its two ends."""
    middle_m: Floats
    """(2,) of the sections."""
    head_m: Floats
    """(2,) of the head link."""
    heading_rad: float


def _chain(robot: RobotConfig, prior: BodyPrior) -> _Chain:
    lengths_m, radii_m = np.array(robot.link_lengths_m), np.array(robot.link_radii_m)
    quarter = (0.25 * lengths_m)[:, None] * prior.forward
    places = np.stack([prior.links_m + quarter, prior.links_m - quarter], 1).reshape(-1, 2)
    reach = 0.5 * lengths_m[[0, -1]] + _CAP * radii_m[[0, -1]]
    out = np.stack([prior.forward[0], -prior.forward[-1]])
    tips = prior.links_m[[0, -1]] + reach[:, None] * out
    heading = float(np.arctan2(prior.forward[0, 1], prior.forward[0, 0]))
    return _Chain(
        places,
        np.repeat(prior.forward, 2, axis=0),
        tips,
        out,
        places.mean(axis=0),
        prior.links_m[0],
        heading,
    )


@dataclass(frozen=True, slots=True)
class _Comparison:
    """A chain at a shift and a turn, compared with a frame."""

    across: Floats
    """(S,) offset of the middle of each section to the left, m."""
    sections: Bools
    """(S,) sections that show a body."""
    used: Bools
    """(S,) of these, sections without another object next to the body, if there are enough."""
    along: Floats
    """(2,) by how much the body ends beyond each tip, m."""
    ends: Bools
    """(2,) tips that are seen."""
    rows: Floats
    """(K, 3) motion of sections and tips for a shift and a turn, in their usual errors."""
    target: Floats
    """(K,) offsets of sections and tips, in their usual errors."""


def _compare_frame(
    robot: RobotConfig,
    standing_out: StandingOut,
    chain: _Chain,
    place: tuple[Floats, float, float],
    hidden: Bools,
) -> _Comparison:
    """Compare at a shift (2,), a turn and a half width of the sections in radii."""
    (shift, turn, wide), radius_m = place, robot.body_radius_m
    spin = about_up(-turn)[:2, :2]
    middle_m = chain.middle_m + shift
    spun_m = (chain.places_m - chain.middle_m) @ spin
    forward = chain.ahead @ spin
    ends_m = (chain.tips_m - chain.middle_m) @ spin
    out = chain.out @ spin
    section_spots, off = _section_spots(spun_m + middle_m, forward, wide * radius_m)
    tip_spots, off_tip = _tip_spots(ends_m + middle_m, out, radius_m)
    value = standing_out.at(
        np.concatenate([section_spots.reshape(-1, 2), tip_spots.reshape(-1, 2)])
    )
    count = section_spots.shape[0] * section_spots.shape[1]
    across, width = _sections(value[:count].reshape(section_spots.shape[:2]), off, radius_m)
    along, ends = _tips(value[count:].reshape(tip_spots.shape[:3]), off_tip)
    sections = (width > _THINNEST_SECTION) & (width < _THICKEST_SECTION)
    ends = ends & ~hidden
    free = _outside_difference(value[:count].reshape(section_spots.shape[:2])) < _FREE_SECTION
    used = sections & free
    if (
        wide != _NARROW_SECTIONS
        or used.mean() < _LEAST_FREE_SHARE
        or standing_out.compression is not None
    ):
        used = sections
    tip_m = _TIP_M if standing_out.compression is None else _TIP_IN_BLOCKS_M
    normal = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    rows = np.concatenate(
        [_rows(spun_m, normal)[used] / _SECTION_M, _rows(ends_m, out)[ends] / tip_m]
    )
    target = np.concatenate([across[used] / _SECTION_M, along[ends] / tip_m])
    return _Comparison(across, sections, used, along, ends, rows, target)


def _fit(
    robot: RobotConfig,
    standing_out: StandingOut,
    chain: _Chain,
    time_s: float,
    start: tuple[Floats, float],
) -> TrackedPose:
    """Fit the chain rigidly from a shift (2,) and a turn about its middle.

    If only one tip is off its place, it counts as hidden.
    """
    first_fit = _fit_tips(robot, standing_out, chain, time_s, start, _NO_TIP_HIDDEN)
    if first_fit.fault != _NO_TIP:
        return first_fit
    tries = (
        _fit_tips(robot, standing_out, chain, time_s, start, hidden) for hidden in _ONE_TIP_HIDDEN
    )
    good = [
        other_fit
        for other_fit in tries
        if not other_fit.fault and other_fit.sigma_m < _SURE_SIGMA_M
    ]
    return min(good, key=lambda candidate_fit: candidate_fit.error_m, default=first_fit)


def _fit_tips(
    robot: RobotConfig,
    standing_out: StandingOut,
    chain: _Chain,
    time_s: float,
    start: tuple[Floats, float],
    hidden: Bools,
) -> TrackedPose:
    shift, turn = start
    wide = _WIDE_SECTIONS
    for left in range(_ROUNDS, 0, -1):
        wide = _NARROW_SECTIONS if left <= _ROUNDS // 2 else wide
        look = _compare_frame(robot, standing_out, chain, (shift, turn, wide), hidden)
        if look.sections.sum() < 3:
            break
        size = np.abs(look.target)
        weight = np.sqrt(_huber_weights(size))
        step = least_squares(look.rows * weight[:, None], look.target * weight, _REGULAR)
        shift = shift + step[:2]
        turn = turn + float(step[2])
        if np.hypot(*step[:2]) < _LEAST_STEP_M:
            if wide == _NARROW_SECTIONS:
                break
            wide = _NARROW_SECTIONS
    spin = about_up(-turn)[:2, :2]
    head = spin.T @ (chain.head_m - chain.middle_m) + chain.middle_m + shift
    heading = chain.heading_rad + turn
    off_m = look.across[look.used]
    error_m = float(np.sqrt(np.mean(off_m**2))) if off_m.size else np.inf
    blocks = standing_out.compression
    alike = _COMMON_VARIANCE if blocks is None else _COMMON_VARIANCE_IN_BLOCKS * blocks.widening**2
    tracked = TrackedPose(
        time_s,
        head,
        float(np.angle(np.exp(1j * heading))),
        error_m,
        _covariance(robot, look, head - chain.middle_m - shift, alike),
        _fault(robot, look, error_m, shift),
    )
    if blocks is None or tracked.fault:
        return tracked
    radius_m = robot.body_radius_m
    is_inaccurate = (
        error_m > _OFF_IN_BLOCKS * radius_m or tracked.sigma_m > blocks.sigma_limit * radius_m
    )
    return replace(tracked, fault=str(blocks)) if is_inaccurate else tracked


def _huber_weights(size: Floats) -> Floats:
    """(N,) weights of errors of some sizes (N,)."""
    usual = max(1.0, 1.4826 * float(np.median(size)))
    return 1.0 / np.maximum(1.0, size / (1.5 * usual))


def _covariance(robot: RobotConfig, look: _Comparison, head_m: Floats, alike: float) -> Floats:
    """(3, 3) of the head at ``head_m`` from the middle of the sections."""
    size = np.abs(look.target)
    weight = _huber_weights(size) if size.size else size
    information = look.rows.T @ (look.rows * weight[:, None]) + np.diag(1.0 / np.square(_UNKNOWN))
    spread = float((weight * size * size).sum()) / max(float(weight.sum()), 1e-9)
    middle = max(1.0, spread) * alike * np.linalg.inv(information)
    carry = np.array([[1.0, 0.0, -head_m[1]], [0.0, 1.0, head_m[0]], [0.0, 0.0, 1.0]])
    least = (_SHAPE * robot.body_radius_m) ** 2
    turn = least / (robot.length_m**2 / 12.0)
    return np.asarray(carry @ (middle + np.diag([least, least, turn])) @ carry.T)


def _search(
    standing_out: StandingOut, places: Floats, middle: Floats, radius_m: float
) -> tuple[Floats, float]:
    """Shift (2,) and turn with the chain's axis best on a ridge."""
    px = standing_out.to_px(middle + np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.01]]))
    grow = (px[1:] - px[0]) / 0.01  # (2, 2) rows: pixels per metre of x, of y
    radius = radius_m * float(np.sqrt(abs(np.linalg.det(grow))))
    ridge = cv2.GaussianBlur(standing_out.share, (0, 0), 0.5 * radius) - cv2.GaussianBlur(
        standing_out.share, (0, 0), 1.5 * radius
    )
    places_px = standing_out.to_px(places) - standing_out.origin_px
    side = np.arange(-REACH_M, REACH_M + 1e-9, _STEP_M)
    turns = np.arange(-_TURN_RAD, _TURN_RAD + 1e-9, _STEP_RAD)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    moves = np.stack([x, y], axis=1) @ grow
    best = -np.inf
    best_move = (np.zeros(2), 0.0)
    rows, columns = ridge.shape
    for turn in turns:
        r = places - middle
        swung = (
            np.stack(
                [
                    (np.cos(turn) - 1.0) * r[:, 0] - np.sin(turn) * r[:, 1],
                    np.sin(turn) * r[:, 0] + (np.cos(turn) - 1.0) * r[:, 1],
                ],
                axis=1,
            )
            @ grow
        )
        spots = np.rint((places_px + swung)[None] + moves[:, None]).astype(np.int32)
        inside = (
            (spots[..., 0] >= 0)
            & (spots[..., 0] < columns)
            & (spots[..., 1] >= 0)
            & (spots[..., 1] < rows)
        )
        value = ridge[np.clip(spots[..., 1], 0, rows - 1), np.clip(spots[..., 0], 0, columns - 1)]
        score = np.where(inside, value, 0.0).mean(axis=1)
        k = int(score.argmax())
        if score[k] > best:
            best = float(score[k])
            best_move = (np.array([x[k], y[k]]), float(turn))
    return best_move


def _section_spots(places_m: Floats, forward: Floats, wide_m: float) -> tuple[Floats, Floats]:
    """Places (S, N, 2) across the chain, and their offsets (N,) to the left."""
    off = np.linspace(-wide_m, wide_m, _SAMPLES)
    normal = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
    return places_m[:, None] + off[:, None] * normal[:, None], off


def _sections(value: Floats, off: Floats, radius_m: float) -> tuple[Floats, Floats]:
    """Left offset (S,) of the middle of the difference, and its width (S,)."""
    content = value.sum(axis=1)
    width = content * (off[1] - off[0]) / (2.0 * radius_m)
    return (value @ off) / np.maximum(content, 1e-9), width


def _outside_difference(value: Floats) -> Floats:
    """(S,) difference at the outer ends of the sections (S, N), on the worse side."""
    return np.asarray(
        np.maximum(value[:, :_OUTER_SPOTS].mean(axis=1), value[:, -_OUTER_SPOTS:].mean(axis=1))
    )


def _tip_spots(tips: Floats, out: Floats, radius_m: float) -> tuple[Floats, Floats]:
    """Places (2, N, 3, 2) along the chain's tips, and their distances (N,) beyond."""
    off = np.linspace(-1.5 * radius_m, 2.5 * radius_m, 2 * _SAMPLES)
    normal = np.stack([-out[:, 1], out[:, 0]], axis=1)
    side = 0.4 * radius_m * np.array([-1.0, 0.0, 1.0])
    spots = (
        tips[:, None, None]
        + off[:, None, None] * out[:, None, None]
        + side[:, None] * normal[:, None, None]
    )
    return spots, off


def _tips(value: Floats, off: Floats) -> tuple[Floats, Bools]:
    """Distances (2,) of the body's ends beyond the chain's tips, and whether they are visible."""
    value = value.max(axis=2)
    end = off[0] + value.sum(axis=1) * (off[1] - off[0])
    is_reported = (value[:, :4].mean(axis=1) > 0.5) & (value[:, -4:].mean(axis=1) < 0.3)
    return end, is_reported


def _rows(r: Floats, direction: Floats) -> Floats:
    """(N, 3) motion of points at ``r`` along ``direction`` for a shift and a turn."""
    turned = direction[:, 1] * r[:, 0] - direction[:, 0] * r[:, 1]
    return np.column_stack([direction, turned])


def _fault(robot: RobotConfig, look: _Comparison, error_m: float, shift: Floats) -> str:
    half = len(look.sections) // 2
    share = float(look.sections.mean())
    halves = look.sections[:half], look.sections[half:]
    if (
        share < _LEAST_SEEN_SHARE
        or min(float(body_half.mean()) for body_half in halves) < _LEAST_HALF_SHARE
    ):
        return f"{100.0 * share:.0f} % of the body is seen where it must be"
    if error_m > _LARGEST_ERROR_RADII * robot.body_radius_m:
        return f"the image lies {error_m * 1e3:.0f} mm off the measured joints"
    if not look.ends.any():
        return "neither tip of the body is seen"
    if np.abs(look.along[look.ends]).max() > _TIP_OFF * robot.body_radius_m:
        return _NO_TIP
    if np.hypot(*shift) > 1.4 * REACH_M:
        return "the image lies too far from the possible places of the body"
    return ""
