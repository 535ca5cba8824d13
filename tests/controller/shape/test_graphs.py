"""Graphs: drawn with the degree asked for, connected, the same for a seed; refusals."""

import re
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.shape.graphs import (
    Graph,
    graph_from_edges,
    largest_part,
    random_edges,
    small_world_edges,
    threshold_graph,
)
from snakewalk.controller.studies.graph_study import graph_source


def net(graph: Graph) -> "nx.Graph[int]":
    pairs = zip(np.repeat(np.arange(graph.states), graph.degree), graph.indices, strict=True)
    return nx.Graph((int(a), int(b)) for a, b in pairs)


def draw(spec: str, seed: int = 0) -> Graph:
    return graph_source(spec)(np.random.default_rng(seed))


def test_neighbour_lists_are_those_of_the_edges() -> None:
    graph = graph_from_edges(4, np.array([[0, 1], [1, 0], [2, 1], [3, 3], [3, 0]]))
    assert [list(part) for part in np.split(graph.indices, graph.indptr[1:-1])] == [
        [1, 3],
        [0, 2],
        [1],
        [0],
    ]
    assert graph.degree.tolist() == [2, 2, 1, 1]
    assert graph.mean_degree == 1.5


def test_a_disconnected_graph_is_refused_and_its_largest_part_can_be_walked() -> None:
    edges = np.array([[0, 1], [2, 3], [3, 5], [5, 2]])
    with pytest.raises(InputError, match="6 states fall into 3 parts, the largest of 3; no walk"):
        graph_from_edges(6, edges)
    part = largest_part(6, edges)
    assert (part.states, part.degree.tolist()) == (3, [2, 2, 2])


def test_too_few_states_and_edges_to_none_are_refused() -> None:
    with pytest.raises(InputError, match="2 states or more"):
        graph_from_edges(1, np.zeros((0, 2), dtype=np.int64))
    with pytest.raises(InputError, match="outside the states 0 to 2"):
        graph_from_edges(3, np.array([[0, 3]]))
    with pytest.raises(InputError, match="5 states without an edge"):
        largest_part(5, np.zeros((0, 2), dtype=np.int64))


def test_random_edges_are_distinct_pairs_as_often_as_asked() -> None:
    edges = [random_edges(200, 6.0, np.random.default_rng(seed)) for seed in range(60)]
    for one in edges:
        assert (one[:, 0] < one[:, 1]).all()
        assert len(np.unique(one, axis=0)) == len(one)
    count = np.array([len(one) for one in edges])
    spread = np.sqrt(600.0)  # nearly Poisson
    assert abs(count.mean() - 600.0) < 4.0 * spread / np.sqrt(len(count))
    assert 0.6 * spread < count.std() < 1.4 * spread
    ends = np.bincount(np.concatenate(edges).ravel(), minlength=200)  # no state is preferred
    assert abs(ends - 360.0).max() < 5.0 * np.sqrt(360.0)


def test_no_pair_is_preferred_in_a_dense_graph() -> None:
    drawn = np.zeros((6, 6))
    for seed in range(2000):
        edges = random_edges(6, 2.5, np.random.default_rng(seed))
        drawn[edges[:, 0], edges[:, 1]] += 1
    share = drawn[np.triu_indices(6, 1)] / 2000
    assert abs(share - 0.5).max() < 4.0 * 0.5 / np.sqrt(2000)


@pytest.mark.parametrize("degree", [2, 3, 6, 9])
def test_a_small_world_that_is_not_rewired_is_a_ring_of_near_neighbours(degree: int) -> None:
    graph = largest_part(60, small_world_edges(60, degree, 0.0, np.random.default_rng(0)))
    assert graph.mean_degree == degree
    reach = degree // 2 + degree % 2
    for q in range(60):
        apart = (graph.indices[graph.indptr[q] : graph.indptr[q + 1]] - q) % 60
        assert np.minimum(apart, 60 - apart).max() <= reach


