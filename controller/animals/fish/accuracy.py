"""Found postures against known ones: errors of spine angles, head and place."""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.controller.animals.fish.postures import Postures


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Errors over the frames that have a known and an estimated posture."""

    angles_rad: Floats
    """(n, J) absolute error of each spine angle."""
    head_rad: Floats
    """(n,) absolute error of the head's direction."""
    skeleton: Floats
    """(n,) mean distance between the two skeletons, body lengths, once one shift and one size for
    the whole film are taken out."""
    length_ratio: float
    """Length of the found fish in true body lengths."""
    turned_round: int
    """Frames in which head and tail are exchanged."""
    pitch_rad: Floats | None
    """(n,) absolute error of the pitch, where both know it."""
    height: Floats | None
    """(n,) absolute error of the height, body lengths, one shift of the film taken out."""

    def to_dict(self) -> dict[str, object]:
        """Medians and 95th percentiles, degrees and percent of body length."""
        spine = np.degrees(self.angles_rad)
        facts: dict[str, object] = {
            "angle_error_deg": np.median(spine, axis=0).round(2).tolist(),
            "angle_error_95_deg": np.percentile(spine, 95.0, axis=0).round(2).tolist(),
            "head_error_deg": _median_and_p95(np.degrees(self.head_rad)),
            "length_found_percent": round(100.0 * self.length_ratio, 1),
            "skeleton_error_percent": _median_and_p95(100.0 * self.skeleton),
            "turned_round": self.turned_round,
        }
        if self.pitch_rad is not None and self.height is not None:
            facts["pitch_error_deg"] = _median_and_p95(np.degrees(self.pitch_rad))
            facts["height_error_percent"] = _median_and_p95(100.0 * self.height)
        return facts


def compare(estimated: Postures, truth: Postures) -> Accuracy:
    """Compare frame by frame.

    Raises:
        InputError: films of different length, other joints, or no frame in common.

    """
    if estimated.frames != truth.frames or estimated.joints_at != truth.joints_at:
        raise InputError(
            f"{truth.name}: {truth.frames} frames of {len(truth.joints_at)} spine angles cannot be "
            f"compared with {estimated.frames} of {len(estimated.joints_at)}"
        )
    both = estimated.found & truth.found
    if not both.any():
        raise InputError(f"{truth.name}: no frame has a posture in both")
    turn = estimated.head_rad[both] - truth.head_rad[both]
    head = np.abs(np.angle(np.exp(1j * turn)))
    points = estimated.points()[both] / estimated.length
    there = truth.points()[both] / truth.length
    points, there = points - points.mean(axis=(0, 1)), there - there.mean(axis=(0, 1))
    ratio = float((points * there).sum() / (points * points).sum())
    pitch = height = None
    if estimated.pitch_rad is not None and truth.pitch_rad is not None:
        has_pitch = np.isfinite(estimated.pitch_rad[both])
        pitch = np.abs(estimated.pitch_rad[both] - truth.pitch_rad[both])[has_pitch]
    if estimated.height is not None and truth.height is not None:
        off = ratio * estimated.height[both] / estimated.length - truth.height[both] / truth.length
        off = off[np.isfinite(off)]
        height = np.abs(off - np.median(off))
    return Accuracy(
        angles_rad=np.abs(estimated.angles_rad[both] - truth.angles_rad[both]),
        head_rad=head,
        length_ratio=ratio,
        skeleton=np.hypot(*(there - ratio * points).transpose(2, 0, 1)).mean(axis=1),
        turned_round=int(np.count_nonzero(head > np.pi / 2)),
        pitch_rad=pitch,
        height=height,
    )


def _median_and_p95(values: Floats) -> list[float]:
    """Median and 95th percentile."""
    return [round(float(np.median(values)), 2), round(float(np.percentile(values, 95.0)), 2)]
