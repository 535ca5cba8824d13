"""Views of the camera in which keypoints of an animal with legs are tracked."""

from typing import Final

VIEWS: Final = ("above", "side")
