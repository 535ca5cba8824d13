"""``snakewalk animal track``: table, JSON, picture and refusals; what a robot refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.run import StatesConfig
from snakewalk.controller.walk.shape_filters import shape_filters
from tests.helpers.command import snakewalk
from tests.helpers.travelling import S, ends, wave_angles

pytestmark = pytest.mark.usefixtures("legible_figures")


@pytest.mark.slow
def test_a_file_and_a_shipped_name_as_json_with_a_picture(tmp_path: Path) -> None:
    np.savez(tmp_path / "mine.npz", points=ends(wave_angles(), 0.3), rate_hz=20.0, length_m=0.3)
    done = snakewalk(
        "animal", "track", "worm-like", str(tmp_path / "mine.npz"), "--json",
        "--robot", "alternating16", "--rate", "40", "--picture", str(tmp_path / "out.png"),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    shipped, mine = json.loads(done.stdout)
    assert shipped["source"].startswith("generated; figures of one Caenorhabditis")
    assert (mine["rate_hz"], mine["length_mm"], mine["robot"]) == (40.0, 300.0, "alternating16")
    assert mine["wave_hz"] == pytest.approx(2.0, rel=0.05)  # twice the pace that the file says
    assert mine["states_kept"] == 60
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")


def test_a_recording_that_is_listed_tail_first_is_warned_of(tmp_path: Path) -> None:
    np.savez(tmp_path / "tail.npz", points=ends(wave_angles())[:, ::-1], rate_hz=20.0)
    done = snakewalk("animal", "track", str(tmp_path / "tail.npz"))
    assert done.returncode == 0, done.stderr
    assert "or tail first" in done.stdout


def test_bad_input_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    for words, said in (
        ([str(tmp_path / "bad.csv")], "found a, b"),
        (["nosuch"], "nosuch: no such recording or file"),
        (["--robot", "nosuch"], "no such robot"),
        (["worm-like", "--picture", str(tmp_path / "a.docx")], "a.docx"),
    ):
        done = snakewalk("animal", "track", *words)
        assert done.returncode == 2, (words, done.stderr)
        assert said in done.stderr
        assert "Traceback" not in done.stderr


def test_each_reason_refuses_the_shape_that_is_made_for_it() -> None:
    robot = load_robot("yaw16")
    tests = shape_filters(robot, load_world("flat").friction, StatesConfig())
    good = 0.6 * np.sin(2 * np.pi * 1.5 * S)
    made = {
        "turn": good + 4.0 * S,
        "joint limits": 4.0 * np.sin(2 * np.pi * 4 * S),
        "self-contact": 2.0 * np.pi * S,
        "traction": 0.1 * np.sin(2 * np.pi * 1.5 * S),
    }
    assert tests.keys() == made.keys()
    for reason, refuse in tests.items():
        np.testing.assert_array_equal(refuse(np.stack([good, made[reason]])), [False, True])
