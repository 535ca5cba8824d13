"""The file of a map: written and read, and the world that names it."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.ground import build_ground
from snakewalk.config.heightfield import HeightField, read_map, write_map
from snakewalk.config.loader import load_world

RNG = np.random.default_rng(1)
Z = RNG.normal(size=(7, 9))
KNOWN = RNG.random((7, 9)) > 0.3


def test_what_is_written_is_read_and_a_world_finds_it_beside_itself(tmp_path: Path) -> None:
    write_map(tmp_path / "a.npz", HeightField(Z.copy(), 0.25, -3.0, 0.5, KNOWN.copy()))
    held = read_map(tmp_path / "a.npz")
    np.testing.assert_allclose(held.z_m, Z, atol=1e-6)
    np.testing.assert_array_equal(held.known, KNOWN)
    assert (held.spacing_m, held.x0_m, held.y0_m) == (0.25, -3.0, 0.5)
    world = tmp_path / "w.toml"
    world.write_text('name = "w"\n[ground]\nkind = "map"\nsource = "a.npz"\nvertical_scale = 2\n')
    ground = build_ground(load_world(str(world)))
    np.testing.assert_allclose(ground.z_m, 2 * (Z - Z.min()), atol=1e-5)
    assert (ground.x0_m, ground.y0_m) == (-3.0, 0.5)
    np.testing.assert_array_equal(ground.known, KNOWN)
    doubled = build_ground(load_world(str(world)).with_relief(1.5))
    np.testing.assert_allclose(doubled.z_m, 1.5 * ground.z_m)


def test_what_is_no_map_is_refused(tmp_path: Path) -> None:
    whole = {"z_m": Z, "known": KNOWN, "spacing_m": 0.1, "x0_m": 0.0, "y0_m": 0.0}
    wrong = {
        "finite": {"z_m": np.where(KNOWN, Z, np.nan)},
        "booleans": {"known": KNOWN.astype(int)},
        "shape of z_m": {"known": KNOWN[:3]},
        "above 0": {"spacing_m": 0.0},
        "must be finite": {"x0_m": np.nan},
        "is no map": {"spacing_m": np.zeros(3)},
        "could not convert": {"z_m": np.array([["a"]])},
        "are the most": {"z_m": np.zeros((2001, 2001)), "known": np.ones((2001, 2001), bool)},
    }
    for message, change in wrong.items():
        np.savez(tmp_path / "a.npz", **(whole | change))
        with pytest.raises(InputError, match=message):
            read_map(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", **{k: v for k, v in whole.items() if k != "known"})
    with pytest.raises(InputError, match="no array named 'known'"):
        read_map(tmp_path / "a.npz")
    world = tmp_path / "w.toml"
    world.write_text('name = "w"\n[ground]\nkind = "map"\nsource = "none.npz"\n')
    with pytest.raises(
        ConfigError, match=r"ground\.source: none\.npz: no such file in the folder of"
    ):
        build_ground(load_world(str(world)))
