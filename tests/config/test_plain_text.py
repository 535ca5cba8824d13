"""No name steers a terminal, or reorders what a reader sees."""

import pytest
from pydantic import ValidationError

from snakewalk.config.plain_text import plain
from snakewalk.config.robot import RobotConfig

STEERING = [
    "\x1b[2J",
    "\x9b2J",
    "\r",
    "\x7f",
    "\u202etxt.exe",
    "\u2066",
    "\u200f",
    "\u061c",
    "\u2028",
]


@pytest.mark.parametrize("text", STEERING, ids=ascii)
def test_a_question_mark_stands_for_what_steers(text: str) -> None:
    shown = plain(f"a{text}b")
    assert shown.isprintable()
    assert shown.startswith("a?")


@pytest.mark.parametrize(
    "text", ["two\nlines\t", "蛇 ü é עברית", '15" <snake>', "\u200c\u200d"], ids=ascii
)
def test_any_other_text_stays(text: str) -> None:
    assert plain(text) == text


@pytest.mark.parametrize("text", [*STEERING, "/", "\\"], ids=ascii)
def test_no_name_has_such_a_character(text: str) -> None:
    assert RobotConfig(name="a b", joint_axes="y").name == "a b"
    for name in (f"a{text}", f"{text}a"):
        with pytest.raises(ValidationError, match="name"):
            RobotConfig(name=name, joint_axes="y")
