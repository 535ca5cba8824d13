"""The command line: its first level, former names, wrong words, and examples in its help."""

import re
from contextlib import nullcontext

import pytest
import typer

from snakewalk.controller.cli import command_line
from snakewalk.controller.cli.command_line import FAMILIES, FORMER, VERBS, CommandGroup, former_name
from snakewalk.controller.console.plugins import Plugin, builtin_plugins
from tests.help.shown import FOLDER
from tests.helpers.command import snakewalk

NAMES = {each.name for each in builtin_plugins() if each.kind == "command"}
FIRST = {name.split()[0] for name in NAMES}


def test_the_first_level_has_at_most_twenty_words() -> None:
    assert {*VERBS, *(words for words in FAMILIES if " " not in words)} == FIRST
    assert len(FIRST) <= 20


def test_the_first_level_fits_a_screen() -> None:
    lines = (FOLDER / "snakewalk.txt").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 26
    listed = [line.split()[0] for line in lines if re.match("  [a-z]", line)]
    assert listed == [*VERBS, *(w for w in FAMILIES if " " not in w and w != "trials")]


@pytest.mark.slow_cases(6, "27 cases of 0.2 s of CPU")
@pytest.mark.fast_cases(9)
@pytest.mark.parametrize("old", FORMER)
def test_a_former_name_works_with_one_line(old: str) -> None:
    new = FORMER[old]
    words = old.split() if old != "trials" else ["trials", "--seeds", "1"]
    current = snakewalk(*new.split(), *words[len(old.split()) :], "--help")
    former = snakewalk(*words, "--help")
    assert former.stdout == current.stdout
    assert former.stderr == f"snakewalk {old} is now snakewalk {new}\n"
    assert current.stderr == ""
    assert f"Usage: snakewalk {new} " in former.stdout


def test_no_command_has_a_former_name() -> None:
    assert {name for name in FORMER if name in NAMES} == set()
    assert [name for name in NAMES if former_name(name.split(), NAMES)] == []


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("trials", None),
        ("trials --help", None),
        ("trials rehearze", None),
        ("trials rehearse flat-square", None),
        ("trials flat-square --seeds 2", ("trials", "trials run")),
        ("trials --seeds 2", ("trials", "trials run")),
        ("camera check", ("camera check", "pose camera")),
        ("camera", ("camera", "pose")),
        ("policy trials wave-cma", ("policy trials", "trials policy")),
        ("policy run wave-cma", ("policy", "gait policy")),
        ("bus identify", ("bus identify", "bus inventory")),
        ("bus", None),
        ("--version", None),
        ("", None),
    ],
)
def test_the_longest_former_name_counts(words: str, found: tuple[str, str] | None) -> None:
    assert former_name(words.split(), NAMES) == found


def test_without_the_package_of_a_command_its_former_name_is_unknown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left = tuple(each for each in builtin_plugins() if not each.package.endswith(".ros"))
    left = tuple(each for each in left if not each.name.startswith("world "))
    monkeypatch.setattr(command_line, "plugins", lambda kind: [p for p in left if p.kind == kind])
    done = snakewalk("terrain", "from")
    assert done.returncode == 2
    assert done.stderr.startswith("snakewalk: No such command 'terrain'")
    assert "Worlds from real ground" not in snakewalk("--help").stdout


def test_a_command_of_another_package_wins_over_a_former_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own = Plugin("command", "scan", "Scan a shape.", "snakewalk.x:y", "", "other")
    every = [*builtin_plugins(), own]
    monkeypatch.setattr(command_line, "plugins", lambda kind: [p for p in every if p.kind == kind])
    shown = snakewalk("--help").stdout
    assert "Other packages" in shown
    assert "Scan a shape." in shown
    assert former_name(["scan"], {*NAMES, "scan"}) is None


def test_a_former_name_is_completed_without_a_word_about_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    group = typer.main.get_command(command_line.app)
    for is_completion in (True, False):
        context = group.make_context("snakewalk", ["scan"], resilient_parsing=is_completion)
        assert context.args == ["scan"], "behind bus"
        said = capsys.readouterr().err
        assert said == ("" if is_completion else "snakewalk scan is now snakewalk bus scan\n")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("gati",), "No such command 'gati'; did you mean gait? (see snakewalk --help)"),
        (
            ("gait", "runn"),
            "No such command 'runn'; did you mean gait run? (see snakewalk gait --help)",
        ),
        (("bus", "doctor"), "did you mean snakewalk doctor? (see snakewalk bus --help)"),
        (("bus", "compare"), "did you mean snakewalk log compare? (see snakewalk bus --help)"),
        (("pla",), "did you mean play or plan? (see snakewalk --help)"),
        (("analyse2",), "did you mean snakewalk animal analyse? (see snakewalk --help)"),
        (("zzzz",), "No such command 'zzzz' (see snakewalk --help)"),
        (("gait", "run", "--secnds", "3"), "No such option: --secnds; did you mean --seconds?"),
        (("gait", "run", "--zzzz"), "No such option: --zzzz (see snakewalk gait run --help)"),
        (("scan", "--port", ""), "nothing after --port: fill it, or leave it out"),
        (("scan", "--port="), "nothing after --port: fill it, or leave it out"),
        (("",), "nothing after snakewalk: fill it, or leave it out (see snakewalk --help)"),
        (("gait", ""), "nothing after gait: fill it, or leave it out (see snakewalk --help)"),
    ],
)
def test_wrong_words_are_one_line(words: tuple[str, ...], said: str) -> None:
    ended = snakewalk(*words)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_a_value_that_is_given_by_an_equals_sign_is_not_empty() -> None:
    assert "nothing after" not in snakewalk("scan", "--port=/nowhere").stderr


def test_a_family_without_a_command_shows_its_help_alone() -> None:
    ended = snakewalk("gait")
    assert "Usage" in ended.stdout + ended.stderr
    assert "(see snakewalk" not in ended.stderr


def test_help_has_examples_and_exit_code_0() -> None:
    ended = snakewalk("gait", "run", "--help")
    assert ended.returncode == 0
    assert "snakewalk gait run" in ended.stdout.split("Examples:")[1]
    assert "--install-completion" not in ended.stdout, "an option of the program alone"


class Ending(CommandGroup):
    """A command line whose command ends with an exception."""

    fault: BaseException = typer.Abort()

    def invoke(self, ctx: object) -> object:
        raise self.fault


@pytest.mark.parametrize(
    ("fault", "code", "said"),
    [
        (typer.Abort(), 1, "snakewalk: aborted"),
        (
            typer.BadParameter("too long"),
            2,
            "snakewalk: Invalid value: too long (see snakewalk --help)",
        ),
        (typer.Exit(3), 3, ""),
    ],
)
def test_an_exception_of_the_command_line_is_one_line_and_an_exit_code(
    fault: BaseException, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    group = Ending(name="snakewalk")
    group.fault = fault
    with pytest.raises(SystemExit) as ended:
        group.main(["list"], "snakewalk")
    assert ended.value.code == code
    assert capsys.readouterr().err.strip() == said
    with pytest.raises(type(fault)) if code != 3 else nullcontext():
        group.main(["list"], "snakewalk", standalone_mode=False)


def test_an_error_of_the_program_is_no_wrong_word() -> None:
    group = Ending(name="snakewalk")
    group.fault = ZeroDivisionError("ours")
    with pytest.raises(ZeroDivisionError, match="ours"):
        group.main(["list"], "snakewalk")
