"""Recordings in: tracked midlines, keypoints and joint angles become one Track."""
