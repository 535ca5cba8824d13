"""The constants of the head's likelihood are those that the films of the bench teach."""

import pytest

from benchmarks.head_signs import (
    WIDENED,
    drawn,
    learnt,
    measured,
    midlines_of,
    repetition,
    stored,
)
from benchmarks.head_windows import calibration
from snakewalk.controller.capture.stages.head import GROUPS


@pytest.mark.parametrize("number", range(len(GROUPS)))
def test_constants_in_use_are_those_of_the_table(number: int) -> None:
    table = stored()
    constants = learnt(table)
    group = GROUPS[number]
    for name, sign in group.signs.items():
        mean, deviation = constants[name]
        assert sign.mean == pytest.approx(mean, abs=0.05)
        assert sign.deviation == pytest.approx(WIDENED * deviation, abs=0.05)
    assert group.repeated == pytest.approx(repetition(table, [*group.signs]), abs=0.1)


@pytest.mark.slow
def test_a_film_of_the_table_has_its_signs_again() -> None:
    table = stored()
    signs = measured(drawn(0), midlines_of(drawn(0), 0))
    for name, (value, error) in signs.items():
        assert (value, error) == pytest.approx(table[name][0], abs=0.02)


def test_right_heads_are_compared_with_those_that_were_promised() -> None:
    rows = calibration([(0.6, True), (0.65, False), (0.75, True), (0.95, True)]).splitlines()
    assert rows[2:] == [
        "| 0.5 to 0.7 | 2 | 1.2 | 1 |",
        "| 0.7 to 0.8 | 1 | 0.8 | 1 |",
        "| 0.8 to 0.9 | 0 | 0.0 | 0 |",
        "| 0.9 to 1 | 1 | 0.9 | 1 |",
        "| 0.5 to 0.9 | 3 | 2.0 | 2 |",
        "| 0.5 to 1 | 4 | 3.0 | 3 |",
    ]
