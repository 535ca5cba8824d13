"""A run whose chain is on two ports: two real pseudo-terminals, one command, simulated time."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked, load_robot, with_keys
from snakewalk.config.template import plain_toml
from snakewalk.controller.run import backend
from snakewalk.controller.run.external import simulated_backend
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot
from snakewalk.controller.runlog.reader import read_log
from snakewalk.drivers.errors import BusError, PortError
from snakewalk.drivers.port import network_port
from snakewalk.drivers.protocol.packet import BROADCAST_ID, Instruction, InstructionPacket
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.physics.split_plant import SplitPlant
from snakewalk.sim.serve.bench_line import bench_line
from snakewalk.sim.serve.chain_spec import parse_chain
from snakewalk.sim.serve.pty import PtyServer
from tests.helpers.command import Ended, snakewalk
from tests.helpers.in_process import leave_out_pages
from tests.helpers.pty_port import PtyPort, ServedClock


class Bench:
    """Servos 1 to 8 on one pseudo-terminal, 9 to 16 on another."""

    def __init__(self, opened: ExitStack, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock = clock = ServedClock()
        self.lines = [bench_line(parse_chain(ids)) for ids in ("1-8", "9-16")]
        servers = [opened.enter_context(PtyServer(line, clock)) for line in self.lines]
        self.paths = [server.path for server in servers]
        by_path = dict(zip(self.paths, servers, strict=True))

        def open_port(device: str, baud: int, _clock: object = None) -> PtyPort:
            if device not in by_path:
                raise PortError(f"{device}: no such port")
            return opened.enter_context(PtyPort(by_path[device], baud, clock))

        for module in (backend, network_port):
            monkeypatch.setattr(module, "open_port", open_port)
        leave_out_pages(monkeypatch)

    def run(self, folder: Path, port: str, *words: str) -> Ended:
        return snakewalk(
            *("gait", "run", "lateral-undulation", "--port", port, "--seconds", "1", "--no-film"),
            *("--out", str(folder), *words),
        )

    def torque_on(self) -> list[bool]:
        found = []
        for line in self.lines:
            assert isinstance(line, SimLine)
            line.settle()
            found.append(bool(line.firmware.drive.torque_on.any()))
        return found


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    with ExitStack() as opened:
        yield Bench(opened, monkeypatch)


@pytest.mark.slow
def test_a_gait_runs_over_two_ports(bench: Bench, tmp_path: Path) -> None:
    port = f"1-8={bench.paths[0]},9-16={bench.paths[1]}"
    gait = prepare_gait("lateral-undulation", seconds=1.0)
    finished = run_robot(RunRequest(gait, tmp_path, port, stoppable=False))
    assert finished.outcome.tripped is None
    assert finished.outcome.duration_s > 1.0
    assert bench.torque_on() == [False, False]
    assert finished.record.header.backend == port
    assert [each.port for each in finished.record.header.robot.ports] == bench.paths


@pytest.mark.slow
def test_a_port_that_vanishes_in_a_run_is_told_by_name(bench: Bench, tmp_path: Path) -> None:
    gone = {"seed": 1, "fault": [{"kind": "port", "at_s": 1.5, "for_s": 60.0}]}
    FaultPlayer(bench.lines[1], checked(FaultPlan, gone, "faults"))
    robot = load_robot("yaw16")
    ports = [
        {"port": path, "ids": tuple(ids)}
        for path, ids in zip(bench.paths, (range(1, 9), range(9, 17)), strict=True)
    ]
    file, name = tmp_path / "mine.toml", bench.paths[1]
    file.write_text(plain_toml(with_keys(robot, {"ports": ports}, "mine")), encoding="utf-8")
    done = bench.run(tmp_path / "run", "robot", "--robot", str(file))
    assert done.returncode == 1, done.stderr
    assert f"snakewalk: {name}: " in done.stderr
    assert "on the other ports torque is off" in done.stderr
    assert bench.torque_on()[0] is False


@pytest.mark.parametrize(
    ("port", "fault"),
    [
        ("robot", "the file of yaw16 has no [[ports]]"),
        ("1-8={0},9-15={1}", "ports: ID 16 is on none of them"),
        ("1-8={0},9-16=/dev/nowhere", "/dev/nowhere: no such port"),
    ],
)
def test_ports_that_do_not_fit_are_refused(
    bench: Bench, tmp_path: Path, port: str, fault: str
) -> None:
    done = bench.run(tmp_path, port.format(*bench.paths))
    assert done.returncode == 2
    assert fault in done.stderr
    assert "Traceback" not in done.stderr
    assert bench.torque_on() == [False, False]


def test_a_command_for_one_port_says_so(tmp_path: Path) -> None:
    done = snakewalk(
        *("bus", "calibrate", "--robot", "yaw16", "--port", "1-8=/dev/a,9-16=/dev/b"),
        *("-o", str(tmp_path / "mine.toml")),
    )
    assert done.returncode == 2
    assert "one port at a time" in done.stderr


class Service:
    """Commands that care for servos, on the same two ports."""

    def __init__(self, bench: Bench) -> None:
        self.bench, (first, second) = bench, bench.paths
        self.port = f"1-8={first},9-16={second}"

    def __call__(self, *words: object) -> Ended:
        return snakewalk(*map(str, words), "--port", self.port)

    def row(self, servo_id: int) -> tuple[SimLine, int]:
        """Line and row of a servo."""
        line = self.bench.lines[servo_id > 8]
        assert isinstance(line, SimLine)
        line.settle()
        return line, (servo_id - 1) % 8


@pytest.fixture
def service(bench: Bench) -> Service:
    return Service(bench)


def test_a_servo_is_found_on_its_port(service: Service) -> None:
    seen: dict[int, int] = {}
    for servo_id in (3, 12):
        line, row = service.row(servo_id)
        line.bank["Hardware Error Status"][row] = 0x20
    done = service("bus", "reboot", "--id", 3, "--id", 12, "--yes")
    assert done.returncode == 0, done.stderr
    for servo_id in (3, 12):
        line, row = service.row(servo_id)
        seen[servo_id] = int(line.bank["Hardware Error Status"][row])
    assert seen == {3: 0, 12: 0}
    assert service("bus", "blink", "--id", 12, "--times", 1).returncode == 0
    done = service("bus", "set", "--id", 9, "--return-delay", 0, "--yes")
    assert done.returncode == 0, done.stderr
    line, row = service.row(9)
    assert line.bank["Return Delay Time"][row] == 0
    done = service("bus", "blink", "--id", 40)
    assert done.returncode == 2
    assert "has no ID 40; give its port" in done.stderr


@pytest.mark.slow
def test_a_walk_goes_on_with_some_servos_real_and_the_others_simulated(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second port's servos 9 to 16 play the metal; 1 to 8 are simulated on a body."""
    heard: list[InstructionPacket] = []
    reader = PacketParser()

    def tap(time_s: float, from_host: bool, data: bytes) -> None:
        if from_host:
            heard.extend(p for p in reader.feed(data) if isinstance(p, InstructionPacket))

    off_rad: list[Floats] = []

    class Watched(SplitPlant):
        def follow(self, at_s: Floats, position_rad: Floats, velocity_rad_s: Floats) -> None:
            off_rad.append((self._plant.position_rad - position_rad)[8:])
            super().follow(at_s, position_rad, velocity_rad_s)

    monkeypatch.setattr(simulated_backend, "SplitPlant", Watched)
    monkeypatch.setattr(simulated_backend, "RealTimeClock", lambda: bench.clock)
    bench.lines[1].taps.append(tap)
    walk = prepare_walk("flat-square", robot="yaw16", keys={"run.time_limit_s": 6.0})
    port = f"1-8=sim,9-16={bench.paths[1]}"
    finished = run_robot(RunRequest(walk, tmp_path, port, stoppable=False))
    assert finished.outcome.tripped is None
    record = finished.record
    assert record.header.backend == port
    # the body walks: as far as one whose servos are all simulated, at its head
    whole = run_robot(RunRequest(walk, tmp_path / "whole", stoppable=False)).record
    ways_m = [
        np.linalg.norm(np.diff(each.pose.head_m[[0, -1], :2], axis=0)) for each in (record, whole)
    ]
    assert ways_m[0] == pytest.approx(ways_m[1], rel=0.2)
    assert ways_m[1] > 0.2
    # and its joints are where the real servos are
    assert np.sqrt(np.mean(np.square(off_rad[100:]))) < 0.02
    named = {each.servo_id for each in heard}
    for each in heard:
        if each.servo_id == BROADCAST_ID:
            size = int.from_bytes(each.params[2:4], "little")
            writes = each.instruction == Instruction.SYNC_WRITE
            named |= set(each.params[4 :: size + 1 if writes else 1])
    assert named == {BROADCAST_ID, *range(9, 17)}


def test_a_real_servo_that_dies_stops_the_simulated_ones_as_well(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulated_backend, "RealTimeClock", lambda: bench.clock)
    dies = {"seed": 1, "fault": [{"kind": "mute", "ids": [12], "at_s": 2.5, "for_s": 60.0}]}
    FaultPlayer(bench.lines[1], checked(FaultPlan, dies, "faults"))
    gait = prepare_gait("lateral-undulation", seconds=3.0)
    name = f"joint yaw_12 (ID 12 on {bench.paths[1]})"
    with pytest.raises(BusError, match="torque off is not confirmed") as silent:
        run_robot(RunRequest(gait, tmp_path, f"1-8=sim,9-16={bench.paths[1]}", stoppable=False))
    assert str(silent.value).startswith(name)  # and nobody else: the simulated ones confirm it
    trips = [each.text for each in read_log(tmp_path / "log.mcap").events if each.kind == "trip"]
    assert [each.startswith(f"{name}: not read for 0.1") for each in trips] == [True]
    assert bench.torque_on()[1] is False
