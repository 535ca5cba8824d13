"""Servo models: one file each, read strictly; a model of one's own is a file beside the robot's."""

import ast
import json
import re
from pathlib import Path

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import load_robot, with_keys
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_catalogue import (
    FOLDER,
    models_by_number,
    servo_model,
    shipped_models,
)

ROOT = Path(__file__).resolve().parents[2]
MINE = 'model = "MINE-1"\nmodel_number = 9999\nlike = "XM430-W350"\nsource = "a test (ours)"\n'
ROBOT = 'name = "mine"\njoint_axes = "yy"\n[servo]\nmodel = "{}"\n'


def written(folder: Path, text: str, name: str = "servos/MINE-1.toml") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", shipped_models())
def test_a_shipped_file_has_the_name_and_the_source_of_its_model(name: str) -> None:
    facts = servo_model(name)
    assert facts.model == name
    assert facts.source
    if facts.motor is not None and facts.protocol == 2:
        assert facts.missing_for_a_run() == []


def test_numbers_are_unique() -> None:
    models = [servo_model(name) for name in shipped_models()]
    numbers = [each.model_number for each in models if each.protocol == 2]
    assert len(set(numbers)) == len(numbers)
    assert models_by_number() == {m.model_number: m.model for m in models if m.protocol == 2}


def test_a_model_is_found_beside_the_robots_file_and_travels_with_it(tmp_path: Path) -> None:
    file = written(tmp_path, MINE)
    robot = load_robot(str(written(tmp_path, ROBOT.format("MINE-1"), "robot.toml")))
    assert robot.servo_models == ("MINE-1", "MINE-1")
    assert robot.servo_records[0].model_number == 9999
    file.unlink()
    again = RobotConfig.model_validate_json(robot.model_dump_json())  # as a log keeps it
    assert again == robot
    assert again.servo_records == robot.servo_records
    assert with_keys(robot, {"link_mass_kg": 0.2}, "--set").servo_records == robot.servo_records


def test_a_path_names_a_model_too(tmp_path: Path) -> None:
    written(tmp_path, MINE, "parts/mine.toml")
    robot = load_robot(str(written(tmp_path, ROBOT.format("parts/mine.toml"), "robot.toml")))
    assert robot.servo.model == "MINE-1"
    assert models_by_number(tmp_path) == models_by_number()


def test_a_scan_knows_the_models_of_the_folder(tmp_path: Path) -> None:
    written(tmp_path, MINE)
    assert models_by_number(tmp_path)[9999] == "MINE-1"


def test_robots_with_shipped_models_have_no_records() -> None:
    robot = load_robot("yaw16")
    assert "described_models" not in json.loads(robot.model_dump_json())


def test_measurements_of_another_model_are_not_taken_over(tmp_path: Path) -> None:
    assert servo_model("XL330-M288").friction is not None
    text = MINE.replace("XM430-W350", "XL330-M288")
    assert servo_model(str(written(tmp_path, text))).friction is None
    without_source = text.replace('source = "a test (ours)"\n', "")
    with pytest.raises(ConfigError, match="source: is required"):
        servo_model(str(written(tmp_path, without_source)))


