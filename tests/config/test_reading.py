"""Answers about a file are stored beside it; each reader uses them and states its facts."""

import bz2
import gzip
import json
import lzma
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.archive import FREE_BYTES, read_bytes
from snakewalk.config.errors import InputError
from snakewalk.config.reading import Fact, by_names, stated, with_stored
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import import_robot
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from tests.helpers.command import snakewalk
from tests.helpers.foreign_files import ANGLES, joint_csv, massless_urdf, midlines, points


def test_the_file_and_the_user_state_the_same_or_the_fault_names_both() -> None:
    file = Path("a.csv")
    assert stated(file, "--unit", None, None) is None
    by_name = Fact("deg", "file", "the names of its columns")
    assert by_names("deg", ["a_deg"], {}) == by_name
    assert by_names("deg", ["a_deg"], {"a_deg": "A"}) == Fact("deg", "user", "--columns")
    assert stated(file, "--unit", by_name, "deg") == by_name
    assert stated(file, "--unit", None, "deg") == Fact("deg", "user", "--unit")
    with pytest.raises(InputError, match=r"--unit rad: a\.csv states deg; leave the option out"):
        stated(file, "--unit", by_name, "rad")


def test_answers_about_a_track_are_used_by_later_commands(tmp_path: Path) -> None:
    file = midlines(tmp_path / "m.csv", time_factor=1000.0)
    with pytest.raises(InputError, match="--time-unit ms"):
        load_file(file)
    first = load_file(file, choice=Choice(time_unit="ms", remember=True))
    assert (tmp_path / "m.csv.reading.toml").read_text() == (
        '# Answers about m.csv\ntime_unit = "ms"\n'
    )
    later = load_file(file)
    assert later.rate_hz == first.rate_hz == pytest.approx(30.0, rel=1e-4)
    assert later.notes[0] == "m.csv.reading.toml: time_unit = ms"
    assert later.facts["time"].source == "user"
    shown = snakewalk("animal", "analyse", str(file), "--json")
    assert json.loads(shown.stdout)[0]["rate_hz"] == pytest.approx(30.0, rel=1e-4)


def test_stored_lists_are_used_by_later_commands(tmp_path: Path) -> None:
    file = midlines(tmp_path / "m.csv")
    (tmp_path / "m.csv.reading.toml").write_text('keypoints = ["p0", "p2"]\n')
    assert with_stored(file, Choice())[0].keypoints == ("p0", "p2")
    (tmp_path / "m.csv.reading.toml").write_text("classes = [2, 9]\n")
    assert with_stored(file, ElevationChoice())[0].classes == (2, 9)


def test_answers_about_joint_angles_elevations_and_robots_are_used(tmp_path: Path) -> None:
    angles = joint_csv(tmp_path / "j.csv", unit="")
    with pytest.raises(InputError, match="--unit deg"):
        prepare_playback(str(angles))
    (tmp_path / "j.csv.reading.toml").write_text('unit = "deg"\n')
    prepared = prepare_playback(str(angles))
    assert prepared.notes[0] == "j.csv.reading.toml: unit = deg"
    np.testing.assert_allclose(prepared.joint_track[1], ANGLES, atol=1e-4)
    assert prepared.facts["unit"] == Fact("deg", "user", "--unit")

    cloud = points(tmp_path / "p.xyz")
    read_elevation(cloud, MapOptions(ElevationChoice(unit="mm", remember=True)))
    later = read_elevation(cloud, MapOptions())
    assert later.facts["unit"].source == "user"
    assert later.size_m == pytest.approx((0.02, 0.02))

    robot = massless_urdf(tmp_path / "r.urdf")
    with pytest.raises(InputError, match=r"mass_kg"):
        import_robot(robot, "r", "XM430-W350")
    choice = RobotChoice(assume={"*.mass_kg": "0.2"}, remember=True)
    import_robot(robot, "r", "XM430-W350", choice)
    stored = (tmp_path / "r.urdf.reading.toml").read_text()
    assert stored.endswith('[assume]\n"*.mass_kg" = "0.2"\n')
    assert import_robot(robot, "r", "XM430-W350").robot.mass_kg == pytest.approx(0.6)


def test_an_option_takes_precedence_and_faults_of_the_stored_answers_are_named(
    tmp_path: Path,
) -> None:
    file = midlines(tmp_path / "m.csv")
    answers = tmp_path / "m.csv.reading.toml"
    answers.write_text("rate = 60\n")
    assert load_file(file).rate_hz == 60.0
    assert load_file(file, choice=Choice(rate=15.0)).rate_hz == 15.0
    answers.write_text("frame_rate = 60\n")
    with pytest.raises(InputError, match=r"m\.csv\.reading\.toml:1: frame_rate: unknown key"):
        load_file(file)
    answers.unlink()
    with pytest.raises(InputError, match="--remember: no option answers a question"):
        load_file(file, choice=Choice(remember=True))


def test_the_command_stores_answers_about_joint_angles(tmp_path: Path) -> None:
    angles = joint_csv(tmp_path / "j.csv", unit="")
    place = ["--no-film", "--out", str(tmp_path / "run"), "--quiet"]
    ended = snakewalk("play", str(angles), "--unit", "deg", "--remember", *place)
    assert ended.returncode == 0, ended.stderr
    assert 'unit = "deg"' in (tmp_path / "j.csv.reading.toml").read_text()


PACKERS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
}


@pytest.mark.parametrize("ending", PACKERS)
def test_compressed_tables_are_read(ending: str, tmp_path: Path) -> None:
    pack = PACKERS[ending]

    def packed(file: Path) -> Path:
        result = file.with_name(file.name + ending)
        result.write_bytes(pack(file.read_bytes()))
        return result

    assert load_file(packed(midlines(tmp_path / "m.csv"))).rate_hz == pytest.approx(30.0, rel=1e-4)
    played = prepare_playback(str(packed(joint_csv(tmp_path / "j.csv"))))
    np.testing.assert_allclose(played.joint_track[1], ANGLES, atol=1e-4)
    cloud = read_elevation(packed(points(tmp_path / "p.xyz")), MapOptions())
    assert cloud.size_m == pytest.approx((20.0, 20.0))
    grid = tmp_path / "g.asc"
    head = "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 0\ncellsize 10\n"
    grid.write_text(head + "1 2 3\n2 3 4\n3 4 5\n")
    assert read_elevation(packed(grid), MapOptions()).relief_m == pytest.approx(4.0)


@pytest.mark.parametrize("ending", PACKERS)
def test_compressed_files_are_bounded_and_their_damage_is_named(
    ending: str, tmp_path: Path
) -> None:
    file = tmp_path / f"m.csv{ending}"
    file.write_bytes(PACKERS[ending](bytes(FREE_BYTES + 1)))
    with pytest.raises(InputError, match="is larger than the 16 MB that are read of it"):
        read_bytes(file)
    file.write_bytes(PACKERS[ending](b"t,frame\n" * 999)[:40])
    with pytest.raises(InputError, match="is compressed, and damaged; copy it again"):
        read_bytes(file)
