"""The page about measurements, carried out as printed."""

import json
import shlex
from pathlib import Path

import pytest

from tests.helpers.command import snakewalk
from tests.helpers.page_steps import page


@pytest.mark.costs("simulates the two rows of the page")
def test_the_page_leads_to_a_compared_measurement(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = page("add-a-measurement")
    monkeypatch.chdir(tmp_path)
    for name, body in steps.files.items():
        Path(name).write_text(body, encoding="utf-8")
    assert len(steps.commands) == 3
    *_, last = [line for line in steps.commands if "my-snake" in line]
    ended = snakewalk(*shlex.split(last)[1:])
    assert ended.returncode == 0
    rows = {row["row"]: row for row in json.loads(ended.stdout)["rows"]}
    assert rows.keys() == {"slow", "more-friction-across"}
    assert rows["more-friction-across"]["simulated"] > rows["slow"]["simulated"] > 0.0
    assert steps.text.splitlines()[5].startswith("snakewalk trials validate")
