"""Film of a capture: its options, its keypoints, its results and its scale."""
