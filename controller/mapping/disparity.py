"""Disparity of a rectified pair: semi-global matching in both directions, then plane fits.

The matching is OpenCV's (H. Hirschmueller, Stereo processing by semiglobal matching and mutual
information, 2008), in eight directions. The images are widened so that the left strip, whose match
is outside OpenCV's range, is matched too.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image, Singles
from snakewalk.config.errors import InputError
from snakewalk.drivers.compiling import compiled, readonly_array

_BLOCK_PX = 3
_SMALL_PENALTIES = {1: (12, 48), 3: (24, 96)}
"""Penalties, by channels, of a step of one pixel and of more, per pixel of a block (ours)."""
_SPECKLE_PX = 60
"""Islands of fewer pixels are dropped (ours)."""
_AGREE_PX = 1.0
"""Largest difference between the disparity of a pixel and that of its match (ours)."""
_UNIQUE_PERCENT = 15
"""Least lead of the best match over any other (ours): under the sky, where nothing is to be seen,
the matches of a hill's edge go on."""
_STEPS = 2
_WINDOW_PX = 7
_LEAST_STEEP = 4.0
"""Mean square of the grey levels' slope per pixel below which noise would shift a window (ours)."""
_MOST_SHIFT_PX = 0.5
_RADIUS_PX = 4
_LEAST_SHARE = 0.4
"""Share of a window's pixels that must lie on the plane of its middle (ours)."""
_TOUCH_PX = 1.0
"""Largest distance from a plane of a pixel that belongs to it (ours)."""


