"""Views of the camera in which keypoints of an animal with legs are tracked."""

from typing import Literal

View = Literal["above", "side"]
