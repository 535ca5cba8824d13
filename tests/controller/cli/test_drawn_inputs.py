"""Wrong words for every command, made from its help: exit code 2, the wrong word named, no file."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.help.shown import FOLDER
from tests.helpers.command import command_words, snakewalk

_OPTION: Final = re.compile(r"^│ [* ] *(--[a-z0-9-]+) +(?:-\w +)?(\S.*?)(?:  |$)")
_NUMBER: Final = re.compile(r"(whole )?number|^\d|^over |^at most |^from \d|or more$|seconds$")
_CHOICE: Final = re.compile(r"^[a-z0-9_-]+(\|[a-z0-9_-]+)+$")
_SURPLUS: Final = ("nosuch1", "nosuch2", "nosuch3", "nosuch4", "nosuch5", "nosuch6")
_TYPED: Final = {"number": ("x", "--", "1e", "0x10z"), "choice": ("nosuch",)}


def options_of(words: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Options of a command whose values are numbers or one of some words."""
    page = (FOLDER / f"{'-'.join(words)}.txt").read_text(encoding="utf-8")
    for line in page.splitlines():
        option = _OPTION.match(line)
        if option is None:
            continue
        metavar = option[2].strip()
        if _CHOICE.match(metavar):
            yield option[1], "choice"
        elif _NUMBER.search(metavar):
            yield option[1], "number"


def wrong_lines() -> Iterator[tuple[str, str]]:
    """Command lines with one wrong word, and the word that the message must name."""
    commands = [words for words in command_words() if words]
    families = {words[:-1] for words in commands}
    for words in commands:
        line = " ".join(words)
        if words in families:
            yield f"{line} nosuch", "nosuch"
            continue
        yield f"{line} --nosuch-option", "--nosuch-option"
        yield f"{line} {' '.join(_SURPLUS)}", "nosuch"
        for count, (option, kind) in enumerate(options_of(words)):
            values = _TYPED[kind]
            yield f"{line} {option}={values[count % len(values)]}", option


LINES: Final = [*wrong_lines()]


def test_every_command_has_wrong_lines_and_there_are_enough() -> None:
    commands = {" ".join(words) for words in command_words() if words}
    assert {
        name for name in commands if any(line.startswith(name) for line, _ in LINES)
    } == commands
    assert len(LINES) >= 150


@pytest.mark.slow_cases(30, "a line for each option of each command")
@pytest.mark.fast_cases(12)
@pytest.mark.parametrize(("line", "named"), LINES, ids=[line for line, _ in LINES])
def test_a_wrong_word_is_named_and_nothing_is_written(
    line: str, named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = snakewalk(*line.split())
    assert ended.returncode == 2, ended
    assert ended.stdout == ""
    assert named in ended.stderr or "is required" in ended.stderr or "6 logs: " in ended.stderr
    assert "Traceback" not in ended.stderr
    assert "snakewalk:" in ended.stderr
    assert not [*tmp_path.iterdir()]
