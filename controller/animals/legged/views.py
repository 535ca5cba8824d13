"""Views of the camera in which keypoints of an animal with legs are tracked."""

VIEWS = ("above", "side")
