"""Motion sources: everything that moves joints, and the joins from one source to another."""
