"""A textured mesh of triangles."""

from dataclasses import dataclass

from snakewalk.config.arrays import Floats, Ints


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles, counter-clockwise from outside; x forward, z up, belly at z = 0."""

    vertices: Floats
    """(V, 3) metres, or body lengths where the body has no scale."""
    normals: Floats
    """(V, 3) unit length, outwards."""
    uv: Floats
    """(V, 2) place in the texture: along the body from the head, and across it from right (0)."""
    faces: Ints
    """(F, 3) indices of vertices."""
