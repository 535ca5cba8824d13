"""scikit-image's motorcycle pair (Middlebury 2014) as the single position of a walk-through."""

from pathlib import Path

import numpy as np
import skimage.data
from numpy.typing import NDArray
from PIL import Image

FOCAL_PX, CENTRE_PX, OFFSET_PX, BASELINE_MM = 994.978, (311.193, 254.877), 31.086, 193.001
"""From the documentation of ``skimage.data.stereo_motorcycle``."""


def write_motorcycle(folder: Path, smaller: int = 1) -> Path:
    """Write pictures, calibration and positions; return the positions' file.

    Args:
        folder: is created.
        smaller: reduces the pictures by this factor.

    """
    folder.mkdir(parents=True, exist_ok=True)
    left, right, _ = skimage.data.stereo_motorcycle()  # type: ignore[no-untyped-call]
    for name, picture in (("left.png", left), ("right.png", right)):
        Image.fromarray(picture).reduce(smaller).save(folder / name)
    f, offset = FOCAL_PX / smaller, OFFSET_PX / smaller
    u, v = ((px + 0.5) / smaller - 0.5 for px in CENTRE_PX)
    (folder / "calib.txt").write_text(
        f"cam0=[{f} 0 {u}; 0 {f} {v}; 0 0 1]\n"
        f"cam1=[{f} 0 {u + offset}; 0 {f} {v}; 0 0 1]\n"
        f"doffs={offset}\n"
        f"baseline={BASELINE_MM}\n"
    )
    file = folder / "positions.toml"
    file.write_text(
        'calibration = "calib.txt"\n'
        f"disparities = {80 // smaller}\n\n"
        '[[positions]]\nleft = "left.png"\nright = "right.png"\n'
    )
    return file


def true_depth(smaller: int = 1) -> NDArray[np.float64]:
    """(H, W) true depths in metres; NaN where they are not known."""
    truth = skimage.data.stereo_motorcycle()[2][::smaller, ::smaller]  # type: ignore[no-untyped-call]
    known = np.where(np.isfinite(truth), truth, np.nan)
    return np.asarray(FOCAL_PX * BASELINE_MM / 1000.0 / (known + OFFSET_PX))
