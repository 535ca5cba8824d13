"""The contact sheet of a capture: frames with their scale, and their status below."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from snakewalk.controller.capture.plots.capture import contact_sheet
from snakewalk.controller.track.frame_status import FrameStatus


@pytest.mark.parametrize("status", [one for one in FrameStatus if not one.has_points])
def test_a_long_status_hides_no_scale(status: FrameStatus, tmp_path: Path) -> None:
    """Two lines of text lay on the bar of a tall frame."""
    captured: Any = SimpleNamespace(
        good=np.array([False]), status=[status], points_px=np.full((1, 3, 2), np.nan)
    )
    contact_sheet(tmp_path / "sheet.png", [np.full((200, 60), 100, np.uint8)], [captured])
    sheet = cv2.imread(str(tmp_path / "sheet.png"))
    assert sheet is not None
    bar = (sheet == 255).all(axis=2).sum(axis=1)
    assert bar.max() >= 40
