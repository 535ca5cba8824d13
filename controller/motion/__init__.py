"""From states to joints: angle track, velocity, points, ground step, retargeting, retiming."""
