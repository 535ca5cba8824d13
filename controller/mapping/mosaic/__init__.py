"""Local models of stereo positions, and the morph between them along a route ([KP] 3)."""
