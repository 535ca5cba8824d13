"""Each pattern of a schema is described by words in the message for a text that does not match."""

import json
import math
import re

import pytest

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.config.value_faults import _pattern_in_words, unit_hint
from snakewalk.config.world import WorldConfig


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("^[yr]{1,4}$", "must have the letters y and r only, 1 to 4 of them"),
        ("^[A-Za-z0-9_]+$", "must have only small letters, capital letters, digits or '_'"),
        (
            "^[a-z][a-z0-9_-]*$",
            "must begin with small letters, and have only small letters, digits, '_' or '-'",
        ),
        ("^(on|off)$", "must match ^(on|off)$"),
    ],
)
def test_a_pattern_in_words(pattern: str, words: str) -> None:
    assert _pattern_in_words(pattern) == words


@pytest.mark.parametrize("schema", [RobotConfig, RunConfig, ServoModel, WorldConfig])
def test_every_pattern_of_a_file_has_words(
    schema: type[RobotConfig | RunConfig | ServoModel | WorldConfig],
) -> None:
    text = json.dumps(schema.model_json_schema())
    patterns = {
        json.loads(f'"{each}"') for each in re.findall(r'"pattern": "((?:\\.|[^"])*)"', text)
    }
    assert patterns
    assert [each for each in patterns if _pattern_in_words(each).startswith("must match")] == []


@pytest.mark.parametrize(
    ("key", "value", "hint"),
    [
        ("limit_rad", 80, "; 80 degrees are 1.396"),
        ("limit_rad", 800, ""),  # too large in degrees, too
        ("length_m", 64.0, "; 64 mm are 0.064"),
        ("mass_kg", 64.0, ""),
        ("length_m", math.inf, ""),
    ],
)
def test_a_value_in_another_unit_is_named(key: str, value: float, hint: str) -> None:
    fault = {"loc": ("joints", key, 0), "input": value, "ctx": {"le": 3.1}}
    assert unit_hint(fault) == hint
