"""Inventory of a bus: each servo with its state, and a robot's file to begin with."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import cycle

from snakewalk.config.loader import checked
from snakewalk.config.robot import RobotConfig
from snakewalk.config.template import plain_toml
from snakewalk.controller.bench.scan import ScanResult, scan
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.bus.feetech_scan import VARIANT_LIMIT, shipped_variants
from snakewalk.drivers.chain.start_up import ServoReport, read_report
from snakewalk.drivers.errors import BusError, ControlTableError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.registers import alarm_names


@dataclass(frozen=True, slots=True)
class InventoryEntry:
    """One servo on the wire."""

    found: ScanResult
    report: ServoReport | None
    """Report of the servo; None if it answers a ping and no read, or the SDK does not know its
    model."""

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        report = self.report
        return self.found.to_dict() | {"state": asdict(report) if report is not None else None}

    @property
    def fault(self) -> str:
        """Fault of the servo in words; empty: no fault."""
        if self.report is None:
            return "answers pings, but its registers cannot be read"
        alarm = alarm_names(self.report.hardware_error)
        return f"alarm: {alarm}" if alarm else ""


def take_inventory(
    port: BytePort,
    latency_s: float,
    bauds: Sequence[int],
    on_progress: Callable[[str], None],
) -> list[InventoryEntry]:
    """Look for servos at each baud rate and read their state; changes nothing in them.

    Raises:
        PortError: the port vanished.

    """
    before = port.getBaudRate()
    entries = []
    try:
        report = scan(port, bauds, on_progress)
        if report.bad_line is not None:
            on_progress(report.bad_line)
        for servo in report.servos:
            port.setBaudRate(servo.baud)
            entries.append(InventoryEntry(servo, _state(port, latency_s, servo)))
    finally:
        port.setBaudRate(before)
    return entries


def _state(port: BytePort, latency_s: float, servo: ScanResult) -> ServoReport | None:
    try:
        bus = servo_bus(port, servo.model, latency_s=latency_s)
        return read_report(bus, servo.servo_id, servo.model)
    except (BusError, ControlTableError):
        return None


def robot_skeleton(
    name: str,
    entries: Sequence[InventoryEntry],
    segments: Sequence[tuple[str, Sequence[int]]],
    *,
    axes: str,
) -> str:
    """A robot's file of the servos found, in the order of their IDs; axes are for a person to say.

    Args:
        name: of the robot.
        entries: at one baud rate, that of most servos.
        segments: port and IDs of each segment, where there are several.
        axes: of the joints from the head, ``y`` or ``p``; a short word repeats.

    Raises:
        ConfigError: these servos make no robot, such as one of Protocol 1.0.

    """
    baud = Counter(entry.found.baud for entry in entries).most_common(1)[0][0]
    chain = [entry for entry in entries if entry.found.baud == baud]
    model = Counter(entry.found.model for entry in chain).most_common(1)[0][0]
    volts = sorted(entry.report.voltage_v for entry in chain if entry.report is not None)
    servo: dict[str, object] = {"model": model, "baud": baud}
    if volts:
        servo["supply_v"] = round(volts[len(volts) // 2], 3)
    joints: list[dict[str, object]] = []
    for entry, axis in zip(chain, cycle(axes), strict=False):
        model_key = {} if entry.found.model == model else {"model": entry.found.model}
        joints.append({"axis": axis, "id": entry.found.servo_id, **model_key})
    chosen = {entry.found.servo_id for entry in chain}
    ports = [
        {"port": port, "ids": ids}
        for port, there in segments
        if (ids := [servo_id for servo_id in there if servo_id in chosen])
    ]
    described = {"name": name, "servo": servo, "joints": joints}
    variants = sorted({name for entry in chain for name in shipped_variants(entry.found.model)})
    models_text = f"- the models: {VARIANT_LIMIT} tells {' from '.join(variants)};\n"
    robot = checked(RobotConfig, described | ({"ports": ports} if len(ports) > 1 else {}), name)
    return plain_toml(
        robot,
        f"{len(chain)} servos as snakewalk bus inventory found them. Not known, and assumed:\n"
        "- the order: by ID from the head; snakewalk bus calibrate finds it, and signs and zeros;\n"
        f"{models_text * bool(variants)}"
        f'- axes: "{axes}" from the head, repeated: y turns about the vertical, p lifts;\n'
        "- links: link_length_m, link_mass_kg, body_radius_m, or [[links]]; as by default.",
    )
