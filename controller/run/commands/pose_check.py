"""``snakewalk pose check``: the poses of a source, before torque."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.pose import PoseConfig
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.options import VIEW_AT, Json, Robot, View, ViewAt, console, show
from snakewalk.controller.console.result_files import LOG
from snakewalk.controller.pose.feed_statistics import FeedStatistics
from snakewalk.controller.pose.first_pose import WAIT_S, drift_fault, start_fault
from snakewalk.controller.pose.sample import PoseFeed, PoseSample
from snakewalk.controller.run.external.external_source import ExternalSource, ground_height
from snakewalk.controller.run.external.pose_check_page import PoseCheckPage, feed_words
from snakewalk.controller.run.factory import prepare_job
from snakewalk.controller.run.observers import PAGE, open_observer
from snakewalk.controller.run.pose_provider import pose_plugin
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.clock import Clock, WallClock

LOOK_S = 0.02
LINE_S = 1.0
Judge = Callable[[PoseSample], str | None]


@command(
    "pose check",
    examples=("pose check udp:9870", "pose check udp:9870 --run jacksboro-traverse --view"),
)
def check(
    source: Annotated[str, typer.Argument(help="external pose source, as for `run --pose`")],
    robot: Robot = None,
    run: Annotated[
        str | None,
        typer.Option(
            help="run whose robot, start and ground the pose must fit",
            autocompletion=completion.RUNS,
        ),
    ] = None,
    seconds: Annotated[
        float,
        typer.Option(
            min=0.1, max=3600.0, help="duration of the check in seconds, from the first pose"
        ),
    ] = 10.0,
    view: View = False,
    view_at: ViewAt = VIEW_AT,
    as_json: Json = False,
) -> None:
    """Show position, axes, rate, delay and noise of an external pose; exit code 1 on a fault."""
    plugin, argument = pose_plugin(source)
    if not isinstance(plugin, ExternalSource):
        raise InputError(f"pose check {source}: its poses do not come from another program")
    if view and run is None:
        raise InputError("--view: the page needs a robot and its ground; add --run NAME")
    prepared = None if run is None else prepare_job(run, robot=robot)
    config, judge = expected_pose(robot, prepared)
    clock = WallClock()
    with ExitStack() as stack:
        page = None
        if view and prepared is not None:
            page = stack.enter_context(_page(prepared, config, source, view_at))
        feed = stack.enter_context(closing(plugin.open_feed(argument, clock)))
        on_line = (lambda line: None) if as_json else console.print
        statistics = watch(feed, clock, seconds, config, on_line, page=page, judge=judge)
    faults = start_faults(statistics, judge)
    mount = {"link": config.link, "offset_m": list(config.offset_m)}
    show({**statistics.facts(), "mount": mount, "faults": faults}, as_json)
    if faults:
        raise SystemExit(1)


def watch(
    feed: PoseFeed,
    clock: Clock,
    seconds: float,
    config: PoseConfig,
    on_line: Callable[[str], None],
    page: PoseCheckPage | None = None,
    judge: Judge = lambda sample: None,
) -> FeedStatistics:
    """Receive poses for some seconds; ``on_line`` and ``page`` report each second.

    The time begins with the first message. Without one the check lasts at least ``WAIT_S``, because
    ROS 2 needs seconds to find a publisher.
    """
    statistics = FeedStatistics(config)
    start_s = clock.now_s()
    due_s, end_s = start_s + LINE_S, start_s + max(seconds, WAIT_S)
    while clock.now_s() < end_s:
        clock.sleep_until_s(clock.now_s() + LOOK_S)
        for arrived in feed.arrived(clock.now_s()):
            if not statistics.senders:
                end_s = clock.now_s() + seconds
            statistics.add(arrived)
        if page is not None and statistics.newest is not None:
            page.show(clock.now_s() - start_s, statistics.newest)
        if clock.now_s() >= due_s:
            due_s += LINE_S
            on_line(_line(statistics))
            if page is not None:
                page.report(
                    clock.now_s() - start_s, statistics.facts(), start_faults(statistics, judge)
                )
    return statistics


def start_faults(statistics: FeedStatistics, judge: Judge) -> list[str]:
    """Return the faults of the messages, and of the newest pose at the start of a run."""
    faults = statistics.faults()
    if statistics.newest is not None:
        more = judge(statistics.newest), drift_fault(statistics.samples)
        faults += [fault for fault in more if fault is not None]
    return faults


@contextmanager
def _page(
    prepared: PreparedRun, config: PoseConfig, source: str, view_at: str
) -> Iterator[PoseCheckPage]:
    with (
        TemporaryDirectory() as folder,
        open_observer(PAGE, view_at) as page,
        RunLog(Path(folder) / LOG, page.on_row) as log,
    ):
        yield PoseCheckPage(log, prepared, config, source)


def _line(statistics: FeedStatistics) -> str:
    facts = statistics.facts()
    if "position_m" not in facts:
        return f"no pose; {statistics.last_fault or 'nothing arrived'}"
    x_m, y_m, z_m = facts["position_m"]
    place = (
        f"x {x_m:+.3f}  y {y_m:+.3f}  z {z_m:+.3f} m   heading {facts['heading_deg']:+.1f} deg   "
        f"up {facts['up'][2]:+.2f}"
    )
    return "   ".join([place, *feed_words(facts)])


def expected_pose(robot: str | None, prepared: PreparedRun | None) -> tuple[PoseConfig, Judge]:
    """Return the tracked body, and a judge of the first pose of a run."""
    if prepared is None:
        body = None if robot is None else load_robot(robot)
        config = PoseConfig() if body is None or body.pose is None else body.pose
        return config, lambda sample: None
    config = prepared.robot.pose or PoseConfig()
    height_m = ground_height(prepared.ground)
    # the body lies straight, or in the shape in which the run begins
    headings_rad = prepared.start_heading_rad, prepared.initial_pose().heading_rad

    def judge(sample: PoseSample) -> str | None:
        faults = [
            start_fault(sample, prepared.robot, config, prepared.run.start_m, height_m, heading_rad)
            for heading_rad in headings_rad
        ]
        return faults[0] if all(faults) else None

    return config, judge
