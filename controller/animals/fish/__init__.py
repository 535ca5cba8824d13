"""Fish from video, [TH]: a deformable model in every frame, its motion in a new order."""
