"""Animals with legs: their cycle on a line, bent along a path and stood on the ground."""
