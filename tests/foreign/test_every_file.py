"""Each generated file gives its correct answer, its question, or its rejection."""

from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("rasterio", reason="the extra maps is not installed")
pytest.importorskip("rosbags", reason="the extra ros is not installed")

from tests.foreign.case import SOURCES, judge
from tests.foreign.every import every_case

CASES = list(every_case())
NAMES = [case.name for case in CASES]


def test_the_files_are_many_and_differ() -> None:
    assert len(CASES) >= 300
    assert [name for name, count in Counter(NAMES).items() if count > 1] == []
    assert {case.kind for case in CASES} == set(SOURCES)


@pytest.mark.fast_cases(20)
@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_a_file_is_read_as_it_states_or_asked_about(case, tmp_path: Path) -> None:
    judgement = judge(case, tmp_path / "files")
    assert judgement.verdict in ("right", "asked"), judgement.words


@pytest.mark.slow
def test_a_hundred_files_state_everything_and_are_read_without_a_question(tmp_path: Path) -> None:
    plain = [case for case in CASES if not case.options and not isinstance(case.answer, str)]
    chosen = [case for case in plain if case.kind in ("joints", "wcon", "geotiff", "calibration")]
    judged = [judge(case, tmp_path / str(k)) for k, case in enumerate(chosen)]
    assert sum(judgement.states_all for judgement in judged) >= 100
