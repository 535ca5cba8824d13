"""``snakewalk bus``: ``serve`` simulated servos, ``sniff`` bytes, and care for servos.

``set`` a servo's settings, ``backup`` and ``restore`` those of all, ``reboot``, ``blink``.
"""

import json
import math
import os
import select
import signal
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from snakewalk.config.errors import InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import load, load_robot, load_world
from snakewalk.controller.bench import inventory, scan
from snakewalk.controller.bench.eeprom_backup import (
    back_up_all,
    backup_text,
    load_backup,
    plan_restore,
)
from snakewalk.controller.bench.live_table import LiveScreen, Snapshot
from snakewalk.controller.bench.port_lines import open_lines
from snakewalk.controller.bench.servo_settings import (
    SettingsRequest,
    SettingsResult,
    apply,
    plan,
    restart,
)
from snakewalk.controller.bench.sniff import receive, stand_between
from snakewalk.controller.console import completion
from snakewalk.controller.console.command import command
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.options import ChainPort, Force, Json, console, show
from snakewalk.controller.console.result_files import atomic_write, refuse_to_overwrite
from snakewalk.drivers.clock import WallClock
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.priority import raised_priority
from snakewalk.drivers.protocol.registers import BAUDS
from snakewalk.sim.ax12.decode import Decoder1
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.ax12.table import MODEL as AX12
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import Mounting
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import ChainSpec, parse_chain, parse_imu
from snakewalk.sim.serve.console import Console
from snakewalk.sim.serve.live_table import LiveTable, ax12_rows, servo_rows
from snakewalk.sim.serve.recorded_line import RecordedLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.motor import motors_of
from snakewalk.sim.servo.protection import SupplyAndAmbient
from snakewalk.sim.sniff.decode import Decoder
from snakewalk.sim.sniff.trace import TraceWriter, read_trace

if TYPE_CHECKING:
    from collections.abc import Callable

    from snakewalk.controller.bench.live_table import MakeDecoder
    from snakewalk.controller.bench.servo_settings import SettingChange
    from snakewalk.drivers.clock import Clock
    from snakewalk.sim.faults.fault_player import FaultPlayer
    from snakewalk.sim.line.sim_line import SimLine
    from snakewalk.sim.line.wire import Wire
    from snakewalk.sim.serve.chain_spec import ChainSpec
    from snakewalk.sim.serve.console import Console
    from snakewalk.sim.serve.live_table import LiveTable
    from snakewalk.sim.serve.pty import PtyServer

    Served = tuple[ChainSpec, Wire, LiveTable, MakeDecoder, FaultPlayer | None]

REFRESH_S = 0.25
"""Time between two drawings of the live table."""
STEP_S = 0.02
LATE_SHARE = 0.05
"""Of the time served: who left more of it out is told so at the end."""


