"""A binary glTF in the browser: its animation plays, and the camera flies."""

from pathlib import Path

import numpy as np
import viser

from snakewalk.config.archive import read_bytes
from snakewalk.controller.images.mesh_files import read_mesh
from snakewalk.controller.view.page_server import served_model

_UPRIGHT = (0.5**0.5, 0.5**0.5, 0.0, 0.0)
"""Rotation from y up, the standard of glTF, to z up."""
_HINT = "W, A, S, D, Q and E fly the camera; drag to turn it."


def open_model(file: Path, host: str, port: int) -> tuple[viser.ViserServer, str]:
    """Serve a page with the model; returns it with its address.

    Raises:
        InputError: not a glTF with triangles, or nothing can be served there.

    """
    corners_m = read_mesh(file, forward="+x", up="+y").mesh.vertices
    least_m, most_m = corners_m.min(axis=0), corners_m.max(axis=0)
    server, url = served_model(host, port)
    server.gui.add_markdown(_HINT)
    server.scene.add_glb("/model", read_bytes(file), wxyz=_UPRIGHT)
    centre_m = 0.5 * (least_m + most_m)
    size_m = float(np.linalg.norm(most_m - least_m))
    camera = server.initial_camera
    camera.look_at = tuple(centre_m)
    camera.position = tuple(centre_m + size_m * np.array([-0.6, -0.7, 0.4]))
    return server, url
