"""Words of a command line: exit codes, suggestions, examples, and words without a value."""

import pytest

from tests.helpers.command import snakewalk


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("gati",), "did you mean gait?"),
        (("gait", "runn"), "did you mean gait run?"),
        (("analyse2",), "did you mean animal analyse?"),
        (("scan", "--port", ""), "nothing after --port: fill it, or leave it out"),
        (("scan", "--port="), "nothing after --port: fill it, or leave it out"),
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
