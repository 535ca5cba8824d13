"""Images of bodies: silhouettes, medial axes, films and mesh files."""
