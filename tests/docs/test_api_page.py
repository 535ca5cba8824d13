"""The page of the library's names: complete, and its examples run."""

import re
from pathlib import Path

import pytest

import snakewalk

pytestmark = pytest.mark.costs("runs the examples of the page")

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "api.md").read_text(encoding="utf-8")


def test_the_page_describes_every_public_name_and_no_other() -> None:
    described = re.findall(r"^\| `(\w+)` \| \S", PAGE, re.MULTILINE)
    assert sorted(described) == sorted(snakewalk.__all__)


def test_the_page_begins_with_a_complete_example_of_ten_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    example = PAGE.split("```python\n")[1].split("```")[0]
    assert example.count("\n") == 10
    exec(example, {})
    verdict, numbers = capsys.readouterr().out.splitlines()
    assert verdict.startswith("2 of 2 waypoints, ")
    assert verdict.endswith("; exit code 0")
    assert numbers.endswith(" simulated")


@pytest.mark.slow
def test_the_other_examples_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    groups = re.findall(r"^## ", PAGE, re.MULTILINE)
    assert len(blocks) == len(groups)
    names: dict[str, object] = {}
    for block in blocks[1:]:
        exec(block, names)
    assert (tmp_path / "out" / "log.mcap").is_file()
