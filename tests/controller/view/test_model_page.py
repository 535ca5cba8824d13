"""A glTF on the page: it is upright, and the camera stands off its box."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser")
import trimesh

from snakewalk.config.errors import InputError
from snakewalk.controller.view.commands.view import view
from snakewalk.controller.view.model_page import open_model
from tests.helpers.browser import IN_A_BROWSER, chromium, new_tab


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


@IN_A_BROWSER
@pytest.mark.slow
def test_the_camera_flies_through_a_model_in_the_browser(tmp_path: Path) -> None:
    file = tmp_path / "a.glb"
    trimesh.creation.box((1.0, 2.0, 0.5)).export(file)
    server, url = open_model(file, "127.0.0.1", 0)
    places: list[tuple[float, ...]] = []
    server.on_client_connect(
        lambda client: client.camera.on_update(lambda camera: places.append(tuple(camera.position)))
    )
    try:
        with chromium() as browser:
            tab = new_tab(browser, viewport={"width": 600, "height": 400})
            tab.set_default_timeout(60_000.0)
            tab.goto(url)
            tab.get_by_text("fly the camera").wait_for()
            tab.mouse.click(100, 300)
            tab.keyboard.down("w")
            for _ in range(300):
                if places and np.linalg.norm(np.subtract(places[-1], places[0])) > 0.05:
                    break
                tab.wait_for_timeout(100)
            else:
                pytest.fail("the camera did not move")
            tab.keyboard.up("w")
    finally:
        server.stop()