def match(left: Image, right: Image, count: int, least: int = 0, fill_px: int = 0) -> Floats:
    """Disparities (H, W) of the left picture's pixels, NaN if unknown.

    A pixel is known if it matches in both directions, lies on a plane with its neighbours, and is
    not a speck.

    Args:
        left: (H, W) or (H, W, 3), rectified.
        right: the same scene from farther right: a point lies further left in it.
        count: number of disparities from ``least``; rounded up to 16.
        least: least disparity.
        fill_px: gaps of a row up to this width are filled: for views, not for maps, because
            nothing was measured there.

    Raises:
        InputError: pictures of different sizes, or narrower than the range.

    """
    if left.shape != right.shape:
        raise InputError(f"stereo: the pictures are {left.shape} and {right.shape}")
    count = -(-count // 16) * 16
    if not 0 <= least < left.shape[1] - 16 or count > left.shape[1]:
        raise InputError(
            f"stereo: {count} disparities from {least} on leave pictures {left.shape[1]} px wide"
        )
    there = _match_one_way(left, right, count, least)
    back = _match_one_way(_mirrored_picture(right), _mirrored_picture(left), count, least)[:, ::-1]
    column = np.arange(left.shape[1])[None]
    other_column = np.rint(column - np.nan_to_num(there)).astype(np.intp)
    other = np.take_along_axis(back, np.clip(other_column, 0, None), axis=1)
    with np.errstate(invalid="ignore"):
        agree = (np.abs(there - other) <= _AGREE_PX) & (other_column >= 0)
    checked = np.where(agree, there, np.nan)
    for _ in range(_STEPS):
        checked = _aligned_windows(left, right, checked)
    smooth = np.empty_like(checked)
    _on_planes(checked, smooth, _RADIUS_PX, _TOUCH_PX, _LEAST_SHARE)
    return _filled_gaps(_without_specks(smooth, least), fill_px)


def _filled_gaps(disparity: Floats, most_px: int) -> Floats:
    """Fill short gaps of each row: between ends that agree in a straight line.

    Otherwise the gap is hidden from one camera, so it belongs to the farther side (Hirschmueller
    2008, 2.7).
    """
    if not most_px:
        return disparity
    column = np.arange(disparity.shape[1])
    is_known = np.isfinite(disparity)
    before = np.maximum.accumulate(np.where(is_known, column, -1), axis=1)
    after = np.minimum.accumulate(np.where(is_known, column, len(column))[:, ::-1], axis=1)[:, ::-1]
    between = (before >= 0) & (after < len(column)) & ~is_known & (after - before <= most_px + 1)
    row, column_index = np.nonzero(between)
    first, last = before[between], after[between]
    left_end, other = disparity[row, first], disparity[row, last]
    share = (column_index - first) / (last - first)
    out = disparity.copy()
    near = np.abs(left_end - other) <= _AGREE_PX
    out[between] = np.where(
        near, left_end + share * (other - left_end), np.minimum(left_end, other)
    )
    return out


def _match_one_way(left: Image, right: Image, count: int, least: int) -> Floats:
    channels = 1 if left.ndim == 2 else left.shape[2]
    small, large = (value * _BLOCK_PX**2 for value in _SMALL_PENALTIES[channels])
    matcher = cv2.StereoSGBM.create(
        minDisparity=least,
        numDisparities=count,
        blockSize=_BLOCK_PX,
        P1=small,
        P2=large,
        disp12MaxDiff=-1,
        preFilterCap=31,
        uniquenessRatio=_UNIQUE_PERCENT,
        mode=cv2.STEREO_SGBM_MODE_HH,
    )
    wide = [
        cv2.copyMakeBorder(picture, 0, 0, count + least, 0, cv2.BORDER_REPLICATE)
        for picture in (left, right)
    ]
    disparity = matcher.compute(*wide)[:, count + least :].astype(float) / 16.0
    disparity[disparity < max(least, 0.5)] = np.nan
    return disparity


def _aligned_windows(left: Image, right: Image, disparity: Floats) -> Floats:
    """Shift each pixel's window by least squares of the grey levels.

    Semi-global matching finds fractions from three costs, which biases them to whole pixels. This
    step of B. D. Lucas and T. Kanade (1981) along the row removes the bias.
    """
    grey = [picture if picture.ndim == 2 else picture.mean(axis=2) for picture in (left, right)]
    left_picture, two = (np.asarray(picture, dtype=np.float32) for picture in grey)
    rows, columns = disparity.shape
    u, v = np.meshgrid(np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32))
    source_column = u - np.nan_to_num(disparity).astype(np.float32)
    slope = cv2.Sobel(two, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    matched, slope = (
        np.asarray(
            cv2.remap(picture, source_column, v, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        )
        for picture in (two, slope)
    )
    is_matched = np.isfinite(disparity).astype(np.float32)
    count = np.maximum(_box(is_matched), 1e-6)
    off = (left_picture - matched) - _box(
        is_matched * (left_picture - matched)
    ) / count  # one camera may be brighter
    steep = _box(is_matched * slope * slope) / count
    shift = -_box(is_matched * slope * off) / count / np.maximum(steep, _LEAST_STEEP)
    return np.asarray(disparity + np.clip(shift, -_MOST_SHIFT_PX, _MOST_SHIFT_PX), dtype=float)


def _box(values: NDArray[np.floating]) -> Singles:
    return np.asarray(cv2.blur(values, (_WINDOW_PX, _WINDOW_PX)), dtype=np.float32)


def _mirrored_picture(picture: Image) -> Image:
    return np.ascontiguousarray(picture[:, ::-1])


def _without_specks(disparity: Floats, least: int) -> Floats:
    steps = np.nan_to_num(disparity * 16.0, nan=16.0 * (least - 1)).astype(np.int16)
    cv2.filterSpeckles(steps, 16 * (least - 1), _SPECKLE_PX, 16)
    return np.where(steps == 16 * (least - 1), np.nan, disparity)


@compiled(
    f"void({readonly_array(dimensions=2, layout='C')}, float64[:, ::1], int64, float64, float64)"
)
def _on_planes(  # noqa: C901  a compiled loop
    disparity: Floats, smooth: Floats, radius: int, touch: float, least_share: float
) -> None:
    """Write the value of the plane fitted to the pixels around each that are close to it.

    Slanted ground is a plane in disparity; a mean would flatten it. Two rounds: the pixels near the
    middle's value, then those near the first plane. NaN if too few pixels of the window are on it.
    """
    rows, columns = disparity.shape
    window_px = (2 * radius + 1) ** 2
    for i in range(rows):
        for j in range(columns):
            smooth[i, j] = np.nan
            middle = disparity[i, j]
            if np.isnan(middle):
                continue
            a, b, c = 0.0, 0.0, middle
            count = 0.0
            for turn in range(3):
                reach = touch + 1.0 if turn == 0 else touch
                n = sx = sy = sz = sxx = sxy = syy = sxz = syz = 0.0
                for p in range(max(i - radius, 0), min(i + radius + 1, rows)):
                    for q in range(max(j - radius, 0), min(j + radius + 1, columns)):
                        z = disparity[p, q]
                        y, x = float(p - i), float(q - j)
                        if abs(z - (a * x + b * y + c)) <= reach:  # false for NaN
                            n += 1.0
                            sx += x
                            sy += y
                            sz += z
                            sxx += x * x
                            sxy += x * y
                            syy += y * y
                            sxz += x * z
                            syz += y * z
                count = n
                if n < least_share * window_px:
                    break
                mx, my, mz = sx / n, sy / n, sz / n
                vxx = sxx / n - mx * mx
                vxy = sxy / n - mx * my
                vyy = syy / n - my * my
                vxz = sxz / n - mx * mz
                vyz = syz / n - my * mz
                det = vxx * vyy - vxy * vxy
                if det < 1e-6:
                    break
                a = (vxz * vyy - vyz * vxy) / det
                b = (vyz * vxx - vxz * vxy) / det
                c = mz - a * mx - b * my
            if count >= least_share * window_px and abs(c - middle) <= touch:
                smooth[i, j] = c
