"""Localization: the head's pose from an overhead camera, or by dead reckoning from the joints."""
