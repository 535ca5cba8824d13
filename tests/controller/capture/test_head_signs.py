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
