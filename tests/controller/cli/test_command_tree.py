"""The first level of the command line, and the former names of commands."""

import re

import pytest

from snakewalk.controller.cli import command_line
from snakewalk.controller.cli.command_line import FAMILIES, FORMER, VERBS, former_name
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
