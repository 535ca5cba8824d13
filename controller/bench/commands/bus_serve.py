"""``snakewalk bus serve``: simulated servos at a serial device."""

import json
import math
import os
import select
import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from snakewalk.config.constants import DEFAULT_BAUD
from snakewalk.config.errors import InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.loader import load
from snakewalk.controller.bench.commands.serve_options import (
    At,
    OfRun,
    PoseOut,
    SimulatedRobot,
    Tracker,
    TruthFile,
)
from snakewalk.controller.bench.live_table import LiveScreen, MakeDecoder, Snapshot
from snakewalk.controller.bench.served_body import ServedBody
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import Force, Json, World
from snakewalk.controller.console.result_files import refuse_to_overwrite
from snakewalk.controller.pose.udp_feed import UdpSender
from snakewalk.controller.run.external.served_robot import ServedRobot
from snakewalk.drivers.clock import Clock, WallClock
from snakewalk.drivers.priority import raised_priority
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.feetech.decode import decoder_for
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import ChainSpec, parse_chain, parse_imu
from snakewalk.sim.serve.console import Console
from snakewalk.sim.serve.live_table import LiveTable, ax12_rows, servo_rows
from snakewalk.sim.serve.recorded_line import RecordedLine
from snakewalk.sim.serve.virtual_time import VirtualTimeServer
from snakewalk.sim.sniff.decode import Decoder
from snakewalk.sim.sniff.trace import TraceWriter

try:
    from snakewalk.sim.serve.pty import PtyServer
except ImportError:  # Windows
    PtyServer = None  # type: ignore[assignment, misc]

if TYPE_CHECKING:
    from snakewalk.sim.line.wire import Wire

    Server = PtyServer | VirtualTimeServer
    Served = tuple[ChainSpec, Wire, LiveTable, MakeDecoder, FaultPlayer | None]

REFRESH_S = 0.25
"""Time between two drawings of the live table."""
STEP_S = 0.02
LATE_SHARE = 0.05
"""Share of the time served; a larger loss is reported at the end (ours)."""
Servos = Annotated[
    str | None,
    typer.Option(
        help="servos without a body, as IDS[:MODEL],..., e.g. 1-16 or 1-2:XL430-W250,3-6:XL330-M288"
    ),
]
BenchImu = Annotated[
    str | None,
    typer.Option(
        help="level, motionless IMU to add to --servos, as ID[:MODEL], e.g. 200:imu_to_dxl"
    ),
]
Recorded = Annotated[
    Path | None,
    typer.Option(help="replay an exchange that --record wrote, instead of simulating servos"),
]
WithConsole = Annotated[
    bool,
    typer.Option(
        "--console", help="read commands (set, get, load, fault, pace, quit) from standard input"
    ),
]


