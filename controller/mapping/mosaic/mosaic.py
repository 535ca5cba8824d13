"""3-D mosaic: one model of several views from one place ([KP] 3.6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.mosaic.local_model import LocalModel
from snakewalk.controller.mapping.mosaic.poisson import continued
from snakewalk.controller.mapping.mosaic.scale_matches import match_over_scale

_TOLERANCE_RAD = 0.008
_LEAST_MATCHES = 12
_WIDEST_PICTURES = 4.0
"""Limit of the mosaic's width and height, in pictures (ours): views turned by 60 degrees fit."""


@dataclass(frozen=True, slots=True)
class Mosaic:
    """Model of all views on the image plane of the first one."""

    model: LocalModel
    rotations: Floats
    """(n, 3, 3) from the axes of each view to those of the first."""
    views: tuple[LocalModel, ...]
    """The views on the common plane, turned but not rectified."""
    domain: tuple[Bools, ...]
    """(H, W) part of the mosaic that each view supplies."""


def mosaic(views: Sequence[LocalModel], rectified: bool = True) -> Mosaic:
    """Merge views that differ by a rotation.

    Each view overlaps an earlier one. ``rectified``: Eq. 7 makes each consistent with them.

    Raises:
        InputError: a view does not overlap the earlier ones, or is turned too far.

    """
    turns = _rotations(views)
    camera, size = _common_plane(views, turns)
    placed = [_on_plane(view, turn, camera, size) for view, turn in zip(views, turns, strict=True)]
    points = placed[0].points_m
    image = placed[0].image
    domains = [placed[0].valid]
    for view in placed[1:]:
        is_known = np.isfinite(points[..., 2])
        points_m = view.points_m
        if rectified:
            points_m = continued(points, is_known & view.valid, points_m)
        new = view.valid & ~is_known
        domains.append(new)
        points = np.where(new[..., None], points_m, points)
        image = np.where(new[..., None], view.image, image)
    model = LocalModel(
        np.ascontiguousarray(points), np.ascontiguousarray(image), camera, views[0].baseline_m
    )
    return Mosaic(model, turns, tuple(placed), tuple(domains))


def _rotations(views: Sequence[LocalModel]) -> Floats:
    """(n, 3, 3) rotations from each view's axes to the first one's."""
    turns = [np.eye(3)]
    for k in range(1, len(views)):
        relative = None
        for j in range(k):
            relative = _relative(views[j], views[k])
            if relative is not None:
                turns.append(turns[j] @ relative)
                break
        if relative is None:
            raise InputError(
                f"view {k + 1} does not overlap an earlier view; let neighbours share a third of "
                "their width, and turn the camera about its left lens"
            )
    return np.array(turns)


def _relative(first: LocalModel, second: LocalModel) -> Floats | None:
    """(3, 3) rotation from the second view's axes to the first one's, or None."""
    matches = match_over_scale(first, second, (1.0,), wide=1.0)
    if len(matches.scale) < _LEAST_MATCHES:
        return None
    ray_one, ray_two = (
        _rays(model.camera, places)
        for model, places in ((first, matches.first_px), (second, matches.second_px))
    )
    rng = np.random.default_rng(0)
    best = np.zeros(len(ray_one), bool)
    for _ in range(300):
        pick = rng.choice(len(ray_one), 2, replace=False)
        turn = Rotation.align_vectors(ray_one[pick], ray_two[pick])[0].as_matrix()
        agree = np.linalg.norm(ray_one - ray_two @ turn.T, axis=1) < _TOLERANCE_RAD
        if agree.sum() > best.sum():
            best = agree
    if best.sum() < _LEAST_MATCHES:
        return None
    return Rotation.align_vectors(ray_one[best], ray_two[best])[0].as_matrix()


def _rays(camera: Floats, places_px: Floats) -> Floats:
    """(..., 3) unit directions of pixels (..., 2)."""
    middle = camera[:2, 2]
    focal = np.array([camera[0, 0], camera[1, 1]])
    flat = (places_px - middle) / focal
    rays = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
    return np.asarray(rays / np.linalg.norm(rays, axis=-1, keepdims=True))


def _common_plane(views: Sequence[LocalModel], turns: Floats) -> tuple[Floats, tuple[int, int]]:
    first = views[0].camera
    corners = []
    for view, turn in zip(views, turns, strict=True):
        tall, wide = view.valid.shape
        edge = np.array([[0, 0], [wide - 1, 0], [0, tall - 1], [wide - 1, tall - 1]], float)
        rays = _rays(view.camera, edge) @ turn.T
        if (rays[:, 2] < 0.2).any():
            raise InputError(
                "a view is turned by more than a plane can show; let all views lie within 75 "
                "degrees of the first one's axis"
            )
        corners.append(rays[:, :2] / rays[:, 2:] * [first[0, 0], first[1, 1]] + first[:2, 2])
    low = np.floor(np.min(np.concatenate(corners), axis=0))
    high = np.ceil(np.max(np.concatenate(corners), axis=0))
    half = 0.5 * _WIDEST_PICTURES * np.array(views[0].valid.shape[::-1])
    low = np.maximum(low, np.floor(first[:2, 2] - half)).astype(int)
    high = np.minimum(high, np.ceil(first[:2, 2] + half)).astype(int)
    camera = first.copy()
    camera[:2, 2] -= low
    wide, tall = (int(n) + 1 for n in high - low)
    return camera, (wide, tall)


def _on_plane(view: LocalModel, turn: Floats, camera: Floats, size: tuple[int, int]) -> LocalModel:
    to_view = view.camera @ turn.T @ np.linalg.inv(camera)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    points = cv2.warpPerspective(
        view.points_m @ turn.T,
        to_view,
        size,
        flags=flags,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(np.nan,) * 4,
    )
    image = cv2.warpPerspective(view.image, to_view, size, flags=flags)
    return LocalModel(np.asarray(points, dtype=float), np.asarray(image), camera, view.baseline_m)
