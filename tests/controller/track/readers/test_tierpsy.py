"""Files of Tierpsy, written as its page ``docs/OUTPUTS.md`` and ``read_attrs.py`` describe them.

https://github.com/ver228/tierpsy-tracker
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from snakewalk.controller.track.resample import body_points

h5py = pytest.importorskip("h5py", reason="the extra hdf5 is not installed")

RATE_HZ, FRAMES, LENGTH_UM, UM_PER_PIXEL = 25.0, 50, 1100.0, 10.0
STATES = {
    "fps": RATE_HZ,
    "time_units": "seconds",
    "microns_per_pixel": UM_PER_PIXEL,
    "xy_units": "micrometers",
}


def angles() -> np.ndarray:
    s = (np.arange(48) + 0.5) / 48.0
    time = np.arange(FRAMES) / RATE_HZ
    return 0.5 * np.sin(2.0 * np.pi * (time[:, None] - s))


def write(path: Path, *, is_features: bool, states: dict[str, Any] = STATES) -> None:
    """Write two animals; frame 7 of the second one has no skeleton."""
    bodies = body_points(angles(), LENGTH_UM) * [1.0, -1.0] + [400.0, 900.0]  # rows downwards
    both = np.concatenate([bodies[:10] + 5.0, bodies])
    both[10 + 7] = np.nan
    whose = np.repeat([1, 2], [10, FRAMES])
    frames = np.concatenate([np.arange(10), np.arange(FRAMES) + 100])
    with h5py.File(path, "w") as file:
        if is_features:
            file["coordinates/skeletons"] = both.astype(np.float32)
            table = [("worm_index", "i4"), ("timestamp", "i4")]
            file["timeseries_data"] = np.array(list(zip(whose, frames, strict=True)), table)
            file["trajectories_data"] = np.zeros(3, [("frame_number", "i4")])
        else:
            file["skeleton"] = (both / UM_PER_PIXEL).astype(np.float32)
            table = [("frame_number", "i4"), ("worm_index_joined", "i4")]
            file["trajectories_data"] = np.array(list(zip(frames, whose, strict=True)), table)
        file["trajectories_data"].attrs.update(states)


@pytest.mark.parametrize("is_features", [True, False])
def test_both_files_of_tierpsy_give_the_body_in_metres(tmp_path: Path, is_features: bool) -> None:
    path = tmp_path / "worm.hdf5"
    write(path, is_features=is_features)
    with pytest.raises(InputError, match=r"2 animals in it \(1, 2\): give --individual"):
        load_file(path)
    track = load_file(path, choice=Choice(individual="2"))
    assert (track.frames, track.dropped, track.rate_hz) == (FRAMES - 1, 1, RATE_HZ)
    assert not track.rate_assumed
    assert track.length_m == pytest.approx(1e-6 * LENGTH_UM, rel=1e-3)
    assert track.time_s[-1] - track.time_s[0] == pytest.approx((FRAMES - 1) / RATE_HZ)
    body = track.angles_rad[0, 1::2] - track.angles_rad[0].mean()
    expected = np.interp(np.arange(50) / 49.0, np.arange(48) / 47.0, angles()[0])
    np.testing.assert_allclose(body - body.mean(), expected - expected.mean(), atol=0.03)


@pytest.mark.parametrize("is_features", [True, False])
def test_frames_and_pixels_of_tierpsy_are_no_seconds_and_metres(
    tmp_path: Path, is_features: bool
) -> None:
    path = tmp_path / "worm.hdf5"
    states = {"expected_fps": 1, "time_units": "frames", "microns_per_pixel": 1}
    write(path, is_features=is_features, states=states | {"xy_units": "pixels"})
    with pytest.raises(InputError, match="states no frame rate; give --rate"):
        load_file(path, choice=Choice(individual="2"))
    track = load_file(path, Choice(rate=30.0, individual="2"))
    assert (track.rate_hz, track.length_m) == (30.0, None)