@command(
    "bus serve",
    examples=("bus serve --servos 1-16", "bus serve --robot yaw16 --faults faults.toml --pace 0.5"),
)
def serve(
    servos: Annotated[
        str | None,
        typer.Option(help="IDS[:MODEL],... on a bench: 1-16, or 1-2:XL430-W250,3-6:XL330-M288"),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="shipped robot or a TOML file, in MuJoCo on flat ground",
            autocompletion=completion.ROBOTS,
        ),
    ] = None,
    imu: Annotated[
        str | None,
        typer.Option(help="ID[:MODEL] of an IMU beside --servos, level and still: 200:imu_to_dxl"),
    ] = None,
    baud: Annotated[int | None, typer.Option(help="of the servos, bit/s")] = None,
    pace: Annotated[float, typer.Option(help="simulated seconds a second")] = 1.0,
    faults: Annotated[Path | None, typer.Option(help="TOML file of what goes wrong")] = None,
    latency: Annotated[float, typer.Option(help="of the USB adapter, ms")] = 0.0,
    link: Annotated[Path | None, typer.Option(help="symbolic link that leads to the port")] = None,
    record: Annotated[Path | None, typer.Option(help="write the exchange here, JSON lines")] = None,
    play: Annotated[
        Path | None,
        typer.Option(help="give the replies of an exchange that --record wrote, instead of servos"),
    ] = None,
    for_s: Annotated[float | None, typer.Option("--for", help="seconds; default: until ^C")] = None,
    with_console: Annotated[
        bool,
        typer.Option(
            "--console", help="read set, get, load, fault, pace, quit from standard input"
        ),
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Serve simulated servos at a serial device, in real time, with a live table."""
    try:
        from snakewalk.sim.serve.pty import PtyServer  # noqa: PLC0415
    except ImportError:  # Windows
        raise InputError("bus serve: pseudo-terminals are for Linux and macOS") from None
    if sum(each is not None for each in (servos, robot, play)) > 1:
        raise InputError("give one of --servos, --robot and --play")
    if play is not None and (imu is not None or faults is not None):
        raise InputError("--play: has what was recorded; leave --imu and --faults out")
    if imu is not None and robot is not None:
        raise InputError("--imu: with --robot, its file says it: table [imu]")
    _check_serving(latency, for_s, record, link)
    refuse_to_overwrite([record], force)
    refuse_to_overwrite([link], force=True)
    what, line, traffic, make_decoder, player = _served(
        play, baud, partial(_simulated, servos, robot, imu, baud, faults)
    )
    console = None
    if with_console:
        console = _console(line, player, as_json)
    line.usb_latency_s = latency * 1e-3
    line.taps.append(traffic)
    clock = WallClock()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the link goes, the record is whole
    with raised_priority(), PtyServer(line, clock, pace=pace, link=link) as server:
        out = record.open("w", encoding="utf-8") if record is not None else None
        if out is not None:
            line.taps.append(TraceWriter(out))
        _announce(server, what, line, as_json)
        try:
            ended = lambda: for_s is not None and clock.now_s() >= for_s  # noqa: E731
            if console is not None:
                _converse(server, console, ended)
            else:
                _run(server, traffic, make_decoder, clock, ended, as_json)
        except KeyboardInterrupt:
            print(file=sys.stderr)
        finally:
            if out is not None:
                out.close()
        late_share = server.missed_s / max(clock.now_s() * pace, 1e-9)
    if as_json:
        done: dict[str, float] = {
            "questions": traffic.questions,
            "answers": traffic.answers,
            "bytes": traffic.bytes,
        }
        done |= {"missed_s": server.missed_s, "output_flushes": server.output_flushes}
        print(json.dumps(done | {"servos": traffic.registers()}), flush=True)
    else:
        _tell_what_was_lost(late_share, server.output_flushes)


def _check_serving(
    latency: float, for_s: float | None, record: Path | None, link: Path | None
) -> None:
    """Check numbers and names of ``serve``.

    Raises:
        InputError: one cannot be.

    """
    if not 0.0 <= latency < math.inf:
        raise InputError(f"--latency {latency:g}: must not be negative, nor without end")
    if latency > 1e4:  # no client waits for it (ours)
        raise InputError(f"--latency {latency:g}: must be at most 10000 ms")
    if for_s is not None and not for_s > 0.0:
        raise InputError(f"--for {for_s:g}: must be over 0 s")
    if record is not None and link is not None and record.absolute() == link.absolute():
        raise InputError("--record and --link have the same name")


def _tell_what_was_lost(late_share: float, output_flushes: int) -> None:
    """Say at the end what the machine or the client did that no real bus does."""
    if late_share > LATE_SHARE:
        LOGGER.warning(
            "time ran %.0f %% slower than --pace: this machine is too slow", late_share * 100
        )
    if output_flushes:
        LOGGER.warning(
            "a client flushed its output at least %d times: what it had sent less than 5 ms before "
            "may be lost, as on no UART (docs/bus.md)",
            output_flushes,
        )


@command("bus sniff", examples=("bus sniff exchange.jsonl --json", "bus sniff /dev/ttyUSB1"))
def sniff(
    source: Annotated[
        Path, typer.Argument(help="a recording (JSON lines, hex text, raw), or a serial device")
    ],
    baud: Annotated[int, typer.Option(help="of the device, bit/s")] = 1_000_000,
    model: Annotated[
        str, typer.Option(help="of servos whose model no ping has shown; AX-12A: Protocol 1.0")
    ] = "XM430-W350",
    through: Annotated[
        bool, typer.Option("--through", help="stand between a client and the device")
    ] = False,
    for_s: Annotated[float | None, typer.Option("--for", help="seconds; default: until ^C")] = None,
    as_json: Json = False,
) -> None:
    """Decode a live or recorded exchange packet by packet."""
    if not source.exists():
        raise InputError(f"{source}: no such file or device")
    decoder = Decoder1() if model.upper() == AX12 else Decoder(model)
    live = source.is_char_device()
    if through and not live:
        raise InputError(f"{source}: --through needs a serial device")
    if not live:
        pieces = read_trace(source)
    elif through:
        pieces = stand_between(str(source), baud, for_s)
    else:
        pieces = receive(str(source), baud, for_s)
    size, packets = 0, 0
    try:
        for time_s, data in pieces:
            size += len(data)
            for line in decoder.feed(time_s, data):
                packets += line.kind != "noise"
                print(json.dumps(line.to_dict()) if as_json else line.text(), flush=live)
    except KeyboardInterrupt:
        print(file=sys.stderr)
    if not live and packets == 0:
        what = f"no packet in {size} bytes" if size else "no exchange"
        raise InputError(f"{source}: holds {what}; --model AX-12A reads Protocol 1.0")


def _served(play: Path | None, baud: int | None, simulated: "Callable[[], Served]") -> "Served":
    """What is served, its line, who looks at it, what puts its packets into words, its faults."""
    if play is None:
        return simulated()

    line = RecordedLine.of(play, baud or 1_000_000)
    spec = ChainSpec(tuple(line.ids), (f"recording {play}",) * len(line.ids))
    return spec, line, LiveTable(list), Decoder, None


def _simulated(
    servos: str | None,
    robot: str | None,
    imu: str | None,
    baud: int | None,
    faults: Path | None,
) -> "Served":
    """Simulated servos, as ``_served`` has them."""
    spec = parse_chain(servos or "1-4")
    if robot is None:
        line = bench_line(spec, baud or 1_000_000, imu=None if imu is None else parse_imu(imu))
    else:
        line = _robot_line(robot, baud)
        spec = ChainSpec(line.bank.ids, line.bank.models)
    player = None
    if faults is not None:
        player = FaultPlayer(line, load(faults, FaultPlan), str(faults))
    if isinstance(line, Ax12Line):
        return spec, line, LiveTable(lambda: ax12_rows(line.servos)), Decoder1, None
    models = dict(zip(spec.ids, spec.models, strict=True))
    decoder = partial(Decoder, spec.kinds[0], models)
    return spec, line, LiveTable(lambda: servo_rows(line)), decoder, player


def _robot_line(name: str, baud: int | None) -> "SimLine":
    from snakewalk.sim.physics.plant import MujocoPlant, plant_imu  # noqa: PLC0415

    robot = load_robot(name)
    rate = baud or robot.servo.baud
    bank = ServoBank(robot.servo_ids, robot.servo_models, rate)
    plant = MujocoPlant(robot, load_world("flat"))
    return SimLine(
        bank,
        plant,
        baud=rate,
        mounting=Mounting.of(robot),
        motors=motors_of(robot),
        supply_and_ambient=SupplyAndAmbient.of(robot),
        imu=plant_imu(robot, plant, rate),
    )


def _announce(server: "PtyServer", what: "ChainSpec", line: "Wire", as_json: bool) -> None:
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
    server: "PtyServer",
    traffic: "LiveTable",
    make_decoder: "MakeDecoder",
    clock: "Clock",
    stopped: "Callable[[], bool]",
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


def _console(line: "Wire", player: "FaultPlayer | None", as_json: bool) -> "Console":

    if as_json:
        raise InputError("--console: is a person's; leave --json out")
    if not isinstance(line, SimLine):
        raise InputError("--console: servos of Protocol 2.0 have one")
    return Console(line, player or FaultPlayer(line, FaultPlan()))


def _converse(server: "PtyServer", console: "Console", stopped: "Callable[[], bool]") -> None:
    """Serve, and execute the lines of standard input; its end leaves the servos served."""
    console.set_pace, heard, unread = server.set_pace, sys.stdin.fileno(), ""
    listening = True
    while not stopped():
        server.step(STEP_S)
        if not listening or not select.select([heard], [], [], 0.0)[0]:
            continue
        more = os.read(heard, 4096).decode(errors="replace")
        listening = bool(more)
        *lines, unread = (unread + more).split("\n")
        for text in filter(str.strip, lines):
            if text.strip() == "quit":
                return
            print(console.execute(text), flush=True)


@command(
    "bus set",
    examples=(
        "bus set --id 1 --baud 57600 --new-id 7 --new-baud 1000000 --dry-run",
        "bus set --id 7 --return-delay 0 --yes",
    ),
)
def bus_set(
    servo_id: Annotated[int, typer.Option("--id", help="the servo, 0 to 252")],
    port: ChainPort = None,
    baud: Annotated[int, typer.Option(help="at which it answers now")] = 1_000_000,
    new_id: Annotated[int | None, typer.Option(help="0 to 252")] = None,
    new_baud: Annotated[int | None, typer.Option(help="bit/s")] = None,
    min_position: Annotated[float | None, typer.Option(help="rad, 0 is straight")] = None,
    max_position: Annotated[float | None, typer.Option(help="rad, 0 is straight")] = None,
    current_limit: Annotated[float | None, typer.Option(help="A")] = None,
    temperature_limit: Annotated[float | None, typer.Option(help="C")] = None,
    voltage_min: Annotated[float | None, typer.Option(help="V")] = None,
    voltage_max: Annotated[float | None, typer.Option(help="V")] = None,
    return_delay: Annotated[float | None, typer.Option(help="us")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show the changes, no more")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="write without asking")] = False,
    as_json: Json = False,
) -> None:
    """Change settings of one servo that outlive its power; shows them and asks first."""
    if baud not in BAUDS:
        raise ControlTableError(f"--baud {baud}: servos have {', '.join(map(str, BAUDS))}")
    request = SettingsRequest(
        new_id=new_id,
        new_baud=new_baud,
        min_position_rad=min_position,
        max_position_rad=max_position,
        current_limit_a=current_limit,
        temperature_limit_c=temperature_limit,
        voltage_min_v=voltage_min,
        voltage_max_v=voltage_max,
        return_delay_us=return_delay,
    )
    with open_lines(port, baud) as lines:
        bus = lines.open_servo(servo_id)
        changes = plan(bus, servo_id, request)
        if not as_json:
            _show(servo_id, bus.table.model, changes)
        written = bool(changes) and not dry_run and (yes or _confirmed(as_json))
        if written:
            apply(bus, servo_id, changes)
    if as_json:
        print(json.dumps(SettingsResult(servo_id, changes, written).to_dict()))
    elif changes:
        console.print("written and read back" if written else "nothing written")


_BLINK_S = 0.3
"""How long a LED is on, and then off."""
_Ids = Annotated[list[int], typer.Option("--id", help="a servo, 0 to 252; may be repeated")]
_Baud = Annotated[int, typer.Option(help="at which the servos answer")]


@command(
    "bus backup", examples=("bus backup -o servos.json", "bus backup --baud 57600 -o one.json")
)
def backup(
    out: Annotated[Path, typer.Option("--out", "-o", help="file (.json)")],
    port: ChainPort = None,
    baud: _Baud = 1_000_000,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write the EEPROM of all servos on the bus into a file; changes nothing."""
    refuse_to_overwrite([out], force)
    with open_lines(port, baud) as lines:
        found = back_up_all(lines, lambda step: typer.echo(step, err=True))
    with atomic_write(out) as part:
        part.write_text(backup_text(found), encoding="utf-8")
    show({"servos": [each.id for each in found.servos], "backup": str(out)}, as_json)


@command("bus identify", examples=("bus identify", "bus identify --baud 1000000 -o mine.toml"))
def bus_identify(
    port: ChainPort = None,
    baud: Annotated[
        list[int] | None, typer.Option(help="only this rate, may be given again; default: all")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="a robot's file to begin with (.toml)")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Tell who is on the wire: models, IDs, firmware, faults; suggest a robot's file."""
    if out is not None and out.suffix != ".toml":
        raise InputError(f"{out}: a robot's file ends in .toml")
    refuse_to_overwrite([out], force)
    scan.check_bauds(baud or ())
    with open_lines(port, baud[0] if baud else 1_000_000) as lines:
        entries = [
            (line.name, entry)
            for line, _ in lines.lines
            for entry in inventory.take_inventory(
                line, line.latency_s, baud or (), lambda step: typer.echo(step, err=True)
            )
        ]
    if not entries:
        raise InputError(f"{lines.port}: nobody answers: power? cable? adapter's switch?")
    for note in lines.misplaced((name, entry.found.servo_id) for name, entry in entries):
        LOGGER.warning("%s", note)
    if out is not None:
        segments = [
            (line.name, [entry.found.servo_id for name, entry in entries if name == line.name])
            for line, _ in lines.lines
        ]
        text = inventory.robot_skeleton(
            out.stem, [entry for _, entry in entries], segments if lines.several else ()
        )
        with atomic_write(out) as part:
            part.write_text(text, encoding="utf-8")
    if as_json:
        servos = [entry.to_dict() | {"port": name} for name, entry in entries]
        print(json.dumps({"port": lines.port, "servos": servos, "robot": out and str(out)}))
        return
    heads = ("ID", "model", "firmware", "baud", "volt", "Celsius", "torque", "fault")
    table = Table(*heads, *(["port"] if lines.several else []), box=None)
    for name, entry in entries:
        found, state = entry.found, entry.report
        state_told = ("-",) * 3
        if state is not None:
            torque = "on" if state.torque_on else "off"
            state_told = f"{state.voltage_v:.1f}", f"{state.temperature_c:.0f}", torque
        about = (found.servo_id, found.model, found.firmware, found.baud)
        table.add_row(
            *map(str, about), *state_told, entry.fault, *([name] if lines.several else [])
        )
    console.print(table)
    if out is not None:
        console.print(f"robot {out}: say the axes, then: snakewalk calibrate --robot {out}")


@command(
    "bus restore",
    examples=("bus restore servos.json --dry-run", "bus restore servos.json --id 7 --yes"),
)
def restore(
    file: Annotated[Path, typer.Argument(help="of `snakewalk bus backup`", dir_okay=False)],
    servo_id: Annotated[
        list[int] | None, typer.Option("--id", help="only this servo; may be repeated")
    ] = None,
    port: ChainPort = None,
    baud: _Baud = 1_000_000,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show the changes, no more")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="write without asking")] = False,
    as_json: Json = False,
) -> None:
    """Write a backup's values where they differ; shows them and asks first."""
    servos = {each.id: each for each in load_backup(file).servos}
    wanted = servo_id or list(servos)
    missing = [str(each) for each in wanted if each not in servos]
    if missing:
        raise InputError(
            f"{file}: has no ID {', '.join(missing)}; it has {', '.join(map(str, servos))}"
        )
    with open_lines(port, baud) as lines:
        buses = {each: lines.open_servo(each) for each in wanted}
        plans = {each: plan_restore(buses[each], servos[each]) for each in wanted}
        changed = {each: changes for each, changes in plans.items() if changes}
        if not as_json:
            table = Table("ID", "register", "now", "then", box=None)
            for each, changes in changed.items():
                for change in changes:
                    table.add_row(str(each), change.register, str(change.before), str(change.after))
            console.print(table if changed else "nothing to restore")
        written = bool(changed) and not dry_run and (yes or _confirmed(as_json))
        if written:
            for each, changes in changed.items():
                apply(buses[each], each, changes)
    if as_json:
        shown = {
            str(each): {c.register: [c.before, c.after] for c in changes}
            for each, changes in changed.items()
        }
        print(json.dumps({"changes": shown, "written": written}))
    elif changed:
        console.print("written and read back" if written else "nothing written")


@command("bus reboot", examples=("bus reboot --id 3 --id 4",))
def reboot(
    servo_id: _Ids,
    port: ChainPort = None,
    baud: _Baud = 1_000_000,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="without asking")] = False,
    as_json: Json = False,
) -> None:
    """Restart servos, which clears their alarms; torque goes off: what they hold falls."""
    facts: dict[str, object] = {}
    with open_lines(port, baud) as lines:
        buses = {each: lines.open_servo(each) for each in servo_id}
        if yes or _confirmed(
            as_json, "torque goes off: what these servos hold falls; reboot them?"
        ):
            for each, bus in buses.items():
                before, after = restart(bus, each)
                facts[f"ID {each}"] = (
                    f"rebooted; alarm before: {before or 'none'}; now: {after or 'none'}"
                )
    show(facts or {"rebooted": "none"}, as_json)


