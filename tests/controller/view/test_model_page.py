"""A glTF on the page: it is upright, and the camera stands off its box."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser")
import trimesh

from snakewalk.config.errors import InputError
from snakewalk.controller.view.commands.view import view
from snakewalk.controller.view.model_page import open_model


def test_the_model_is_upright_and_in_view(tmp_path: Path) -> None:
    file = tmp_path / "a.glb"
    box = trimesh.creation.box((1.0, 2.0, 0.5))
    box.apply_translation((0.0, 5.0, 0.0))
    box.export(file)
    server, url = open_model(file, "127.0.0.1", 0)
    try:
        assert url.startswith("http://127.0.0.1:")
        assert server.initial_camera.look_at == pytest.approx((0.0, 0.0, 5.0))
        off = np.subtract(server.initial_camera.position, server.initial_camera.look_at)
        assert 1.0 < np.linalg.norm(off) / np.linalg.norm((1.0, 2.0, 0.5)) < 1.2
    finally:
        server.stop()


def test_a_file_that_is_no_gltf_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.glb"
    file.write_bytes(b"glTF")
    with pytest.raises(InputError, match="cannot be read as a mesh"):
        view([file], "127.0.0.1:0")
