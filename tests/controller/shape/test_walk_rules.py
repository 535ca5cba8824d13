"""Each rule against the same rule written plainly, and what the printed F does."""

import itertools
from fractions import Fraction

import networkx as nx
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.shape.graphs import Graph, graph_from_edges
from snakewalk.controller.shape.walks import RULES, SHORT_RETURN, Walk, walk
from snakewalk.controller.studies.graph_study import graph_source, return_gaps

SPECS = ("er:150:3", "er:150:9", "ws:150:3:0.1", "ws:150:6:0.2")


def draw(spec: str, seed: int = 1) -> Graph:
    return graph_source(spec)(np.random.default_rng(seed))


def near(graph: Graph, q: int) -> list[int]:
    return [int(n) for n in graph.indices[graph.indptr[q] : graph.indptr[q + 1]]]


def done(graph: Graph, rule: str, seed: int = 1, max_steps: int | None = None) -> Walk:
    return walk(graph, rule, 0, np.random.default_rng(seed), max_steps)


def left_for(path: np.ndarray, states: int, *, fresh: bool) -> np.ndarray:
    """(V,) times that each state was left for a fresh one, or for one seen before."""
    counted = np.zeros(states, dtype=int)
    seen = {int(path[0])}
    for here, there in zip(path.tolist()[:-1], path.tolist()[1:], strict=True):
        counted[here] += (there not in seen) is fresh
        seen.add(there)
    return counted


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("rule", RULES)
def test_a_walk_follows_edges_sees_all_and_stops_when_it_does(spec: str, rule: str) -> None:
    graph = draw(spec)
    found = done(graph, rule)
    assert found.covered
    path = found.path.tolist()
    assert all(b in near(graph, a) for a, b in itertools.pairwise(path))
    assert len(set(path)) == graph.states
    assert len(set(path[:-1])) == graph.states - 1
    np.testing.assert_array_equal(found.selected, np.bincount(path))


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("rule", ["snake", "snake-printed", "degree"])
def test_each_step_takes_the_largest_value_and_then_the_longest_unseen(
    spec: str, rule: str
) -> None:
    graph = draw(spec, 4)
    selected, failures, last = [0] * graph.states, [0] * graph.states, [-1] * graph.states

    def value(q: int) -> Fraction:
        degree, m, f = len(near(graph, q)), selected[q], failures[q]
        if rule == "degree":
            return Fraction(degree, 2**m)
        return Fraction(degree, 1 - (m > 0) + degree * ((m > 0) + (f > 0)) + m * 2**f)

    path = done(graph, rule).path.tolist()
    for step, (here, there) in enumerate(zip([-1, *path[:-1]], path, strict=True)):
        if step:
            best = max(near(graph, here), key=lambda q: (value(q), -last[q], -q))
            assert there == best, step
            failures[here] += (selected[there] == 0) is (rule == "snake-printed")
        selected[there] += 1
        last[there] = step


@pytest.mark.parametrize("spec", SPECS)
def test_the_stack_walk_is_depth_first_with_the_way_back(spec: str) -> None:
    graph = draw(spec, 2)
    expected: list[int] = []
    seen: set[int] = set()

    def visit(q: int) -> None:
        seen.add(q)
        expected.append(q)
        while fresh := [n for n in near(graph, q) if n not in seen]:
            visit(max(fresh, key=lambda n: len(near(graph, n))))
            expected.append(q)

    visit(0)
    path = done(graph, "stack").path.tolist()
    assert path == expected[: len(path)]
    assert len(path) - 1 <= 2 * (graph.states - 1)


@pytest.mark.parametrize("spec", [*SPECS, "kp:worm-like"])
def test_the_frontier_walk_takes_the_unvisited_neighbour_of_fewest_unvisited(spec: str) -> None:
    graph = draw(spec, 3)
    path = done(graph, "frontier").path.tolist()
    seen = {path[0]}
    for here, there in itertools.pairwise(path):
        fresh = [n for n in near(graph, here) if n not in seen]

        def left(q: int, seen: set[int] = seen) -> tuple[int, int, int]:
            around = near(graph, q)
            return sum(n not in seen for n in around), len(around), q

        if fresh:
            assert there == min(fresh, key=left)
        seen.add(there)


@pytest.mark.parametrize("spec", ["er:150:3", "er:300:6", "ws:150:3:0.1", "ws:300:6:0.1"])
def test_the_frontier_walk_goes_on_by_known_states_and_around_those_it_left_lately(
    spec: str,
) -> None:
    graph = draw(spec, 3)
    net = nx.Graph((a, b) for a in range(graph.states) for b in near(graph, a))
    path = done(graph, "frontier").path.tolist()
    soon = SHORT_RETURN * graph.states
    fresh = sorted(path.index(q) for q in range(graph.states))  # steps at which a state was new
    free = 0
    for begin, end in itertools.pairwise(fresh):
        if end == begin + 1:
            continue
        here, seen = path[begin], set(path[: begin + 1])
        assert seen.issuperset(near(graph, here))
        last = {q: k for k, q in enumerate(path[: begin + 1])}
        border = {n for q in seen for n in near(graph, q)} - seen
        away = nx.single_source_shortest_path_length(net.subgraph(seen | border), here)
        assert end - begin >= min(away[n] for n in border)
        lately = {q for q in seen - {here} if begin + 1 - last[q] < soon}
        away = nx.single_source_shortest_path_length(net.subgraph(seen - lately | border), here)
        if around := [away[n] for n in border if n in away]:
            assert end - begin <= min(around)
            assert all(k - last[path[k]] >= soon for k in range(begin + 1, end))
            free += 1
    assert free > 0


