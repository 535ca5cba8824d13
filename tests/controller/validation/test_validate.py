"""Published measurements against the simulator: files, benches, command and page."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from typer.testing import CliRunner

from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.loader import shipped
from snakewalk.config.world import Water
from snakewalk.controller.cli.command_line import app
from snakewalk.controller.validation.benches import SineWave, simulate
from snakewalk.controller.validation.comparison import compare, median_ratio
from snakewalk.controller.validation.measurement import (
    MeasuredRow,
    WaveMotion,
    load_measurement,
)
from snakewalk.controller.validation.page import page_text
from tests.oracles.planar_swimmer import swim

PAGE = Path(__file__).resolve().parents[3] / "docs/validation.md"
FILES = shipped("measurements")
NUMBER = re.compile(r"\d+(?:\.\d+)?")
"""A number of the page; another machine may differ in its last digit."""
BENCH = ("dynamixel-voltages", "mx-no-load", "sts3215-pendulum")
"""Files without a run: they need a tenth of a second."""


def run(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["trials", "validate", *words])
    return result.exit_code, result.output


@pytest.mark.parametrize("name", FILES)
def test_each_row_has_valid_conditions_and_a_measured_value_in_its_range(name: str) -> None:
    _, measurement = load_measurement(name)
    for row in measurement.rows:
        conditions = measurement.conditions(row, name)
        if isinstance(conditions.motion, WaveMotion):
            assert len(conditions.motion.amplitudes_deg) == conditions.robot.joint_count


@pytest.mark.parametrize("name", BENCH)
def test_servos_alone_stay_in_their_ranges(name: str) -> None:
    rows = compare([load_measurement(name)])
    assert [row.row for row in rows if row.state not in {"ok", "reported"}] == []
    assert not any(row.counts for row in rows)


def test_there_are_twenty_rows_and_ten_that_count() -> None:
    files = [load_measurement(name)[1] for name in FILES]
    rows = [(file, row) for file in files for row in file.rows]
    travelling = [
        row
        for file, row in rows
        if file.motion.kind in {"wave", "gait"} and row.kind == "measured" and row.over is None
    ]
    assert len(rows) >= 20
    assert len(travelling) >= 10


@pytest.mark.costs("a simulated run of 16 s")
def test_the_published_law_of_the_milk_snake_within_three_per_cent() -> None:
    [row] = compare([load_measurement("milk-snake-model")])
    assert row.ratio == pytest.approx(1.0, abs=0.03)
    assert row.kind == "published model"
    assert not row.counts


def test_a_motor_at_half_its_voltage_has_half_of_everything() -> None:
    name, measurement = load_measurement("mx-no-load")
    row = measurement.rows[0]
    low, high = (
        simulate(
            measurement.conditions(
                row.model_copy(update={"set": row.set | {"motion.supply_v": volts}}), name
            )
        )
        for volts in (6.0, 12.0)
    )
    for quantity, value in high.items():
        assert low[quantity] == pytest.approx(0.5 * value, rel=1e-3)


def test_a_wave_begins_at_rest_and_reaches_its_amplitude() -> None:
    motion = WaveMotion(frequency_hz=2.0, amplitudes_deg=(30.0,), phases_deg=(90.0,), seconds=3.0)
    wave = SineWave(motion)
    assert wave.goal_rad()[0] == 0.0
    assert abs(wave.velocity_rad_s()[0]) < 1e-3
    angles = [wave.step(0.01, None)[0] for _ in range(200)]  # type: ignore[arg-type]
    assert max(angles[100:]) == pytest.approx(math.radians(30.0), rel=1e-3)
    assert np.abs(angles[:30]).max() < math.radians(10.0)


@pytest.mark.costs("a simulated swim of 4 s, and a planar model of it")
def test_a_robot_that_follows_a_wave_swims_as_fast_as_the_planar_model() -> None:
    """A servo that shook at each goal made the water resist more: 1.4 times the speed."""
    name, measurement = load_measurement("amphibot-swimming")
    row = measurement.row("even-40-1Hz-lag0.5")
    times = {"motion.seconds": 4.0, "motion.after_s": 2.0}
    conditions = measurement.conditions(row.model_copy(update={"set": row.set | times}), name)
    robot, motion, water = conditions.robot, conditions.motion, conditions.world.ground
    assert isinstance(motion, WaveMotion)
    assert isinstance(water, Water)
    radius_m, link_m = robot.body_radius_m, robot.mean_link_length_m
    mass_kg = robot.mean_link_mass_kg

    def angles_rad(time_s: float) -> np.ndarray:
        risen = min(max(time_s, 0.0), 1.0)
        phase = math.tau * motion.frequency_hz * time_s + np.radians(motion.phases_deg)
        rise = risen * risen * (3.0 - 2.0 * risen)
        return np.asarray(rise * np.radians(motion.amplitudes_deg) * np.sin(phase))

    def shape(time_s: float) -> tuple[np.ndarray, np.ndarray]:
        rates = (angles_rad(time_s + 1e-4) - angles_rad(time_s - 1e-4)) / 2e-4
        return angles_rad(time_s), rates

    time_s = np.arange(0.0, 4.0, 0.02)
    drag = 0.5 * water.density_kg_m3 * radius_m
    centre_m = swim(
        robot.link_count,
        link_m,
        mass_kg,
        mass_kg * (3.0 * radius_m**2 + link_m**2) / 12.0,
        (2.0 * drag * water.drag_across, np.pi * drag * water.drag_along),
        shape,
        time_s,
    )
    slope = np.polyfit(time_s[100:], centre_m[100:], 1)[0]
    assert simulate(conditions)["speed_m_s"] == pytest.approx(np.hypot(*slope), rel=0.05)


def test_a_range_beyond_a_quarter_needs_a_cause() -> None:
    fields = {"name": "a", "quantity": "lag_s", "value": 1.0, "kind": "measured"}
    MeasuredRow(**fields, range=(0.8, 1.25))
    with pytest.raises(ValidationError, match="cause: is required"):
        MeasuredRow(**fields, range=(0.5, 1.25))
    with pytest.raises(ValidationError, match="write lowest first"):
        MeasuredRow(**fields, range=(1.25, 0.8), cause="none")


def test_rows_name_a_cause_of_their_file() -> None:
    _, measurement = load_measurement("sts3215-pendulum")
    rows = [row for row in measurement.rows if row.cause == "protection"]
    assert len(rows) > 1
    assert {measurement.cause(row) for row in rows} == {measurement.causes["protection"]}
    assert "its output" in measurement.causes["protection"]
    other = rows[0].model_copy(update={"cause": "a cause of its own"})
    assert measurement.cause(other) == "a cause of its own"


def changed(tmp_path: Path, old: str, new: str) -> str:
    text = (PAGE.parents[1] / "config/measurements/mx-no-load.toml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "mine.toml"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return str(file)


def test_a_row_that_leaves_its_range_gives_exit_code_1(tmp_path: Path) -> None:
    code, output = run(changed(tmp_path, "value = 33.1", "value = 66.2"))
    assert code == 1
    assert "outside" in output
    code, output = run("mx-no-load")
    assert code == 0
    assert max(map(len, output.splitlines())) <= 80


def test_a_simulation_that_fails_is_a_row_with_its_reason(tmp_path: Path) -> None:
    file = changed(tmp_path, 'quantity = "no_load_rpm"', 'quantity = "lag_s"')
    code, output = run(file, "--json")
    assert code == 1
    data = json.loads(output[output.index("{") :])
    assert data["rows"][0]["state"] == "failed"
    assert "choose one of them" in data["rows"][0]["cause"]
    assert data["median_rows"] == 0


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("value = 33.1", "value = -1.0", "value"),
        ('name = "MX-64-10V"', 'name = "MX-64-6V"', "same name"),
        ('kind = "measured"', 'kind = "guessed"', "kind"),
        ('quantity = "no_load_rpm"', 'quantity = "no_load_rpm"\nover = "none"', "is not a row"),
    ],
)
def test_a_fault_of_a_file_is_bad_input(tmp_path: Path, old: str, new: str, fault: str) -> None:
    with pytest.raises(ConfigError, match=fault):
        load_measurement(changed(tmp_path, old, new))


def test_a_replaced_key_begins_with_the_name_of_a_table(tmp_path: Path) -> None:
    file = changed(tmp_path, '"robot.servo.model"', '"servo.model"')
    name, measurement = load_measurement(file)
    with pytest.raises(InputError, match="a key begins with robot"):
        measurement.conditions(measurement.rows[0], name)


def test_a_quotient_of_rows_divides_value_and_result(tmp_path: Path) -> None:
    file = changed(tmp_path, 'name = "MX-64-10V"', 'name = "MX-64-10V"\nover = "MX-64-6V"')
    rows = {row.row: row for row in compare([load_measurement(file)])}
    quotient = rows["MX-64-10V"]
    assert quotient.measured == pytest.approx(55.5 / 33.1)
    assert quotient.simulated == pytest.approx(10.0 / 6.0, rel=1e-3)


def test_the_picture_has_all_rows(tmp_path: Path) -> None:
    picture = tmp_path / "ratios.svg"
    code, _ = run("mx-no-load", "--picture", str(picture))
    assert code == 0
    assert picture.read_text(encoding="utf-8").count("MX-106") >= 3


def test_the_page_has_the_files_and_bench_rows_of_today() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in FILES:
        assert f"`config/measurements/{name}.toml`" in text
    for name in BENCH:
        loaded = [load_measurement(name)]
        written = page_text(loaded, compare(loaded))
        section = written[written.index("\n## ") : written.index("\n## Limits")]
        assert section in text


def test_values_of_data_sheets_are_one_sentence_and_a_row_that_is_off_is_listed() -> None:
    loaded = [load_measurement("dynamixel-voltages")]
    first, *others = compare(loaded)
    off = replace(first, measured=2.0 * first.measured)
    text = page_text(loaded, [off, *others])
    assert f"\n\n{len(others)} of {len(others) + 1} rows are values of data sheets" in text
    assert "each of them.\n\n| row |" in text
    listed = [line for line in text.splitlines() if line.endswith("| data sheet | outside |")]
    assert [line.split(" | ")[0] for line in listed] == [f"| {off.row}"]
    assert not any(row.row in text for row in others)


@pytest.mark.slow
@pytest.mark.costs("plays every published measurement")
def test_the_page_is_written_by_the_command_and_no_row_left_its_range() -> None:
    loaded = [load_measurement(name) for name in FILES]
    rows = compare(loaded)
    assert [row.row for row in rows if row.state not in {"ok", "reported"}] == []
    again, written = page_text(loaded, rows), PAGE.read_text(encoding="utf-8")
    assert NUMBER.sub("0", again) == NUMBER.sub("0", written)
    ours, theirs = ([float(n) for n in NUMBER.findall(text)] for text in (again, written))
    assert ours == pytest.approx(theirs, rel=0.02, abs=0.011)
    ratio, count = median_ratio(rows)
    readme = (PAGE.parents[1] / "README.md").read_text(encoding="utf-8")
    assert f"{count} measured" in readme
    assert f"{ratio:.2f}" in readme
