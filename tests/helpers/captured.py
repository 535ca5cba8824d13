"""A film captured from its frames in memory."""

from collections.abc import Iterable

from snakewalk.config.arrays import DeepImage
from snakewalk.controller.capture.capture import Capture, captured_from
from snakewalk.controller.capture.detections import Detections
from snakewalk.controller.images.body_detector import BodyDetector


def capture(
    frames: Iterable[DeepImage],
    detector: BodyDetector,
    rate_hz: float,
    *,
    head_px: tuple[float, float] | None = None,
    fixed: bool = True,
) -> Capture:
    """Find the animal in every frame, in order; raises as ``captured_from``."""
    detections = Detections()
    for frame in frames:
        detections.add(frame, detector.detect(frame))
    return captured_from(detections, rate_hz, head_px=head_px, fixed=fixed)