@command(
    "bus serve",
    examples=("bus serve --servos 1-16", "bus serve --robot yaw16 --faults faults.toml --pace 0.5"),
)
def serve(
    servos: Servos = None,
    robot: SimulatedRobot = None,
    world: World = None,
    run: OfRun = None,
    at: At = None,
    pose_out: PoseOut = None,
    tracker: Tracker = None,
    truth: TruthFile = None,
    seed: Seed = SEED,
    imu: BenchImu = None,
    baud: Annotated[int | None, typer.Option(help="baud rate of the servos in bit/s")] = None,
    pace: Annotated[float, typer.Option(help="simulated seconds per second of real time")] = 1.0,
    virtual_time: Annotated[
        bool,
        typer.Option(
            "--virtual-time",
            help="print a URL for --port of one other command; time passes only while that "
            "command waits",
        ),
    ] = False,
    faults: Annotated[Path | None, typer.Option(help="TOML file of faults to simulate")] = None,
    latency: Annotated[float, typer.Option(help="latency of the USB adapter in ms")] = 0.0,
    link: Annotated[
        Path | None, typer.Option(help="create a symbolic link to the port here")
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="write the exchange here as JSON lines")
    ] = None,
    play: Recorded = None,
    for_s: Annotated[
        float | None,
        typer.Option("--for", help="stop after this many seconds; default: serve until Ctrl-C"),
    ] = None,
    with_console: WithConsole = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Serve simulated servos at a serial device, in real time, with a live table."""
    if PtyServer is None:
        raise InputError("bus serve: pseudo-terminals are for Linux and macOS")
    body = ServedBody(
        robot=robot,
        world=world,
        run=run,
        at=at,
        pose_out=pose_out,
        tracker=tracker,
        truth=truth,
        seed=seed,
    )
    body.check()
    if sum(given_source is not None for given_source in (servos, robot or run, play)) > 1:
        raise InputError("give one of --servos, --robot, --run and --play")
    _check_additions(play, imu, faults, body)
    if virtual_time:
        _check_virtual_time(link, pace)
    _check_serving(latency, for_s, record, link)
    refuse_to_overwrite([record, truth], force)
    refuse_to_overwrite([link], force=True)
    with ExitStack() as stack:
        served = stack.enter_context(body.make(baud)) if body.is_given else None
        what, line, traffic, make_decoder, player = _served_line(
            play, baud, partial(_simulated_line, servos, served, imu, baud, faults)
        )
        console = _console(line, player, as_json) if with_console else None
        line.usb_latency_s = latency * 1e-3
        line.taps.append(traffic)
        clock = WallClock()
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # files are closed
        stack.enter_context(raised_priority())
        server: Server
        publish: Callable[[], object] = list
        if virtual_time:
            server = stack.enter_context(
                VirtualTimeServer(line, None if served is None else served.due)
            )
        else:
            server = stack.enter_context(PtyServer(line, clock, pace=pace, link=link))
            publish = _publisher(stack, served, body, server)
        if record is not None:
            line.taps.append(TraceWriter(stack.enter_context(record.open("w", encoding="utf-8"))))
        _announce(server, what, line, as_json)

        def ended() -> bool:
            publish()
            return for_s is not None and clock.now_s() >= for_s

        try:
            if console is not None:
                _converse(server, console, ended)
            else:
                _run(server, traffic, make_decoder, clock, ended, as_json)
        except KeyboardInterrupt:
            print(file=sys.stderr)
        late_share = server.missed_s / max(clock.now_s() * pace, 1e-9)
    if as_json:
        _print_counts(traffic, server)
    else:
        _report_losses(late_share, server.output_flushes)


def _check_additions(
    play: Path | None, imu: str | None, faults: Path | None, body: ServedBody
) -> None:
    if play is not None and (imu is not None or faults is not None):
        raise InputError("--play: repeats a recorded exchange; leave --imu and --faults out")
    if imu is not None and body.is_given:
        raise InputError(
            "--imu: the robot's file describes its IMU in the table [imu]; leave --imu out"
        )


def _check_virtual_time(link: Path | None, pace: float) -> None:
    if link is not None or pace != 1.0:
        raise InputError("--virtual-time: has no device and no pace; leave --link and --pace out")


def _publisher(
    stack: ExitStack, served: ServedRobot | None, body: ServedBody, server: "PtyServer"
) -> Callable[[], None]:
    """Return a function that sends the poses that are due."""
    if served is None or body.pose_out is None:
        return lambda: None
    served.tracker.clock = server.real_time_s
    sender = UdpSender(*body.address())
    stack.callback(sender.close)

    def publish() -> None:
        for sent in served.tracker.due(served.line.clock.now_s()):
            sender.send(sent.data)

    return publish


def _print_counts(traffic: LiveTable, server: "Server") -> None:
    counts: dict[str, float] = {
        "questions": traffic.questions,
        "answers": traffic.answers,
        "bytes": traffic.bytes,
        "missed_s": server.missed_s,
        "latest_s": server.latest_s,
        "output_flushes": server.output_flushes,
    }
    print(json.dumps(counts | {"servos": traffic.registers()}), flush=True)


def _check_serving(
    latency: float, for_s: float | None, record: Path | None, link: Path | None
) -> None:
    """Check numbers and names of ``serve``.

    Raises:
        InputError: one cannot be.

    """
    if not 0.0 <= latency < math.inf:
        raise InputError(f"--latency {latency:g}: must be finite and at least 0 ms")
    if latency > 1e4:  # no client waits for it (ours)
        raise InputError(f"--latency {latency:g}: must be at most 10000 ms")
    if for_s is not None and not for_s > 0.0:
        raise InputError(f"--for {for_s:g}: must be over 0 s")
    if record is not None and link is not None and record.absolute() == link.absolute():
        raise InputError("--record and --link have the same name")


def _report_losses(late_share: float, output_flushes: int) -> None:
    """Say at the end what the machine or the client did that no real bus does."""
    if late_share > LATE_SHARE:
        LOGGER.warning(
            "time ran %.0f %% slower than --pace: this machine is too slow", late_share * 100
        )
    if output_flushes:
        LOGGER.warning(
            "a client flushed its output at least %d times: bytes that it sent less than 5 ms "
            "before may be lost, which no UART does (docs/how-to/serve-a-bus.md)",
            output_flushes,
        )


def _served_line(
    play: Path | None, baud: int | None, simulated: "Callable[[], Served]"
) -> "Served":
    """Name of the line, the line, its taps, the decoder of its packets, and its faults."""
    if play is None:
        return simulated()
    line = RecordedLine.of(play, baud or DEFAULT_BAUD)
    spec = ChainSpec(tuple(line.ids), (f"recording {play}",) * len(line.ids))
    return spec, line, LiveTable(list), Decoder, None


def _simulated_line(
    servos: str | None,
    served: ServedRobot | None,
    imu: str | None,
    baud: int | None,
    faults: Path | None,
) -> "Served":
    """Simulated servos, as ``_served_line`` has them."""
    spec = parse_chain(servos or "1-4")
    if served is None:
        line = bench_line(spec, baud or DEFAULT_BAUD, imu=None if imu is None else parse_imu(imu))
    else:
        line = served.line
    player = None
    if faults is not None:
        player = FaultPlayer(line, load(faults, FaultPlan), str(faults))
    if isinstance(line, Ax12Line):
        spec = ChainSpec(spec.ids, (line.servos.facts.model,) * len(spec.ids))
        decoder = partial(decoder_for, line.servos.facts)
        return spec, line, LiveTable(lambda: ax12_rows(line.servos)), decoder, None
    spec = ChainSpec(line.bank.ids, line.bank.models)
    models = dict(zip(line.bank.ids, line.bank.facts, strict=True))
    decoder = partial(decoder_for, line.bank.facts[0], models)
    return spec, line, LiveTable(lambda: servo_rows(line)), decoder, player


def _announce(server: "Server", what: ChainSpec, line: "Wire", as_json: bool) -> None:
    ids = ", ".join(map(str, what.ids))
    if as_json:
        print(
            json.dumps(
                {
                    "port": server.path,
                    "model": what.model,
                    "ids": list(what.ids),
                    "baud": line.getBaudRate(),
                }
            ),
            flush=True,
        )
    else:
        print(f"port {server.path}", flush=True)
        print(f"{what.model}: {ids} at {line.getBaudRate()} baud; ^C ends", flush=True)


def _run(
    server: "Server",
    traffic: LiveTable,
    make_decoder: MakeDecoder,
    clock: Clock,
    stopped: Callable[[], bool],
    as_json: bool,
) -> None:
    """Serve; draw the table on a terminal, nothing elsewhere."""
    if as_json or not sys.stderr.isatty():
        server.serve(stopped)
        return

    with LiveScreen(make_decoder) as screen:
        due_s = 0.0
        while not stopped():
            server.step(STEP_S)
            now_s = clock.now_s()
            if now_s >= due_s and screen.ready:
                due_s = now_s + REFRESH_S
                counts = (
                    f"{server.path or 'port gone'}   {traffic.questions} questions, "
                    f"{traffic.answers} answers, {traffic.bytes} bytes"
                )
                if server.missed_s >= REFRESH_S:
                    counts += f"; {server.missed_s:.1f} s left out, this machine is too slow"
                screen.show(Snapshot(counts, traffic.registers(), traffic.take_recent()))


def _console(line: "Wire", player: FaultPlayer | None, as_json: bool) -> Console:
    if as_json:
        raise InputError("--console: reads the commands of a person; leave --json out")
    if not isinstance(line, SimLine):
        raise InputError("--console: servos of Protocol 2.0 have one")
    return Console(line, player or FaultPlayer(line, FaultPlan()))


def _converse(server: "Server", console: Console, stopped: Callable[[], bool]) -> None:
    console.set_pace = getattr(server, "set_pace", None)
    terminal = sys.stdin.fileno()
    unread = ""
    listening = True
    while not stopped():
        server.step(STEP_S)
        if not listening or not select.select([terminal], [], [], 0.0)[0]:
            continue
        more = os.read(terminal, 4096).decode(errors="replace")
        listening = bool(more)
        *lines, unread = (unread + more).split("\n")
        for text in filter(str.strip, lines):
            if text.strip() == "quit":
                return
            print(console.execute(text), flush=True)
