"""How fast a walk covers a graph, and how soon it comes back: rule x graph x repeats (Fig. 9)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError
from controller.shape.graph_spec import graph_source
from controller.shape.walks import Walk, check_rule, walk

Floats = NDArray[np.float64]
SHORT_RETURN = 0.05
"""Of |V|: [PT] 2.6.2 wants at least so many steps between two visits of a state."""
_GRID = np.linspace(0.0, 8.0, 161)


@dataclass(frozen=True, slots=True)
class StudyResult:
    """One rule on ``repeats`` graphs of one kind; a seed gives every rule the same graphs."""

    graph: str
    rule: str
    repeats: int
    seed: int
    states: Floats
    """(R,) |V| of each graph: its largest connected part."""
    mean_degree: float
    """Measured, mean over the graphs."""
    cover: Floats
    """(R,) steps until all states were seen, over |V|; NaN where V^2 steps were not enough."""
    short_returns: Floats
    """(R,) share of returns to a state after less than 0.05 |V| steps, until cover."""
    short_steps: Floats
    """(R,) such returns as a share of all steps."""
    grid: Floats
    """(G,) steps over |V|."""
    visited: Floats
    """(G,) share of states seen after so many steps, mean over the repeats."""

    def to_dict(self) -> dict[str, object]:
        """Plain numbers, for JSON."""
        covered = self.cover[np.isfinite(self.cover)]
        return {
            "graph": self.graph,
            "rule": self.rule,
            "repeats": self.repeats,
            "seed": self.seed,
            "states": round(float(self.states.mean()), 1),
            "mean_degree": round(self.mean_degree, 3),
            "covered": len(covered),
            "cover_mean": round(float(covered.mean()), 4) if len(covered) else None,
            "cover_std": round(float(covered.std()), 4) if len(covered) else None,
            "cover_worst": round(float(covered.max()), 4) if len(covered) else None,
            "seen_at_v": round(float(np.interp(1.0, self.grid, self.visited)), 4),
            "cover_each": [round(float(x), 4) if np.isfinite(x) else None for x in self.cover],
            "short_returns": round(float(self.short_returns.mean()), 4),
            "short_steps": round(float(self.short_steps.mean()), 4),
            "curve_steps": [round(float(x), 3) for x in self.grid],
            "curve_visited": [round(float(x), 4) for x in self.visited],
        }


def run_study(graph: str, rule: str, repeats: int, seed: int = 0) -> StudyResult:
    """Run ``rule`` on ``repeats`` fresh graphs of the spec ``graph`` (``graph_spec.graph_source``).

    Raises:
        InputError: unknown spec or rule, or no repeats.

    """
    draw = graph_source(graph)
    check_rule(rule)
    if repeats < 1:
        raise InputError(f"repeats: expected 1 or more, not {repeats}")
    states, degrees, cover, short, short_steps = np.empty((5, repeats))
    visited = np.zeros(len(_GRID))
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        drawn = draw(rng)
        done = walk(drawn, rule, int(rng.integers(drawn.states)), rng)
        states[repeat], degrees[repeat] = drawn.states, drawn.mean_degree
        cover[repeat] = done.steps / drawn.states if done.covered else np.nan
        gaps = return_gaps(done)
        sooner = np.count_nonzero(gaps < SHORT_RETURN * drawn.states)
        short[repeat], short_steps[repeat] = sooner / max(1, len(gaps)), sooner / done.steps
        seen = np.cumsum(_first_visits(done))
        visited += np.interp(_GRID * drawn.states, np.arange(len(seen)), seen / drawn.states)
    return StudyResult(
        graph=graph,
        rule=rule,
        repeats=repeats,
        seed=seed,
        states=states,
        mean_degree=float(degrees.mean()),
        cover=cover,
        short_returns=short,
        short_steps=short_steps,
        grid=_GRID,
        visited=visited / repeats,
    )


def return_gaps(done: Walk) -> NDArray[np.int64]:
    """Steps between consecutive visits of the same state, over all states, (returns,)."""
    order = np.argsort(done.path, kind="stable")
    same = done.path[order][1:] == done.path[order][:-1]
    return np.asarray(np.diff(order)[same])


def _first_visits(done: Walk) -> NDArray[np.bool_]:
    first = np.zeros(len(done.path), dtype=bool)
    first[np.unique(done.path, return_index=True)[1]] = True
    return first