@pytest.mark.parametrize("spec", ["er:300:3", "er:300:6", "er:300:9", "ws:300:3:0.1"])
def test_the_frontier_walk_is_nearer_to_one_step_a_state_and_returns_soon_less_often(
    spec: str,
) -> None:
    steps, soon = (dict.fromkeys(("frontier", "snake", "stack"), 0) for _ in range(2))
    states = 0
    for seed in range(8):
        graph = draw(spec, seed)
        states += graph.states
        for rule in steps:
            found = done(graph, rule)
            steps[rule] += found.steps
            soon[rule] += np.count_nonzero(return_gaps(found) < SHORT_RETURN * graph.states)
    over = {rule: count - states for rule, count in steps.items()}
    assert over["frontier"] < 0.5 * min(over["snake"], over["stack"])
    assert soon["frontier"] <= soon["snake"]


@pytest.mark.parametrize("rule", RULES)
def test_each_leaf_but_the_ends_of_a_walk_forces_a_short_return(rule: str) -> None:
    graph = draw("er:300:3")
    found = done(graph, rule)
    leaves = set(np.flatnonzero(graph.degree == 1).tolist()) - {found.path[0], found.path[-1]}
    assert len(leaves) > 30
    assert np.count_nonzero(return_gaps(found) == 2) >= len(leaves)


def test_the_random_walk_takes_a_fresh_neighbour_whenever_there_is_one() -> None:
    graph = draw("er:150:6")
    path = done(graph, "random").path.tolist()
    seen = {path[0]}
    for here, there in itertools.pairwise(path):
        assert there not in seen or seen.issuperset(near(graph, here))
        seen.add(there)
    assert path == done(graph, "random").path.tolist()
    assert path != done(graph, "random", seed=2).path.tolist()


@pytest.mark.parametrize("rule", RULES)
def test_no_rule_repeats_a_state_where_the_next_one_is_always_fresh(rule: str) -> None:
    pairs = [(a, b) for a in range(30) for b in range(a)]
    ring = [(k, (k + 1) % 50) for k in range(50)]
    for edges, states in ((pairs, 30), (ring, 50)):
        assert done(graph_from_edges(states, np.array(edges)), rule).steps == states - 1


def test_eq_3_holds_for_the_corrected_f_and_not_for_the_printed_one() -> None:
    graph = draw("er:300:3")
    broken = 0
    for rule, fresh in (("snake", False), ("snake-printed", True)):
        found = done(graph, rule)
        failures = left_for(found.path, graph.states, fresh=fresh)
        np.testing.assert_array_equal(found.failures, failures)
        here = found.path[-1]  # selected, not left yet
        held = (graph.degree + failures >= found.selected) & (found.selected >= failures)
        held[here] = True
        if rule == "snake":
            assert held.all()
        broken += np.count_nonzero(~held)
    assert broken > 10


def test_with_the_printed_f_a_state_that_led_on_is_taken_for_a_failure() -> None:
    """Footnote of [PT]: F > 0 "will certainly lead us to select another already visited state"."""
    graph = draw("er:300:6")
    for rule, right in (("snake", True), ("snake-printed", False)):
        path = done(graph, rule).path.tolist()
        seen = {path[0]}
        failed: set[int] = set()
        certain = True
        for here, there in itertools.pairwise(path):
            fresh = there not in seen
            certain &= not (fresh and here in failed)
            if fresh is (rule == "snake-printed"):
                failed.add(here)
            seen.add(there)
        assert certain is right


@pytest.mark.parametrize("spec", ["er:300:3", "er:300:6", "er:300:9", "ws:300:6:0.1"])
def test_the_printed_f_is_slower(spec: str) -> None:
    graphs = [draw(spec, seed) for seed in range(5)]
    ours, printed = (sum(done(g, rule).steps for g in graphs) for rule in RULES[:2])
    assert printed > 1.3 * ours


def test_a_walk_out_of_steps_says_that_it_did_not_cover() -> None:
    graph = draw("er:150:6")
    found = done(graph, "snake", max_steps=20)
    assert (found.steps, found.covered) == (20, False)


def test_an_unknown_rule_and_a_start_outside_are_refused() -> None:
    graph = draw("er:150:6")
    with pytest.raises(InputError, match="rule 'eel': expected one of snake, snake-printed"):
        done(graph, "eel")
    with pytest.raises(InputError, match=f"start {graph.states}: expected a state from 0"):
        walk(graph, "snake", graph.states, np.random.default_rng(0))
