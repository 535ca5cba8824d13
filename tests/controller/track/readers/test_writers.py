"""Tracks that are written as CSV and WCON come back the same."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.readers.load import load_file
from snakewalk.controller.track.readers.writers import write_track
from snakewalk.controller.track.track import track_from_points
from tests.helpers.command import snakewalk
from tests.helpers.travelling import FRAMES, RATE_HZ, ends, wave_angles

KEPT = np.setdiff1d(np.arange(FRAMES), [20, 21, 22])


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("suffix", [".csv", ".wcon", ".npz"])
@pytest.mark.parametrize("scale_m", [0.08, None])
def test_a_track_comes_back(suffix: str, scale_m: float | None, tmp_path: Path) -> None:
    points = ends(wave_angles())[KEPT, ::4] + 3.0
    first = track_from_points("eel", points, RATE_HZ, frame=KEPT, scale_m=scale_m)
    path = tmp_path / f"eel{suffix}"
    write_track(path, first, suffix)
    again = load_file(path)
    assert again.rate_hz == pytest.approx(first.rate_hz, rel=1e-6)
    assert (again.length_m is None) is (scale_m is None)
    np.testing.assert_allclose(again.time_s, first.time_s, atol=1e-6)
    np.testing.assert_allclose(again.points, first.points, rtol=1e-5, atol=1e-7)
    assert (again.absent or again.dropped) == 3
    facts, expected = analyse(again).facts(), analyse(first).facts()
    for name in ("frequency_hz", "waves_on_body", "bend_k_rad"):
        assert facts[name] == pytest.approx(expected[name], rel=1e-3)


def test_the_command_writes_tables_for_r_and_tierpsy(tmp_path: Path) -> None:
    track = track_from_points("eel", ends(wave_angles())[:, ::4], RATE_HZ)
    track = replace(track, notes=("one note",))
    write_track(tmp_path / "eel.npz", track, ".npz")
    wcon = tmp_path / "out.wcon"
    assert snakewalk("animal", "track", str(tmp_path / "eel.npz"), "-o", str(wcon)).returncode == 0
    held = json.loads(wcon.read_text())
    assert held["metadata"]["notes"] == ["one note"]
    assert held["units"] == {"t": "s", "x": "1", "y": "1"}
    assert len(held["data"][0]["x"]) == FRAMES
    write_track(tmp_path / "out.csv", track, ".csv")
    with (tmp_path / "out.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["t", "frame", "point", "x_lengths", "y_lengths"]
    assert len(rows) == FRAMES * 26
    refused = snakewalk(
        "animal", "track", str(tmp_path / "eel.npz"), "-o", str(tmp_path / "out.xlsx")
    )
    assert refused.returncode == 2
    assert ".npz, .csv, .wcon" in refused.stderr
