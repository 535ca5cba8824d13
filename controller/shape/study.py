"""How fast a walk covers a graph, and how soon it comes back: rule x graph x repeats (Fig. 9)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError
from controller.shape.graphs import check_spec, random_graph
from controller.shape.walks import RULES, Walk, walk

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
            "short_returns": round(float(self.short_returns.mean()), 4),
            "curve_steps": [round(float(x), 3) for x in self.grid],
            "curve_visited": [round(float(x), 4) for x in self.visited],
        }


def run_study(graph: str, rule: str, repeats: int, seed: int = 0) -> StudyResult:
    """Run ``rule`` on ``repeats`` fresh graphs of the spec ``graph`` (``graphs.random_graph``).

    Raises:
        InputError: unknown spec or rule, or no repeats.

    """
    check_spec(graph)
    if rule not in RULES:
        raise InputError(f"rule {rule!r}: expected one of {', '.join(RULES)}")
    if repeats < 1:
        raise InputError(f"repeats: expected 1 or more, not {repeats}")
    states, degrees, cover, short = np.empty((4, repeats))
    visited = np.zeros(len(_GRID))
    for repeat in range(repeats):
        rng = np.random.default_rng([seed, repeat])
        drawn = random_graph(graph, rng)
        done = walk(drawn, rule, int(rng.integers(drawn.states)), rng)
        states[repeat], degrees[repeat] = drawn.states, drawn.mean_degree
        cover[repeat] = done.steps / drawn.states if done.covered else np.nan
        short[repeat] = short_return_share(done, drawn.states)
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
        grid=_GRID,
        visited=visited / repeats,
    )


def return_gaps(done: Walk) -> NDArray[np.int64]:
    """Steps between consecutive visits of the same state, over all states, (returns,)."""
    order = np.argsort(done.path, kind="stable")
    same = done.path[order][1:] == done.path[order][:-1]
    return np.asarray(np.diff(order)[same])


def short_return_share(done: Walk, states: int) -> float:
    """Share of returns sooner than 0.05 |V| steps; 0 where there was no return."""
    gaps = return_gaps(done)
    return float((gaps < SHORT_RETURN * states).mean()) if len(gaps) else 0.0


def draw_curves(results: Sequence[StudyResult], path: Path, title: str) -> None:
    """Write Fig. 9 for results on one kind of graph: states seen over steps (needs matplotlib)."""
    from matplotlib.figure import Figure  # noqa: PLC0415  an extra

    figure = Figure(figsize=(6.0, 3.6), layout="constrained")
    axes = figure.subplots()
    for result in results:
        (line,) = axes.plot(result.grid, 100.0 * result.visited, label=result.rule)
        if np.isfinite(result.cover).any():
            end = float(np.nanmean(result.cover))
            axes.plot([end], [100.0], "o", color=line.get_color(), clip_on=False)
    axes.set(xlim=(0.0, 4.0), ylim=(0.0, 102.0), title=title)
    axes.set(xlabel="steps / |V|  (dot: all seen, mean)", ylabel="states seen, %")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=110)


def _first_visits(done: Walk) -> NDArray[np.bool_]:
    first = np.zeros(len(done.path), dtype=bool)
    first[np.unique(done.path, return_index=True)[1]] = True
    return first
