"""Functions of long columns see some rows at a time."""

import numpy as np

from snakewalk.controller.runlog.column import by_rows


def test_every_nth_row_of_a_wide_column_comes_in_parts() -> None:
    column = np.zeros((4000, 10_000))  # 80 kB a row, without memory
    column[:, 0] = np.arange(4000)
    sizes: list[int] = []

    def first(rows: np.ndarray) -> np.ndarray:
        sizes.append(len(rows))
        return rows[:, 0]

    every_fourth = column[::4]
    assert np.array_equal(by_rows(first, every_fourth), every_fourth[:, 0])
    assert len(sizes) > 1
    assert max(sizes) * every_fourth.strides[0] <= 1 << 24
