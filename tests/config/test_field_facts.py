"""Facts of the fields of schemas: each has a description, and bounds are found in named types."""

import re
from typing import Annotated, Literal

import pytest
from pydantic import Field

from snakewalk.config.base import Strict
from snakewalk.config.document import reference
from snakewalk.config.field_facts import bounds_of, bounds_text, description_of

Share = Annotated[float, Field(ge=0.0, le=1.0, description="share of the whole")]


class Row(Strict):
    """Row of a table. It has one key."""

    share: Share = 0.5
    maybe: Share | None = None


class Table(Strict):
    """A table of rows."""

    kind: Literal["table"] = "table"
    rows: tuple[Row, ...] = ()
    row: Row | None = None
    count: int = Field(1, gt=0, description="number of rows")


def test_a_field_without_a_description_is_rejected() -> None:
    with pytest.raises(TypeError, match=r"^Silent\.speed: has no description"):

        class Silent(Strict):
            """A schema that says nothing of its key."""

            speed: float = 1.0


def test_descriptions_come_from_the_field_its_type_or_its_table() -> None:
    found = {name: description_of(field) for name, field in Table.model_fields.items()}
    assert found["count"] == "number of rows"
    assert found["rows"] == found["row"] == "row of a table. It has one key"
    assert "kind" in found["kind"]
    assert description_of(Row.model_fields["share"]) == "share of the whole"
    assert description_of(Row.model_fields["maybe"]) == "share of the whole"


def test_bounds_of_a_named_type_hold_where_it_may_be_left_out() -> None:
    assert bounds_of(Row.model_fields["maybe"]) == {"ge": 0.0, "le": 1.0}
    assert bounds_text(bounds_of(Table.model_fields["count"])) == "> 0"


def test_every_key_of_the_configuration_page_has_a_description() -> None:
    rows = re.findall(r"^\| `(\w+)` \|.*\| (.*) \|$", reference(), re.MULTILINE)
    assert len(rows) > 400
    assert [key for key, description in rows if not description.strip()] == []


def test_a_search_for_speed_finds_the_speed_of_the_walk() -> None:
    rows = [line for line in reference().splitlines() if "speed of the walk" in line]
    assert [line.split("`")[1] for line in rows] == ["pulse_body_lengths_s"]