def test_a_mistyped_register_of_a_copied_file_is_named(tmp_path: Path) -> None:
    """With an address it was taken for a new register."""
    copied = (FOLDER / "STS3215.toml").read_text(encoding="utf-8")
    file = written(tmp_path, copied.replace('"Acceleration" =', '"Accelertion" ='))
    with pytest.raises(ConfigError, match="no model has Accelertion; did you mean Acceleration"):
        servo_model(str(file))
    mine = copied + '"My Own Register" = { address = 90, size = 1 }\n'
    assert "My Own Register" in servo_model(str(written(tmp_path, mine))).registers


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (MINE.replace("XM430-W350", "XM9"), "like: XM9: no such servo model"),
        (MINE + "colour = 3\n", r"MINE-1\.toml:5: colour: unknown key"),
        (MINE + 'without = ["Colour"]\n', "XM430-W350 has no register 'Colour'"),
        (
            MINE + '[registers]\n"velocity limt" = { initial = 3 }\n',
            "no register 'velocity limt'; did you mean Velocity Limit",
        ),
        (MINE + '[registers]\n"Velocity Limit" = 3\n', "registers.Velocity Limit: must be a t"),
        (MINE + "without = 3\n", "without: must be a list of registers"),
        (MINE.replace("MINE-1", "a/b"), "model: "),
        (MINE.replace("9999", "70000"), "model_number: must be at most 65535"),
        (MINE + "modes = [7]\n", "modes: 7 is not known"),
        (MINE + "bauds = [57600, 57600]\n", "bauds: positive rates, each once"),
        (MINE + "indirect = [[1000, 224, 28]]\n", r"indirect: \[1000, 224, 28\] is outside"),
        (MINE + "[motor]\nnominal_v = 30.0\n", r"voltage_v: \[9.5, 16\] does not contain"),
        (MINE + "[motor]\nstall_current_a = 0.0\n", "stall_current_a: must be over 0"),
        (MINE + "[units]\nfull_pwm = 1.5\n", "full_pwm: must be a whole number"),
        (MINE + '[registers]\n"New" = { address = 85, size = 1 }\n', "Position P Gain .* overlaps"),
        (MINE + '[registers]\n"New" = { address = 1024, size = 1 }\n', "must be under 1024"),
        (MINE + '[registers]\n"ID" = { initial = 300 }\n', "initial: 300 does not fit in 1 byte"),
        (MINE + '[registers]\n"ID" = { range = [9, 2] }\n', "range: 9 is above 2"),
        (
            MINE + 'without = ["Goal PWM", "Moving"]\n',
            "motor: the simulated servo also needs Goal PWM, Moving",
        ),
    ],
)
def test_a_faulty_file_is_refused_in_a_line(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(ConfigError, match=said) as told:
        servo_model(str(path))
    assert all(fault.startswith(str(path)) for fault in told.value.faults)


def test_files_that_are_like_each_other_end_in_a_line(tmp_path: Path) -> None:
    path = written(tmp_path, MINE.replace("XM430-W350", "MINE-1.toml"))
    with pytest.raises(ConfigError, match="more than 5 files that are each like another"):
        servo_model(str(path))


def test_an_unknown_model_is_refused_when_the_robot_is_loaded(tmp_path: Path) -> None:
    path = written(tmp_path, ROBOT.format("XM9"), "robot.toml")
    with pytest.raises(ConfigError, match="servo: XM9: no such servo model; similar are XM"):
        load_robot(str(path))
    path = written(tmp_path, ROBOT.format("gone.toml"), "robot.toml")
    with pytest.raises(ConfigError, match=r"gone\.toml: no such file"):
        load_robot(str(path))
    path = written(tmp_path, ROBOT.format("XL320"), "robot.toml")
    with pytest.raises(ConfigError, match="the file of XL320 lacks Drive Mode"):
        load_robot(str(path))


def tables_of_models(text: str) -> list[int]:
    """Lines of literals that name three or more models: a copy of what their files say."""
    names = {name for name in shipped_models() if f'"{name}"' in text}
    if len(names) < 3:
        return []
    return [
        node.lineno
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Dict | ast.Tuple | ast.List | ast.Set)
        and sum(f'"{name}"' in ast.unparse(node).replace("'", '"') for name in names) >= 3
    ]


def sources() -> dict[str, str]:
    """Text of each file of the library."""
    return {
        str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
        for top in ("config", "drivers", "sim", "controller")
        for path in sorted((ROOT / top).rglob("*.py"))
    }


def test_no_code_holds_a_second_table_of_models() -> None:
    found = {name: lines for name, text in sources().items() if (lines := tables_of_models(text))}
    assert found == {}
    assert tables_of_models('A = {"AX-12A": 1, "XM430-W350": 2, "MX-64": 3}') == [1]


def test_no_table_is_read_from_the_sdk_and_no_message_calls_it_old() -> None:
    for name, text in sources().items():
        assert "dynamixel_easy_sdk" not in text, name
        assert not re.search(r"SDK.{0,20}too old", text), name


def test_a_new_model_is_one_file() -> None:
    """The catalogue lists the folder; nothing else names the models."""
    assert {path.stem for path in FOLDER.glob("*.toml")} == set(shipped_models())
