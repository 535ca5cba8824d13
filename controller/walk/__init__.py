"""The snake walk: from a library of shapes over the angle track to joint goals along a path."""
