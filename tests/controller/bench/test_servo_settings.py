"""Changing what outlives a servo's power: planned, refused, written, read back."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.controller.bench.servo_settings import SettingsRequest, apply, open_servo, plan
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import ControlTableError, NoAnswerError, ServoError
from snakewalk.drivers.protocol.registers import BAUDS, baud_code, bauds_of
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant


@pytest.fixture
def line() -> SimLine:
    return SimLine(ServoBank([1, 2]), BenchPlant(2))


@pytest.fixture
def bus(line: SimLine) -> DynamixelBus:
    return open_servo(line, 1, 0.004)


def test_the_model_is_found_by_asking() -> None:
    line = SimLine(ServoBank([4], "XL330-M288"), BenchPlant(1))
    assert open_servo(line, 4, 0.004).table.model == "XL330-M288"
    with pytest.raises(NoAnswerError, match="servo 5"):
        open_servo(line, 5, 0.004)


@pytest.mark.parametrize("servo_id", [-1, 253, 254, 255, 1000])
def test_ids_out_of_range(line: SimLine, bus: DynamixelBus, servo_id: int) -> None:
    with pytest.raises(InputError, match=f"--id {servo_id}: a bus has IDs 0 to 252"):
        open_servo(line, servo_id, 0.004)
    with pytest.raises(InputError, match=f"--new-id {servo_id}: a bus has IDs 0 to 252"):
        plan(bus, 1, SettingsRequest(new_id=servo_id))


def test_planning_writes_nothing(line: SimLine, bus: DynamixelBus) -> None:
    before = line.bank.table.copy()
    changes = plan(
        bus, 1, SettingsRequest(new_id=9, new_baud=57_600, return_delay_us=0.0, voltage_max_v=14.0)
    )
    assert [(c.register, c.before, c.after) for c in changes] == [
        ("Max Voltage Limit", 160, 140),
        ("Return Delay Time", 250, 0),
        ("ID", 1, 9),
        ("Baud Rate", 3, 1),
    ]
    assert (line.bank.table[:, :64] == before[:, :64]).all()


def test_what_is_so_already_is_no_change(bus: DynamixelBus) -> None:
    assert plan(bus, 1, SettingsRequest(new_id=1, new_baud=1_000_000, return_delay_us=500.0)) == ()


def test_all_is_written_and_the_servo_answers_under_its_new_id_and_baud(
    line: SimLine, bus: DynamixelBus
) -> None:
    request = SettingsRequest(
        new_id=9,
        new_baud=4_000_000,
        min_position_rad=-1.5,
        max_position_rad=1.5,
        current_limit_a=2.0,
        temperature_limit_c=75,
    )
    apply(bus, 1, plan(bus, 1, request))
    bank = line.bank
    assert line.getBaudRate() == 4_000_000
    assert bus.ping(9).model_number == 1020
    assert (bank["ID"][0], bank["Baud Rate"][0], bank["Temperature Limit"][0]) == (9, 6, 75)
    assert bank["Current Limit"][0] == round(2.0 / 2.69e-3)
    assert (bank["Min Position Limit"][0], bank["Max Position Limit"][0]) == (1070, 3026)
    assert bank["ID"][1] == 2


def test_torque_that_is_on_goes_off_first_and_is_shown(line: SimLine, bus: DynamixelBus) -> None:
    bus.write(1, "Torque Enable", 1)
    changes = plan(bus, 1, SettingsRequest(new_id=3))
    assert [c.register for c in changes] == ["Torque Enable", "ID"]
    apply(bus, 1, changes)
    assert line.bank["ID"].tolist() == [3, 2]
    assert line.bank["Torque Enable"].tolist() == [0, 0]


def test_all_wrong_wishes_at_once(bus: DynamixelBus) -> None:
    request = SettingsRequest(new_id=2, new_baud=9999, min_position_rad=4.0, voltage_min_v=-1.0)
    with pytest.raises(InputError) as info:
        plan(bus, 1, request)
    lines = "\n".join(info.value.faults)
    assert "--new-id 2: there is a servo with this ID already" in lines
    assert "--new-baud 9999 baud: a XM430-W350 has 9600, 57600" in lines
    assert "--min-position 4: beyond half a turn" in lines
    assert "--voltage-min -1: is negative" in lines


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_values_that_no_register_holds(bus: DynamixelBus, value: float) -> None:
    for field in ("temperature_limit_c", "max_position_rad", "return_delay_us", "current_limit_a"):
        with pytest.raises(InputError) as info:
            plan(bus, 1, SettingsRequest(**{field: value}))
        assert ("must be a finite number" in info.value.faults[0]) == (not np.isfinite(value))


def test_position_limits_the_wrong_way_round(bus: DynamixelBus) -> None:
    with pytest.raises(InputError, match="the lower is not below the upper"):
        plan(bus, 1, SettingsRequest(min_position_rad=1.0, max_position_rad=-1.0))


def test_what_the_servo_refuses_is_said(bus: DynamixelBus) -> None:
    with pytest.raises(ServoError, match="Temperature Limit: refused: data range"):
        apply(bus, 1, plan(bus, 1, SettingsRequest(temperature_limit_c=140)))


@pytest.mark.parametrize(
    ("model", "fastest"), [("XM430-W350", 4_500_000), ("XL330-M288", 4_000_000)]
)
def test_baud_codes(model: str, fastest: int) -> None:
    facts = servo_model(model)
    rates = bauds_of(facts)
    assert max(rates) == fastest
    assert [baud_code(facts, baud) for baud in rates] == list(range(len(rates)))


def test_a_baud_rate_the_model_lacks() -> None:
    with pytest.raises(ControlTableError, match="4500000 baud: a XL330-M288 has"):
        baud_code(servo_model("XL330-M288"), BAUDS[-1])
    with pytest.raises(ControlTableError, match="its file gives no baud rates"):
        bauds_of(servo_model("YM070-210-A051"))
