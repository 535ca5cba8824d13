"""Scales of models with and without a sensor of current, and of files that lack values."""

import math

import pytest

from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.protocol.registers import ServoUnits, bauds_of


def test_a_model_without_a_sensor_has_a_thousandth_of_its_stall_current_per_unit() -> None:
    """Present Load counts 0.1 %; an XL430-W250 stalls at 1.3 A."""
    units = ServoUnits.of(servo_model("XL430-W250"))
    assert not units.measures_current
    assert not units.limits_current
    assert units.a_per_current == pytest.approx(1.3e-3)
    assert units.stall_current_a == 1.3


def test_a_model_with_a_sensor_keeps_the_unit_of_its_register() -> None:
    """e-manual: 2.69 mA a unit, and a mode that limits the current."""
    units = ServoUnits.of(servo_model("XM430-W350"))
    assert units.measures_current
    assert units.limits_current
    assert units.a_per_current == pytest.approx(2.69e-3)


def test_only_a_model_without_a_sensor_needs_its_stall_current() -> None:
    unknown = servo_model("XM430-W350").model_copy(update={"motor": None})
    assert math.isnan(ServoUnits.of(unknown).stall_current_a)
    unknown = servo_model("XL430-W250").model_copy(update={"motor": None})
    with pytest.raises(ControlTableError, match=r"lacks .*motor\.stall_current_a"):
        ServoUnits.of(unknown)


def test_rates_that_a_file_does_not_give_are_an_error() -> None:
    model = servo_model("XM430-W350")
    assert bauds_of(model)[1] == 57_600
    with pytest.raises(ControlTableError, match="XM430-W350: its file gives no baud rates"):
        bauds_of(model.model_copy(update={"bauds": ()}))
