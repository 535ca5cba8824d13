"""Labels of least energy: against all labellings of a small grid, and the printed terms."""

from itertools import product

import numpy as np
import pytest

from snakewalk.controller.mapping.mosaic.labelling import (
    cheapest,
    descend,
    flow_of,
    labelled,
)
from tests.oracles.labelling_energy import energy


def problem(seed: int, rows: int = 2, columns: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Costs of 2 scales and 2 places, and no base flow."""
    rng = np.random.default_rng(seed)
    costs = rng.uniform(0.0, 1.0, (rows, columns, 2, 1, 2)).astype(np.float32)
    return costs, np.zeros((rows, columns, 2), np.int64)


def printed_energy(costs, base, penalty: float, labels) -> float:
    """``sum V + sum D`` written out: V is the Potts model on (dx, dy, s)."""
    rows, columns = labels.shape
    full = {}
    total = 0.0
    for i, j in product(range(rows), range(columns)):
        s, rest = divmod(int(labels[i, j]), costs.shape[3] * costs.shape[4])
        y, x = divmod(rest, costs.shape[4])
        full[i, j] = (base[i, j, 0] + x, base[i, j, 1] + y, s)
        total += float(costs[i, j, s, y, x])
    for (i, j), label in full.items():
        for other in ((i + 1, j), (i, j + 1)):
            total += penalty * (full.get(other, label) != label)
    return total


@pytest.mark.parametrize("seed", range(6))
def test_no_labels_of_conditional_modes_have_less_energy(seed: int) -> None:
    costs, base = problem(seed)
    base[:, 1:, 0] = seed % 2  # flows, not places, are compared
    every = [np.array(f).reshape(2, 3) for f in product(range(4), repeat=6)]
    energies = [printed_energy(costs, base, 0.3, f) for f in every]
    found = labelled(costs, base, 0.3)
    value = energy(costs, base, 0.3, found)
    assert value == pytest.approx(printed_energy(costs, base, 0.3, found), abs=1e-6)
    modes = cheapest(costs)
    descend(costs, base, 0.3, 20, modes)
    assert min(energies) - 1e-6 <= value <= energy(costs, base, 0.3, modes) + 1e-6
    if seed in {2, 4, 5}:
        assert value == pytest.approx(min(energies), abs=1e-5)


def test_conditional_modes_never_raise_the_energy_and_end_where_no_change_helps() -> None:
    costs, base = problem(9, 6, 7)
    labels = cheapest(costs)
    before = energy(costs, base, 0.4, labels)
    descend(costs, base, 0.4, 1, labels)
    middle = energy(costs, base, 0.4, labels)
    descend(costs, base, 0.4, 50, labels)
    after = energy(costs, base, 0.4, labels)
    assert after <= middle < before
    for i, j in product(range(6), range(7)):
        for label in range(4):
            changed = labels.copy()
            changed[i, j] = label
            assert energy(costs, base, 0.4, changed) >= after - 1e-6


def test_the_printed_data_term_chooses_the_worst_match() -> None:
    """``D = corr`` is least where patches differ most; ``1 - corr`` is least where they agree."""
    likeness = np.array([[[[[0.9, -0.4]]]]], np.float32)
    base = np.zeros((1, 1, 2), np.int64)
    assert labelled(likeness, base, 0.1)[0, 0] == 1
    assert labelled(1.0 - likeness, base, 0.1)[0, 0] == 0


def test_a_pixel_without_a_search_region_has_no_label() -> None:
    costs, base = problem(3)
    costs[0, 1] = np.inf
    labels = labelled(costs, base, 0.3)
    assert labels[0, 1] == -1
    assert (np.delete(labels.ravel(), 1) >= 0).all()
    flow, _ = flow_of(costs, base, labels)
    assert np.isnan(flow[0, 1]).all()
