"""Walks that cover a graph: the snake walk, its rivals ([PT] 2.6.2, [KP] 4.2.1), and ``frontier``.

``W(q) = deg / (1 - sign M + deg (sign M + sign F) + M 2^F)``; the neighbour with the largest W is
next. Correction: F(q) counts how often q was left for a *visited* state. With the printed
"unvisited", Eq. 3 fails (``snake-printed`` keeps it for comparison). W is compared by integers,
because 2^F overflows floats. Ties go to the least recently visited neighbour, then to the first in
the list. Algorithm 2's ``until n < N`` is read as "until all states are seen".

``frontier`` (ours) uses Warnsdorff's rule: it goes to the unvisited neighbour with the fewest
unvisited neighbours. Without one, it goes through visited states to an unvisited one, by the path
of fewest short returns, then of fewest steps. It looks only at neighbours of visited states.
"""

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise

import numpy as np

from snakewalk.config.arrays import Ints
from snakewalk.config.errors import InputError
from snakewalk.controller.shape.graphs import Graph

RULES = ("snake", "snake-printed", "frontier", "stack", "random", "degree")
SHORT_RETURN = 0.05
"""Share of |V|: [PT] 2.6.2 demands at least this number of steps between two visits of a state."""


@dataclass(frozen=True, slots=True)
class Walk:
    """A walk from its start until all states are seen or the steps run out."""

    path: Ints
    """(steps + 1,) states in order, the start first."""
    selected: Ints
    """(V,) M: how often each was selected, the start counted."""
    failures: Ints
    """(V,) F of the rule; zeros for rules without it."""
    covered: bool
    """Whether every state was seen."""

    @property
    def steps(self) -> int:
        """Number of edges walked."""
        return len(self.path) - 1


def walk(
    graph: Graph,
    rule: str,
    start: int,
    rng: np.random.Generator,
    max_steps: int | None = None,
) -> Walk:
    """Walk from ``start`` until all states are seen.

    A step costs O(neighbours); a search of ``frontier`` costs up to O(E log V).

    Args:
        graph: graph to cover.
        rule: one of ``RULES``.
        start: first state.
        rng: used by ``random`` only.
        max_steps: default V^2, which a random walk may need.

    Raises:
        InputError: unknown rule, or the start is not a state.

    """
    check_rule(rule)
    if not 0 <= start < graph.states:
        raise InputError(f"start {start}: expected a state from 0 to {graph.states - 1}")
    state = _WalkState(graph, start)
    choose: Callable[[list[int]], int] = {
        "snake": state.snake,
        "snake-printed": state.snake,
        "frontier": state.frontier,
        "stack": state.stack_top,
        "random": lambda near: state.free(near, rng),
        "degree": state.degree_over_visits,
    }[rule]
    counts_fresh = {"snake": False, "snake-printed": True}.get(rule)
    limit = graph.states**2 if max_steps is None else max_steps
    while state.step < limit and state.visited < graph.states:
        state.move(choose(state.near[state.path[-1]]), counts_fresh)
    return Walk(
        path=np.array(state.path, dtype=np.int64),
        selected=np.array(state.selected, dtype=np.int64),
        failures=np.array(state.failures, dtype=np.int64),
        covered=state.visited == graph.states,
    )


def check_rule(rule: str) -> None:
    """Raise InputError if ``rule`` is not one of ``RULES``."""
    if rule not in RULES:
        raise InputError(f"rule {rule!r}: expected one of {', '.join(RULES)}")


def compare_w(a: tuple[int, int, int], b: tuple[int, int, int]) -> int:
    """Sign of W(a) - W(b), exact, for (deg, M, F) each ([PT] Eq. 4-7)."""
    (over_a, under_a), (over_b, under_b) = _one_over_w(*a), _one_over_w(*b)
    left, right = over_b * under_a, over_a * under_b
    return (left > right) - (left < right)


def _one_over_w(degree: int, selected: int, failures: int) -> tuple[int, int]:
    if selected == 0:
        return 1, degree
    return degree * (1 + (failures > 0)) + (selected << failures), degree


