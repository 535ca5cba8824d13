"""Stages of a capture, and the judge that knows one frame only."""

import cv2
import numpy as np
import pytest

from snakewalk.config.arrays import Image
from snakewalk.controller.capture.staged_film import StagedFilm
from snakewalk.controller.capture.stages.pipeline import stages
from snakewalk.controller.capture.verification.frame_store import CutOut
from snakewalk.controller.capture.verification.judge import judged_error_px
from snakewalk.controller.capture.verification.profiles import body_profile
from snakewalk.controller.console.plugins import Plugin
from snakewalk.controller.images.medial_axis import Skeleton
from snakewalk.controller.track.frame_status import FrameStatus


def picture(rear: int = 40) -> Image:
    """A bar of 100 x 8 px, dark, with another grey level in its second half."""
    image = np.full((60, 160), 200, dtype=np.uint8)
    image[26:34, 30:80] = 40
    image[26:34, 80:130] = rear
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8), dtype=np.uint8)


def judged(image: Image, first: float = 29.5, last: float = 129.5) -> float:
    """Error of a line along the bar from ``first`` to ``last``."""
    line = np.column_stack([np.linspace(first, last, 101), np.full(101, 29.5)])
    body = Skeleton(line, np.full(101, 4.0), last - first, FrameStatus.GOOD)
    return judged_error_px(body_profile(body, CutOut(image, (0, 0))), last - first)


def test_a_line_from_tip_to_tip_has_no_further_error() -> None:
    assert judged(picture()) == 0.0


@pytest.mark.parametrize("off_px", [5.0, -5.0])
def test_a_tip_off_the_end_of_the_contrast_is_an_error(off_px: float) -> None:
    """A line that is too short or too long by 5 px is off by 2.5 px in the mean; 1 px is form."""
    assert judged(picture(), last=129.5 - off_px) == pytest.approx(0.25 * 4.0, abs=0.1)


def test_a_body_that_fades_is_less_accurate() -> None:
    """A rear with half of the contrast: 0.3 above what is even."""
    assert judged(picture(rear=120)) == pytest.approx(0.033 * 0.3 * 100.0, rel=0.1)


class Own:
    def run(self, film: StagedFilm) -> StagedFilm:
        return film


def test_a_plug_in_replaces_a_stage_or_follows_the_last() -> None:
    offered = [
        Plugin("stage", name, "", f"{__name__}:Own", "", "other") for name in ("repair", "smooth")
    ]
    names = [type(stage).__name__ for stage in stages(offered)]
    assert names == ["Compare", "Own", "Identify", "Complete", "Verify", "Own"]
