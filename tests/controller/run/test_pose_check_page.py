"""The page of ``pose check``: the rows that it receives, and the axes that it draws."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snakewalk.config.pose import PoseConfig
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, turned
from snakewalk.controller.run.commands.pose_check import watch
from snakewalk.controller.run.external.pose_check_page import PoseCheckPage
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.runlog.record import POSE_CHECK
from snakewalk.controller.runlog.tables import record_of
from snakewalk.controller.runlog.topics import (
    ConfigTable,
    CycleTable,
    EventTable,
    PoseTable,
)
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.sim.line.clock import SimClock


class Feed:
    """A body at (-1.2, 0.9), 4 cm above the centre of link 0, 50 times a second."""

    def __init__(self) -> None:
        self.count = 0

    def arrived(self, now_s: float) -> list[ArrivedPose]:
        self.count += 1
        at_m = np.array([-1.2, 0.9, 0.3])
        sample = PoseSample(self.count, now_s, at_m, turned((0.0, 0.0, 90.0)), "lab")
        return [ArrivedPose(now_s, "10.0.0.1:5000", sample)]


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, Any]]]:
    folder: Path = tmp_path_factory.mktemp("page")
    found: dict[str, list[dict[str, Any]]] = {}

    def on_row(topic: str, row: bytes) -> None:
        found.setdefault(topic, []).append(json.loads(row))

    config = PoseConfig(offset_m=(0.0, 0.0, 0.04))
    prepared = prepare_job("flat-square", motion="serpenoid")
    with RunLog(folder / "log.mcap", on_row) as log:
        watch(
            *(Feed(), SimClock(), 2.5, config, lambda line: None),
            page=PoseCheckPage(log, prepared, config, "udp"),
            judge=lambda sample: "the robot is elsewhere",
        )
    return found


def test_the_body_stands_where_the_poses_say(rows: dict[str, list[dict[str, Any]]]) -> None:
    names = (ConfigTable, CycleTable, PoseTable, EventTable)
    record = record_of({t.topic.name: rows[t.topic.name] for t in names}, complete=False, note="")
    assert record.header.backend == POSE_CHECK
    assert record.header.pose_evidence.text == "measured by udp, 1.0 cm"
    assert record.pose.head_m[-1] == pytest.approx([-1.2, 0.9, 0.26])
    assert record.pose.rotation[-1][:, 0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert len(record.pose.time_s) > 100


def test_facts_mount_and_faults_are_events(rows: dict[str, list[dict[str, Any]]]) -> None:
    events = [(row["kind"], row["text"]) for row in rows[EventTable.topic.name]]
    text = next(text for kind, text in events if kind == "pose")
    for part in (
        "rate 5",
        "delay beyond the quickest",
        "noise 0.0 m",
        "frame lab",
        "mount: link 0",
    ):
        assert part in text
    assert ("pose fault", "the robot is elsewhere") in events


def test_no_joint_is_claimed(rows: dict[str, list[dict[str, Any]]]) -> None:
    """The joints are unknown before torque: neither an angle nor a goal of 0."""
    for row in rows[CycleTable.topic.name]:
        for name in ("asked_rad", "sent_rad", "measured_rad"):
            assert set(row[name]) == {None}


def test_the_page_shows_the_facts_and_no_servos(rows: dict[str, list[dict[str, Any]]]) -> None:
    """Rate, delay, noise, frame and mount, a line each; the newest ones, and the fault in red."""
    viser = pytest.importorskip("viser")
    from snakewalk.controller.view.dashboard import Dashboard

    names = (ConfigTable, CycleTable, PoseTable, EventTable)
    record = record_of({t.topic.name: rows[t.topic.name] for t in names}, complete=False, note="")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        board = Dashboard(server, record.header, {})
        board.show_servos(record, -1, None)
        board.show_curves(record, -1)
        board.show_events(record.events)
        shown = board._feed.content
    finally:
        server.stop()
    words = ("rate 5", "delay beyond", "noise 0.0 m", "noise 0.0 deg", "frame lab", "mount: link 0")
    for part in words:
        assert shown.count(part) == 1
    assert shown.count("the robot is elsewhere") == 1
    assert not hasattr(board, "_bars")


def test_axes_are_drawn_on_the_ground_and_on_the_head(
    rows: dict[str, list[dict[str, Any]]],
) -> None:
    viser = pytest.importorskip("viser")
    from snakewalk.controller.view.scene import BodyScene

    names = (ConfigTable, CycleTable, PoseTable)
    record = record_of({t.topic.name: rows[t.topic.name] for t in names}, complete=False, note="")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        scene = BodyScene(server, record.header)
        scene.show(record, -1, -1, follow=False, goals=False)
        axes = scene._axes
        assert axes is not None
        assert axes.position == pytest.approx((-1.2, 0.9, 0.26))
        assert axes.wxyz == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5), abs=1e-6)
    finally:
        server.stop()