class _WalkState:
    """State of a walk, in plain lists: a state has about ten neighbours."""

    def __init__(self, graph: Graph, start: int) -> None:
        ends = graph.indptr.tolist()
        flat = graph.indices.tolist()
        self.near = [flat[a:b] for a, b in pairwise(ends)]
        self.degree = graph.degree.tolist()
        self.selected = [0] * graph.states
        self.failures = [0] * graph.states
        self.last = [-1] * graph.states
        self.path = [start]
        self.branches = [start]
        self.ahead: list[int] = []
        self.unvisited_near = self.degree.copy()
        self.selected[start] = 1
        self.last[start] = 0
        self.visited = 1
        self._count_visit(start)

    @property
    def step(self) -> int:
        return len(self.path) - 1

    def move(self, to: int, counts_fresh: bool | None) -> None:
        """Go to ``to``; F of the state left grows if ``to`` is as fresh as ``counts_fresh``."""
        fresh = self.selected[to] == 0
        if counts_fresh is not None and fresh is counts_fresh:
            self.failures[self.path[-1]] += 1
        self.visited += fresh
        if fresh:
            self._count_visit(to)
        self.selected[to] += 1
        self.path.append(to)
        self.last[to] = self.step

    def snake(self, near: list[int]) -> int:
        fresh = self._unvisited_states(near)
        if fresh:  # W = deg
            return max(fresh, key=self.degree.__getitem__)
        best = near[0]
        score = (self.degree[best], self.selected[best], self.failures[best])
        for q in near[1:]:
            other = (self.degree[q], self.selected[q], self.failures[q])
            sign = compare_w(other, score)
            if sign > 0 or (sign == 0 and self.last[q] < self.last[best]):
                best = q
                score = other
        return best

    def frontier(self, near: list[int]) -> int:
        """Warnsdorff's choice among the unvisited; without any, a step towards one elsewhere."""
        fresh = self._unvisited_states(near)
        if fresh:
            return min(fresh, key=lambda q: (self.unvisited_near[q], self.degree[q]))
        if not self.ahead:
            self.ahead = self._way_towards_unvisited()
        return self.ahead.pop()

    def _way_towards_unvisited(self) -> list[int]:
        """Visited states to walk, last first; the last one has an unvisited neighbour (Dijkstra).

        The cost is the number of short returns, then of steps; ties go by Warnsdorff's rule.
        """
        short_return_steps = SHORT_RETURN * len(self.near)
        current = self.path[-1]
        now = self.step
        predecessor = {current: current}
        cost = {current: (0, 0)}
        queue = [(0, 0, 0, 0, current)]
        while True:  # the graph is connected, so a path exists
            returns, steps, _, _, q = heappop(queue)
            if not self.selected[q]:
                break
            if (returns, steps) > cost[q]:
                continue  # a better path to q was expanded
            for n in self.near[q]:
                early = self.selected[n] > 0 and now + steps + 1 - self.last[n] < short_return_steps
                after = (returns + early, steps + 1)
                if n not in cost or after < cost[n]:
                    cost[n], predecessor[n] = after, q
                    heappush(queue, (*after, self.unvisited_near[n], self.degree[n], n))
        states = [predecessor[q]]
        while predecessor[states[-1]] != current:
            states.append(predecessor[states[-1]])
        return states

    def stack_top(self, near: list[int]) -> int:
        """Depth first: the unvisited neighbour of highest degree, else backtrack."""
        fresh = self._unvisited_states(near)
        if fresh:
            self.branches.append(max(fresh, key=self.degree.__getitem__))
        else:
            self.branches.pop()  # never the start: back at the start, all states have been seen
        return self.branches[-1]

    def free(self, near: list[int], rng: np.random.Generator) -> int:
        pool = self._unvisited_states(near) or near
        return pool[int(rng.random() * len(pool))]

    def degree_over_visits(self, near: list[int]) -> int:
        """[KP]: the largest deg / 2^v."""
        best = near[0]
        for q in near[1:]:
            shift = self.selected[best] - self.selected[q]
            left = self.degree[q] << max(shift, 0)
            right = self.degree[best] << max(-shift, 0)
            if left > right or (left == right and self.last[q] < self.last[best]):
                best = q
        return best

    def _count_visit(self, q: int) -> None:
        for n in self.near[q]:
            self.unvisited_near[n] -= 1

    def _unvisited_states(self, near: list[int]) -> list[int]:
        selected = self.selected
        return [q for q in near if not selected[q]]
