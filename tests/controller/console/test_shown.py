"""What commands print for a reader: no Python in it, and no line cut at 80 columns."""

from importlib.metadata import version

import pytest
from pytest_mock import MockerFixture
from typer.testing import CliRunner

from snakewalk.controller.cli.command_line import app
from snakewalk.controller.cli.main import main
from snakewalk.controller.console import options
from snakewalk.controller.console.options import show
from snakewalk.controller.studies.trials import Case, Trial


def test_a_table_speaks_no_python(capsys: pytest.CaptureFixture[str]) -> None:
    show({"film": None, "sure": True, "left_out": {}, "files": ["a.obj", "a.mtl"]}, False)
    said = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert [[one.strip() for one in line] for line in said] == [
        ["sure", "yes"], ["files", "a.obj, a.mtl"],
    ]  # fmt: skip


def test_a_table_shows_names_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    """``:100:`` is no picture, and ``[red]`` no colour."""
    show({"graph": "er:100:9", "file": "[red].csv"}, False)
    shown = capsys.readouterr().out
    assert "er:100:9" in shown
    assert "[red].csv" in shown


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plan", "flat-square", "--motion", "gait"], "motion gait needs a table [gait]"),
        (
            ["animal", "body", "worm-like", "-o", "b.glb", "--aspect", "-1"],
            "aspect: height over width",
        ),
        (["animal", "fish", "match", ".", "-o", "postures.csv"], "the result ends in .npz"),
        (["animal", "fish", "synthesise", "."], "is a folder"),
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
        (["trials", "run", "--seeds", "0"], "--seeds: "),
        (["list", "--log-level", "loud"], "--log-level: 'loud' is not one of 'debug', 'info'"),
        (["run", "--bogus"], "No such option: --bogus"),
        (["gait", "show"], "name: is required"),
        (["nosuch"], "No such command 'nosuch' (see"),
        (["docter"], "No such command 'docter'; did you mean doctor? (see snakewalk --help)"),
        (["gait", "lst"], "No such command 'lst'; did you mean gait list? (see snakewalk gait"),
        (["blink"], "No such command 'blink'; did you mean snakewalk bus blink?"),
        (["run", "--roobot", "x"], "No such option: --roobot; did you mean --robot?"),
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


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        app(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"snakewalk {version('snakewalk')}\n"


@pytest.mark.parametrize("columns", [80, 120])
def test_a_narrow_table_of_trials_keeps_its_numbers(
    columns: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    mocker: MockerFixture,
) -> None:
    pytest.importorskip("mujoco")
    case = Case("jacksboro-traverse", "walk-printed", "alternating16", 0.5)
    found = [
        Trial(
            case, seed, (0.1, 0.2), 4, True, 4, 0, 61.25, 5.4, 0.123, 0.456, 0.789, 12.34,
            0.1, 1.0, 23.4, 0.3,
        )
        for seed in range(20)
    ]  # fmt: skip
    mocker.patch("snakewalk.controller.studies.trials.plan_trials", return_value=[])
    mocker.patch("snakewalk.controller.studies.trials.trials", return_value=found)
    monkeypatch.setattr(options.console, "_width", columns)
    words = "trials run jacksboro-traverse --motion walk-printed --robot alternating16 --relief 0.5"
    app(words.split(), standalone_mode=False)
    shown = capsys.readouterr().out
    for number in ("20 of 20", "61.2", "0.123", "0.46", "0.79", "12.3"):
        assert number in shown
    assert "\N{HORIZONTAL ELLIPSIS}" not in shown
