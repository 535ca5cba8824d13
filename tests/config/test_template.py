"""A template reads back to its configuration, and every line of it can be taken into use."""

import re
import tomllib
from typing import get_args

import pytest
from pydantic import BaseModel

from snakewalk.config.document import json_schema
from snakewalk.config.loader import checked, load_robot, load_run, load_world, shipped
from snakewalk.config.template import template
from snakewalk.controller.run.commands.schema import SchemaName, models

SHIPPED = [
    *(load_run(name) for name in shipped("runs")),
    *(load_robot(name) for name in shipped("robots")),
    *(load_world(name) for name in shipped("worlds")),
]


@pytest.mark.parametrize("config", SHIPPED, ids=lambda config: config.name)
def test_a_template_reads_back_to_what_it_was_made_of(config: BaseModel) -> None:
    text = template(config, "What it is.")
    assert text.startswith("# What it is.\n")
    assert checked(type(config), tomllib.loads(text), "template") == config


def test_each_commented_key_of_a_run_can_be_taken_into_use_where_it_stands() -> None:
    run = load_run("flat-square")
    text = template(run, "", without={"gait", "playback", "repertoire", "compliance", "mapping"})
    text = re.sub(r"^# \[\[.*?\n\n", "", text, flags=re.MULTILINE | re.DOTALL)
    used = re.sub(r"^# (\w+ = \S)", r"\1", text, flags=re.MULTILINE)
    assert used.count("\n# ") < text.count("\n# ") / 2
    assert checked(type(run), tomllib.loads(used), "template") == run


def test_a_template_shows_every_key_with_its_meaning() -> None:
    text = template(load_world("flat"), "")
    assert re.search(r"^# across = 0.7 +# number, > 0, ≤ 5; friction", text, re.MULTILINE)
    assert (
        "# kinds of ground: flat, elevation, map, ramp, random, steps, gaps, shore, water;" in text
    )
    assert re.search(r"^# radius_m = +# number", text, re.MULTILINE)  # of the obstacle it has not


def test_every_file_has_a_schema() -> None:
    assert tuple(models()) == get_args(SchemaName)


@pytest.mark.parametrize("kind", get_args(SchemaName))
def test_a_schema_refuses_unknown_keys_in_every_table_and_has_all_keys(kind: str) -> None:
    described = json_schema(kind, models()[kind])
    assert set(described["properties"]) == set(models()[kind].model_fields)
    tables = [described, *described.get("$defs", {}).values()]
    assert all(one["additionalProperties"] is False for one in tables if "properties" in one)


def test_a_schema_has_ranges_and_words() -> None:
    seed = json_schema("run")["properties"]["seed"]
    assert (seed["type"], seed["minimum"], seed["default"]) == ("integer", 0, 0)
    assert json_schema("robot")["$defs"]["ServoConfig"]["properties"]["first_id"]["description"]
