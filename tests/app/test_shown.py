"""What commands print for a reader: no Python in it, and no line cut at 80 columns."""

import pytest
from typer.testing import CliRunner

from controller.app.cli import app
from controller.app.commands.common import show


def test_a_table_speaks_no_python(capsys: pytest.CaptureFixture[str]) -> None:
    show({"film": None, "sure": True, "left_out": {}, "files": ["a.obj", "a.mtl"]}, False)
    said = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert [[one.strip() for one in line] for line in said] == [
        ["film", "-"], ["sure", "yes"], ["left", "out  -"], ["files", "a.obj, a.mtl"],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plan", "flat-square", "--motion", "gait"], "motion gait needs a table [gait]"),
        (["body", "worm-like", "-o", "b.glb", "--aspect", "-1"], "--aspect"),
        (["fish", "match", ".", "-o", "postures.csv"], "is an .npz"),
        (["fish", "synthesise", "."], "is a folder"),
    ],
)
def test_wrong_input_is_said_plainly(words: list[str], said: str) -> None:
    result = CliRunner().invoke(app, words)
    text = result.output + repr(result.exception)
    assert result.exit_code != 0
    assert said in text
    assert "Value error" not in text