def test_rewiring_moves_ends_keeps_the_number_of_edges_and_shortens_the_ways() -> None:
    rng = np.random.default_rng(3)
    near, moved = (small_world_edges(400, 6, share, rng) for share in (0.0, 0.1))
    assert len(np.unique(np.sort(moved, axis=1), axis=0)) == len(near) == 1200
    assert (moved[:, 0] == near[:, 0]).all()
    assert 0.06 < np.mean(moved[:, 1] != near[:, 1]) < 0.14
    ways = [nx.average_shortest_path_length(net(largest_part(400, e))) for e in (near, moved)]
    assert ways[1] < 0.3 * ways[0]


@pytest.mark.parametrize("spec", ["er:300:3", "ws:300:3:0.3"])
def test_a_spec_draws_connected_graphs_the_same_for_a_seed(spec: str) -> None:
    one, same, other = draw(spec), draw(spec), draw(spec, 1)
    assert nx.is_connected(net(one))
    assert 200 < one.states <= 300
    np.testing.assert_array_equal(one.indices, same.indices)
    assert not np.array_equal(one.indices, other.indices)


def test_states_of_a_recording_are_joined_up_to_the_threshold() -> None:
    states = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0j], [1.0, 0.0]])
    graph = threshold_graph(states, None)  # 2 is the smallest that joins all
    assert graph.degree.tolist() == [2, 3, 2, 3]
    assert threshold_graph(states, 2.0).degree.tolist() == [2, 3, 2, 3]
    with pytest.raises(InputError, match="fall into 2 parts"):
        threshold_graph(states, 1.999)


def test_the_threshold_that_is_advised_joins_all() -> None:
    for seed in range(20):
        states = np.random.default_rng(seed).normal(size=(30, 2)) + 0j
        with pytest.raises(InputError, match="joins all") as refused:
            threshold_graph(states, 0.05)
        advised = re.search(r"threshold 0.05; ([\d.e+-]+) joins all", str(refused.value))
        assert advised is not None
        assert threshold_graph(states, float(advised[1])).states == 30


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("er:1000", "expected er:STATES:DEGREE"),
        ("er:1000:x", "expected er:STATES:DEGREE"),
        ("ring:1000:3", "expected er:STATES:DEGREE"),
        ("", "expected er:STATES:DEGREE"),
        ("er:1000.5:3", "a whole number"),
        ("er:nan:3", "4 to 1000000 states"),
        ("er:3:1", "4 to 1000000 states"),
        ("er:1000:nan", "the degree must be 0.1 to under half"),
        ("er:1000:500", "the degree must be 0.1 to under half"),
        ("er:1000000:90", "more than 20000000 edges"),
        ("ws:1000:3", "expected er:STATES:DEGREE"),
        ("ws:1000:3.5:0.1", "must be a whole number"),
        ("ws:1000:1:0.1", "the degree must be 2 to under half"),
        ("ws:1000:6:1.5", "from 0 to 1"),
    ],
)
def test_a_bad_spec_is_refused_before_anything_is_drawn(spec: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        graph_source(spec)


@pytest.mark.parametrize("form", ["graphml", "gml", "edgelist"])
def test_a_graph_of_ones_own_is_read_from_a_file(tmp_path: Path, form: str) -> None:
    ring = nx.cycle_graph(12)
    path = tmp_path / f"ring.{form}"
    getattr(nx, f"write_{form}")(ring, path)
    graph = graph_source(str(path))(np.random.default_rng(0))
    assert graph.states == 12
    assert (graph.degree == 2).all()


def test_a_bad_graph_file_says_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        graph_source(str(tmp_path / "none.graphml"))
    broken = tmp_path / "broken.graphml"
    broken.write_text("<graphml>")
    with pytest.raises(InputError, match="is no graphml file"):
        graph_source(str(broken))
    apart = tmp_path / "apart.edgelist"
    nx.write_edgelist(nx.disjoint_union(nx.cycle_graph(4), nx.cycle_graph(4)), apart)
    with pytest.raises(InputError):
        graph_source(str(apart))
