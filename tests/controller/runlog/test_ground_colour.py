"""Colours of a map reach the log, and the pictures that are drawn from it."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField, read_map, write_map
from snakewalk.controller.runlog.encode import thinned
from snakewalk.controller.runlog.record import _field


def coloured() -> HeightField:
    rng = np.random.default_rng(1)
    z_m = rng.uniform(0.0, 0.1, (20, 30)).astype(np.float32).astype(float)
    colour = rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    return HeightField(z_m, 0.05, -1.0, -0.5, np.ones(z_m.shape, bool), colour)


def test_colours_pass_through_the_map_and_the_log(tmp_path: Path) -> None:
    ground = coloured()
    write_map(tmp_path / "map.npz", ground)
    back = read_map(tmp_path / "map.npz")
    assert back.colour is not None
    np.testing.assert_array_equal(back.colour, ground.colour)
    logged = _field(json.loads(json.dumps(thinned(ground))))
    assert logged.colour is not None
    np.testing.assert_array_equal(logged.colour, ground.colour)


def test_a_map_without_colours_has_none_in_the_log() -> None:
    ground = HeightField(np.zeros((4, 5)), 0.1, 0.0, 0.0)
    assert "colour" not in thinned(ground)
    assert _field(thinned(ground)).colour is None


def test_colours_of_another_shape_are_refused(tmp_path: Path) -> None:
    ground = coloured()
    write_map(tmp_path / "map.npz", ground)
    held = dict(np.load(tmp_path / "map.npz"))
    np.savez(tmp_path / "bad.npz", **(held | {"colour": held["colour"][1:]}))
    with pytest.raises(InputError, match="colour must be bytes"):
        read_map(tmp_path / "bad.npz")
