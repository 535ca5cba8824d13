"""Many robots of one kind at once, on MuJoCo-Warp."""
