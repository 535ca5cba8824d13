"""Tables of the gaits' pages, from facts as the command prints them."""

import math

from benchmarks.gait_pages import climbing_table, motion_table, slip_table, swimming_table

FACTS = {
    "robot": "alternating16",
    "world": "isotropic",
    "frequency_hz": 0.5,
    "lowest_rate": 0.63,
    "forward_body_lengths_cycle": -0.001,
    "left_body_lengths_cycle": 0.158,
    "up_body_lengths_cycle": 0.2,
    "turn_rad_cycle": -0.9,
    "speed_m_s": 0.094,
    "electrical_cost_of_transport": 0.468,
    "mechanical_cost_of_transport": 0.17,
    "peak_current_a": 1.404,
}


def cells(table: str) -> list[str]:
    return [cell.strip() for cell in table.splitlines()[-1].strip("|").split("|")]


def test_a_row_has_the_motion_of_a_cycle_and_its_cost() -> None:
    row = cells(motion_table({"rolling": FACTS}))
    assert row[:4] == ["rolling", "yaw, pitch", "alternating16, isotropic", "0.50"]
    assert row[4:] == ["-0.001", "0.158", "-0.900", "0.094", "0.47", "0.17"]


def test_a_turn_on_the_spot_has_no_cost_of_transport() -> None:
    turning = {**FACTS, "left_body_lengths_cycle": 0.018, "turn_rad_cycle": 1.458}
    assert cells(motion_table({"turn-in-place": turning}))[-2:] == ["", ""]


def test_geometry_limits_a_gait_without_slip() -> None:
    """An arc rolls on by its circumference: 2 pi 0.03 m of a body of 17 links of 7 cm."""
    rows = {"lateral-undulation": {**FACTS, "forward_body_lengths_cycle": 0.6}, "rolling": FACTS}
    without = 2.0 * math.pi * 0.03 / (17 * 0.07)
    assert cells(slip_table(rows))[1:] == ["0.158", f"{without:.3f}", f"{0.158 / without:.2f}"]


def test_a_mode_has_its_row_of_the_table_of_gc() -> None:
    row = cells(swimming_table({"anguilliform": FACTS}))
    assert row[:3] == ["`anguilliform`", "0 to 0.3, 1.5, 1 Hz", "`alternating16`"]


def test_a_helix_rolls_along_the_pole_and_about_it() -> None:
    """2 pi r cos g along the axis and 2 pi r sin g / R about it (``gaits/helix.py``)."""
    row = cells(climbing_table({"helix-pole": FACTS}))
    around = 2.0 * math.pi * 0.03
    assert row[1:5] == [
        f"{0.2 * 17 * 0.07:.3f}",
        f"{around * math.cos(0.3):.3f}",
        "0.900",
        f"{around * math.sin(0.3) / 0.09:.3f}",
    ]
    assert row[5:] == ["63%", "1.40 A"]
    pipe = cells(climbing_table({"helix-pipe": FACTS}))
    assert pipe[3:5] == ["", ""]
