"""``--columns``: the meanings of a table's columns, with a preview, for every reader of tables."""

from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.playback import JointRequest
from snakewalk.controller.mapping.elevation_choice import ElevationChoice
from snakewalk.controller.mapping.elevation_file import FileMap, MapOptions, read_elevation
from snakewalk.controller.run.kinds.playback_run import foreign_joints
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from tests.foreign.motions import ROBOT
from tests.helpers.foreign_files import ANGLES, joint_csv, midlines, points

MIDLINES = {"t": "Zeit", "frame": "Bild", "point": "Punkt", "x_m": "X", "y_m": "Y"}


def test_midlines_with_other_names_are_asked_about_and_read_with_a_preview(tmp_path: Path) -> None:
    plain = load_file(midlines(tmp_path / "a.csv"))
    file = midlines(tmp_path / "b.csv")
    rows = file.read_text().splitlines()
    file.write_text("\n".join([",".join(MIDLINES.values()), *rows[1:]]))
    with pytest.raises(InputError, match=r"--columns MEANING=COLUMN") as asked:
        load_file(file)
    assert len(asked.value.faults) == 6
    assert asked.value.faults[1].startswith("column 1: Zeit, 0.0")
    track = load_file(file, Choice(columns=MIDLINES))
    np.testing.assert_array_equal(track.points, plain.points)
    assert track.notes[0].startswith("column 1 is t: Zeit, 0.000000, 0.000000")
    with pytest.raises(InputError, match=r"--columns: it has no column Zeiten\ncolumn 1: Zeit"):
        load_file(file, Choice(columns=MIDLINES | {"t": "Zeiten"}))
    answers = "".join(f'{meaning} = "{name}"\n' for meaning, name in MIDLINES.items())
    file.with_name("b.csv.reading.toml").write_text(f"[columns]\n{answers}")
    np.testing.assert_array_equal(load_file(file).points, plain.points)


def test_joint_angles_behind_a_title_with_the_time_in_the_last_column(tmp_path: Path) -> None:
    rows = [line.split(",") for line in joint_csv(tmp_path / "a.csv").read_text().splitlines()]
    lines = ["Logger 7", *(";".join([*row[1:], row[0]]) for row in rows)]
    file = tmp_path / "b.csv"
    file.write_text("\n".join(lines).replace("time_s", "Zeit"))
    motion = foreign_joints(str(file), ROBOT, JointRequest(columns={"time_s": "Zeit"}))
    assert motion is not None
    np.testing.assert_allclose(motion.joint_rad, ANGLES, atol=1e-6)
    assert "column 17 is time_s: Zeit, 0.00000, 0.02000, 0.04000" in motion.notes
    file.with_name("b.csv.reading.toml").write_text('columns = {time_s = "Zeit"}')
    assert foreign_joints(str(file), ROBOT, JointRequest()) is not None


def ground(file: Path, **choice: object) -> FileMap:
    return read_elevation(file, MapOptions(ElevationChoice(unit="m", **choice)))  # type: ignore[arg-type]


@pytest.mark.parametrize("ending", ["xyz", "csv"])
def test_columns_of_points_by_name_or_number(tmp_path: Path, ending: str) -> None:
    plain = ground(points(tmp_path / "a.xyz"))
    rows = [line.split() for line in (tmp_path / "a.xyz").read_text().splitlines()]
    file = tmp_path / f"b.{ending}"
    separator = " " if ending == "xyz" else ","
    turned = [separator.join([z, "7", x, y]) for x, y, z in rows]
    file.write_text("\n".join(turned) + "\n")
    by_number = ground(file, columns={"x": "3", "y": "4", "z": "1"})
    file.write_text("\n".join([separator.join(["H", "I", "R", "L"]), *turned]) + "\n")
    by_name = ground(file, columns={"x": "R", "y": "L", "z": "H"})
    for elevation in (by_number, by_name):
        np.testing.assert_array_equal(elevation.elevation.z_m, plain.elevation.z_m)
        assert str(elevation.facts["unit"]) == "m (stated by you: --unit)"
    assert "column 2 is not chosen: 7, 7, 7, 7" in by_number.notes
    assert "column 1 is z: H, 0.0000, 0.0000, 0.0000" in by_name.notes


def test_a_unit_in_a_chosen_meaning_is_stated_by_the_user(tmp_path: Path) -> None:
    file = midlines(tmp_path / "a.csv")
    assert str(load_file(file).facts["unit"]) == "m (stated by the names of its columns)"
    file.write_text(file.read_text().replace("x_m", "X").replace("y_m", "Y"))
    chosen = {"x_mm": "X", "y_mm": "Y"}
    facts = load_file(file, Choice(columns=chosen)).facts
    assert str(facts["unit"]) == "mm (stated by you: --columns)"
    rows = points(tmp_path / "a.xyz").read_text()
    (tmp_path / "named.xyz").write_text(f"x_mm y_mm z_cm\n{rows}")
    (tmp_path / "a.xyz").write_text(f"A B C\n{rows}")
    columns = {"x_mm": "A", "y_mm": "B", "z_cm": "C"}
    by_user = read_elevation(tmp_path / "a.xyz", MapOptions(ElevationChoice(columns=columns)))
    by_file = read_elevation(tmp_path / "named.xyz", MapOptions())
    np.testing.assert_array_equal(by_user.elevation.z_m, by_file.elevation.z_m)
    for name, unit in (("unit", "mm"), ("height_unit", "cm")):
        assert str(by_user.facts[name]) == f"{unit} (stated by you: --columns)"
        assert str(by_file.facts[name]) == f"{unit} (stated by the names of its columns)"
    table = joint_csv(tmp_path / "j.csv")
    table.write_text(table.read_text().replace("time_s", "Zeit"))
    motion = foreign_joints(str(table), ROBOT, JointRequest(columns={"time_ms": "Zeit"}))
    assert motion is not None
    assert str(motion.facts["time"]) == "ms (stated by you: --columns)"
    assert motion.facts["unit"].source == "file"


@pytest.mark.parametrize("ending", ["xyz", "csv"])
def test_a_table_whose_columns_nothing_states_is_asked_about(tmp_path: Path, ending: str) -> None:
    rows = points(tmp_path / "a.xyz").read_text().replace("\n", " 9\n")
    separator = " " if ending == "xyz" else ","
    file = tmp_path / f"b.{ending}"
    file.write_text(rows.replace(" ", separator))
    if ending == "xyz":
        with pytest.raises(InputError, match="4 columns, without names; add --columns") as asked:
            ground(file)
        assert asked.value.faults[4].startswith("column 4: 9.0, 9.0")
    for columns in ({"1": "2"}, {"a": "1", "b": "2", "c": "3"}):
        with pytest.raises(InputError, match="add --columns x=COLUMN"):
            ground(file, columns=columns, cell=1.0)