@command("bus blink", examples=("bus blink --id 7 --times 10",))
def blink(
    servo_id: _Ids,
    port: ChainPort = None,
    baud: _Baud = 1_000_000,
    times: Annotated[int, typer.Option(min=1, max=1000, help="how often")] = 5,
    as_json: Json = False,
) -> None:
    """Let the LED of servos blink, to find them; nothing moves."""
    with open_lines(port, baud) as lines:
        buses = {each: lines.open_servo(each) for each in servo_id}
        clock = lines.lines[0][0].clock
        try:
            for _ in range(times):
                for on in (1, 0):
                    for each, bus in buses.items():
                        bus.write(each, "LED", on)
                    clock.sleep_until_s(clock.now_s() + _BLINK_S)
        finally:
            for each, bus in buses.items():
                bus.write(each, "LED", 0)
    show({"blinked": list(buses), "times": times}, as_json)


def _show(servo_id: int, model: str, changes: "tuple[SettingChange, ...]") -> None:
    if not changes:
        console.print(f"servo {servo_id} ({model}): nothing to change")
        return
    table = Table(f"servo {servo_id} ({model})", "now", "then", "", box=None)
    for change in changes:
        table.add_row(change.register, str(change.before), str(change.after), change.meaning)
    console.print(table)


def _confirmed(as_json: bool, question: str = "write this?") -> bool:
    """Ask a person, if there is one."""
    if as_json or not sys.stdin.isatty():
        print("snakewalk: nothing written; say --yes to write without asking", file=sys.stderr)
        return False
    return typer.confirm(question, default=False)
