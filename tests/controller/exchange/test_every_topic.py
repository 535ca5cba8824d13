"""Every topic, and every field of it, is in each of the exports."""

import json
from collections import defaultdict

import pytest
from mcap.reader import make_reader

from snakewalk.config.units import end_of
from snakewalk.controller.exchange import foxglove_scene, ros_messages
from snakewalk.controller.exchange.flat_table import flat_tables
from snakewalk.controller.exchange.foxglove_scene import write_foxglove_scene
from snakewalk.controller.exchange.remaining_fields import TIME
from snakewalk.controller.exchange.ros_bag import write_ros_bag
from snakewalk.controller.runlog.column import Table
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.controller.runlog.topics import TABLES, ConfigTable

EVERY = pytest.mark.parametrize("table", TABLES, ids=lambda table: table.topic.table_name)


def fields(table: type[Table]) -> list[str]:
    return [name for name in table.topic.columns if name != TIME]


@EVERY
def test_every_topic_is_a_table(table: type[Table], record: RunRecord) -> None:
    tables = {each.name: each for each in flat_tables(record)}
    columns = tables[table.topic.table_name].columns
    assert tables[table.topic.table_name].row_count
    for name in fields(table):
        if table is ConfigTable:
            keys = {key.partition(".")[0] for key in columns["key"]}
            assert name in keys
        elif table.topic.columns[name].kind == "points":
            assert "point_x_m" in columns
        else:
            stem = name.removesuffix(end_of(name)).removesuffix("s")
            assert any(column.startswith(stem) for column in columns), name


@pytest.fixture(scope="module")
def bag(record: RunRecord, tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    pytest.importorskip("rosbags")
    return write_ros_bag(record, tmp_path_factory.mktemp("every") / "bag.mcap")


@EVERY
def test_every_field_is_in_a_ros_bag(table: type[Table], bag: dict[str, int]) -> None:
    topic = table.topic
    for name in fields(table):
        if name in ros_messages.SHOWN.get(table, ()):
            continue
        is_whole = table is ConfigTable or topic.columns[name].kind == "points"
        assert bag[topic.name if is_whole else f"{topic.name}/{name}"]
    assert set(ros_messages.TYPES) <= set(bag), "what the well-known messages contain is there"


@pytest.fixture(scope="module")
def scene(record: RunRecord, tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Keys of the messages of each topic."""
    path, keys = tmp_path_factory.mktemp("every") / "scene.mcap", defaultdict(set)
    write_foxglove_scene(record, path)
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            keys[channel.topic] |= set(json.loads(message.data))
    return keys


@EVERY
def test_every_field_is_in_a_foxglove_file(table: type[Table], scene: dict[str, set[str]]) -> None:
    shown = foxglove_scene.SHOWN.get(table, ())
    missing = [name for name in fields(table) if name not in shown]
    assert not missing or set(missing) <= scene[table.topic.name]
    assert set(foxglove_scene.TYPES) <= set(scene), "what the well-known messages contain is there"
