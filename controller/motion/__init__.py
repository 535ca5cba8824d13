"""Motion sources: everything that moves joints, and changes from one source to another."""
