import math
from pathlib import Path

import dynamixel_easy_sdk
import numpy as np
import pytest
from dynamixel_easy_sdk.control_table import ControlTable as SdkTable
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.errors import InputError
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.control_table import load_control_table, model_numbers, model_of
from snakewalk.drivers.protocol.registers import ServoUnits
from tests.oracles.raw_positions import raw_positions

SDK_FOLDER = Path(dynamixel_easy_sdk.__file__).parent / "control_table"
XM430 = load_control_table("XM430-W350")
UNITS = ServoUnits.of(XM430.facts)


NAMES = {"BUS Watchdog": "Bus Watchdog", "Secondary ID": "Secondary(Shadow) ID"}
"""Registers that the SDK names in two ways, and the name of the X series, which is ours."""
ONLY_OURS = {"Startup Configuration", "Backup Ready"}
"""Registers of the e-manual, from firmware 45 on (330 models: 46), that the SDK leaves out."""


@pytest.mark.parametrize("number", sorted(model_numbers()))
def test_a_table_differs_from_that_of_the_sdk_only_as_listed(number: int) -> None:
    table = load_control_table(model_of(number))
    theirs = {
        NAMES.get(name, name): (item.address, item.size)
        for name, item in SdkTable.getControlTable(number).items()
        if not name.startswith("Indirect")  # named twice in the files, first with the base
    }
    ours = {
        name: (table[name].address, table[name].size)
        for name in table
        if not name.startswith("Indirect")
    }
    assert table.model_number == number
    differences = {
        name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name)
    }
    assert differences <= ONLY_OURS
    assert not any(name in theirs and name in ours for name in differences)


@pytest.mark.parametrize("number", sorted(model_numbers()))
def test_units_are_those_of_the_sdk(number: int) -> None:
    """They differ by a position a turn of two models (e-manual), and by rounding of velocities."""
    model = servo_model(model_of(number))
    lines = (SDK_FOLDER / f"{model.model.lower().replace('-', '_')}.model").read_text().splitlines()
    rows = {cells[0].strip(): cells[1:] for line in lines if len(cells := line.split("\t")) > 1}
    positions = [
        int(rows[f"value_of_{which}_radian_position"][0]) for which in ("zero", "min", "max")
    ]
    assert model.units.zero_position == positions[0]
    assert model.units.positions_per_turn / 2 == pytest.approx(positions[0] - positions[1], abs=0.5)
    velocity = rows.get("Present Velocity", rows.get("Present Speed"))
    if velocity is not None and velocity[1].strip() == "rad/s":
        assert model.rad_s_per_velocity == pytest.approx(float(velocity[0]), rel=5e-3)
    if model.motor is not None and model.ram_from == 64:
        assert model.rad_s_per_velocity == pytest.approx(0.0239691227, rel=1e-7)


@pytest.mark.parametrize(  # e-manual, XM430-W350, Control Table
    ("name", "address", "size", "signed"),
    [
        ("Operating Mode", 11, 1, False),
        ("Hardware Error Status", 70, 1, False),
        ("Position P Gain", 84, 2, False),
        ("Bus Watchdog", 98, 1, False),
        ("Goal Current", 102, 2, True),
        ("Goal Position", 116, 4, True),
        ("Present Current", 126, 2, True),
        ("Present Position", 132, 4, True),
        ("Present Input Voltage", 144, 2, False),
    ],
)
def test_registers_of_the_manual(name: str, address: int, size: int, signed: bool) -> None:
    register = XM430.register(name)
    assert (register.address, register.size, register.signed) == (address, size, signed)


@pytest.mark.parametrize("spelling", ["xm430-w350", "XM430_W350", "xm430_w350.model"])
def test_names_in_any_spelling(spelling: str) -> None:
    assert load_control_table(spelling).model_number == 1020


def test_what_is_unknown_is_named() -> None:
    with pytest.raises(ControlTableError, match=r"XM999: no such servo model; similar are XM"):
        load_control_table("XM999")
    with pytest.raises(InputError, match="no register 'goal position'; did you mean Goal Position"):
        XM430.register("goal position")
    with pytest.raises(ControlTableError, match="4242"):
        model_of(4242)


@given(st.integers(-(2**31), 2**31 - 1))
def test_values_round_trip(value: int) -> None:
    register = XM430["Goal Position"]
    assert register.decode(register.encode(value)) == value


def test_a_value_that_does_not_fit_is_refused() -> None:
    with pytest.raises(ControlTableError, match="Torque Enable: 256"):
        XM430["Torque Enable"].encode(256)


def test_scales_of_the_xm430() -> None:
    assert UNITS.position_rad(np.array([2048, 4096, 0])) == pytest.approx([0, math.pi, -math.pi])
    assert UNITS.velocity_rad_s(np.array([1])) == pytest.approx(0.229 * 2 * math.pi / 60, rel=1e-3)
    assert UNITS.current_a(np.array([1193, -10])) == pytest.approx([3.209, -0.0269], rel=1e-3)


@given(st.floats(-3.1, 3.1))
def test_angles_survive_to_half_a_step(angle: float) -> None:
    raw = raw_positions(UNITS, np.array([angle]))
    assert abs(UNITS.position_rad(raw)[0] - angle) <= UNITS.rad_per_position / 2 + 1e-12


def test_the_p_series_turns_once_in_its_own_count() -> None:
    table = load_control_table("PH54-200-S500")  # e-manual: 1,003,846 pulses a turn
    assert 2 * math.pi / table.rad_per_position == pytest.approx(1_003_846, rel=1e-4)


def test_a_current_without_a_known_unit_is_an_error_not_a_zero() -> None:
    with pytest.raises(ControlTableError, match=r"YM070-210-A051: .* lacks .*units.current_a"):
        ServoUnits.of(servo_model("YM070-210-A051"))


def test_not_a_number_is_no_goal() -> None:
    with pytest.raises(ValueError, match="finite"):
        raw_positions(UNITS, np.array([0.0, np.nan]))
