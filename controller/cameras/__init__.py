"""Localization: the head's pose from an overhead camera and dead reckoning, or from tags."""
