"""What commands print for a reader: no Python in it, and no line cut at 80 columns."""

import pytest
from typer.testing import CliRunner

from snakewalk.controller.app.cli.command_line import app
from snakewalk.controller.app.cli.main import main
from snakewalk.controller.app.cli.options import show


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
        (["body", "worm-like", "-o", "b.glb", "--aspect", "-1"], "aspect: height over width"),
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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["trials", "--seeds", "0"], "'--seeds'"),
        (["run", "--bogus"], "No such option: --bogus"),
        (["gait", "show"], "Missing argument 'name'"),
        (["nosuch"], "No such command 'nosuch'"),
        (["run", "flat-square", "--out", __file__], "is a file"),
    ],
)
def test_wrong_words_are_one_line_and_exit_code_2(
    words: list[str],
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.argv", ["snakewalk", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    error = capsys.readouterr().err
    assert ended.value.code == 2
    assert said in error
    assert error.startswith("snakewalk: ")
    assert error.count("\n") == 1
