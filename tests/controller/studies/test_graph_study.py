"""The study of Fig. 9: what is counted, repeatability, the paper's claims in small, the command."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.shape.walks import Walk
from snakewalk.controller.studies.graph_study import StudyResult, return_gaps, run_study
from tests.helpers.command import snakewalk

pytestmark = pytest.mark.usefixtures("legible_figures")


def walked(path: list[int], states: int) -> Walk:
    selected = np.bincount(path, minlength=states)
    return Walk(np.array(path), selected, np.zeros(states, dtype=np.int64), covered=True)


def test_gaps_are_the_steps_between_visits_of_the_same_state() -> None:
    assert sorted(return_gaps(walked([0, 1, 0, 2, 1, 0, 3], 4)).tolist()) == [2, 3, 3]
    assert len(return_gaps(walked([2, 0, 1], 3))) == 0


def test_every_rule_walks_the_same_graphs_and_a_seed_repeats_all() -> None:
    one, two = (run_study("er:100:4", rule, 4, seed=3) for rule in ("snake", "random"))
    np.testing.assert_array_equal(one.states, two.states)
    assert one.mean_degree == two.mean_degree
    assert run_study("er:100:4", "random", 4, seed=3).to_dict() == two.to_dict()
    assert run_study("er:100:4", "random", 4, seed=4).to_dict() != two.to_dict()


def test_a_first_repeat_does_not_depend_on_how_many_follow() -> None:
    few, many = (run_study("er:100:4", "random", n, seed=3) for n in (2, 5))
    np.testing.assert_array_equal(few.cover, many.cover[:2])


def test_the_curve_climbs_from_one_state_to_all_and_no_faster_than_a_state_a_step() -> None:
    found = run_study("ws:200:6:0.1", "snake", 5)
    assert found.visited[0] == pytest.approx(1 / 200)
    assert found.visited[-1] == 1.0
    assert (np.diff(found.visited) >= 0.0).all()
    assert (found.visited <= found.grid + 1 / 200 + 1e-12).all()
    assert (found.cover >= 199 / 200).all()


def test_short_returns_are_counted_over_the_states_too_and_leaves_beside_them() -> None:
    found = run_study("er:100:4", "snake", 30)
    np.testing.assert_allclose(found.short_per_state, found.short_steps * found.cover)
    assert (found.short_per_state >= found.leaves - 2.0 / found.states - 1e-12).all()
    row = found.to_dict()
    half = 1.96 * np.std(found.cover, ddof=1) / np.sqrt(30)
    assert row["cover_ci95"] == pytest.approx(half, abs=5e-5)
    assert run_study("er:100:4", "snake", 1).to_dict()["cover_ci95"] is None


def studied(spec: str) -> dict[str, StudyResult]:
    return {rule: run_study(spec, rule, 8) for rule in ("snake", "stack", "random")}


def test_claims_of_the_paper_on_dense_graphs() -> None:
    found = studied("er:400:9")
    cover = {rule: one.cover.mean() for rule, one in found.items()}
    assert cover["snake"] < cover["stack"] < cover["random"]
    assert found["snake"].short_returns.mean() < 0.02
    assert 0.2 < found["stack"].short_returns.mean() < 0.5


def test_claims_of_the_paper_on_sparse_graphs() -> None:
    found = studied("ws:400:3:0.1")
    cover = {rule: one.cover.mean() for rule, one in found.items()}
    assert cover["stack"] < cover["snake"] < cover["random"]
    assert found["snake"].cover.max() < np.log(400)  # N log N
    assert found["snake"].short_returns.mean() < 0.4 * found["stack"].short_returns.mean()


def test_the_command_compares_rules_as_json_and_draws_them(tmp_path: Path) -> None:
    picture = tmp_path / "curves.png"
    words = ("--graph", "er:60:5", "--graph", "ws:60:4:0.1", "--rule", "snake", "--rule", "stack")
    done = snakewalk(
        "animal", "graph", *words, "--repeats", "3", "--picture", str(picture), "--json"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [(one["graph"], one["rule"]) for one in found] == [
        (graph, rule) for graph in ("er:60:5", "ws:60:4:0.1") for rule in ("snake", "stack")
    ]
    assert all(one["covered"] == one["repeats"] == 3 for one in found)
    assert found[0] == run_study("er:60:5", "snake", 3).to_dict()
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_command_shows_a_table() -> None:
    done = snakewalk("animal", "graph", "--graph", "er:60:5", "--repeats", "2")
    assert done.returncode == 0, done.stderr
    for word in ("er:60:5", "snake-printed", "stack", "random", "degree", "2 graphs of each kind"):
        assert word in done.stdout


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--graph", "er:1000"], "graph 'er:1000': expected er:STATES:DEGREE"),
        (["--rule", "eel"], "rule 'eel': expected one of"),
        (["--picture", "curves.txt"], "curves.txt: a picture ends in .png"),
        (["--repeats", "0"], "repeats"),
        (["--graph", "kp:nosuch"], "nosuch"),
    ],
)
def test_bad_input_ends_with_exit_code_2_before_any_walk(words: list[str], said: str) -> None:
    done = snakewalk("animal", "graph", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_no_repeats_are_refused() -> None:
    with pytest.raises(InputError, match="repeats: expected 1 or more"):
        run_study("er:100:4", "snake", 0)
