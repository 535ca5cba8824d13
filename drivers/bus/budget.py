"""Wire time of a control cycle, computed before a run, and the rate that it allows.

A cycle is one sync write and one sync read, or *fast* sync read, of N servos. A byte lasts ten bit
times (start, eight data bits, stop). Packet lengths: e-manual, DYNAMIXEL Protocol 2.0.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.errors import BudgetError
from snakewalk.drivers.protocol import feetech
from snakewalk.drivers.protocol.imu_table import BLOCK_BYTES
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE

GROUP_BYTES = 14
"""Sync instruction: header 4, id, length 2, instruction, address 2, data length 2, CRC 2."""
STATUS_BYTES = 11
"""Status packet without data: header 4, id, length 2, instruction, error, CRC 2."""
FAST_HEAD_BYTES = 8
"""Common reply to a fast read, without the servos' parts: header 4, id, length 2, instruction."""
FAST_PART_BYTES = 4
"""Bytes of each servo's part of a fast reply, without its data: error, id, CRC 2."""
STATE_BYTES = 10
"""State block, read in every cycle: Present Current, Velocity, Position."""
SLOW_STATE_BYTES = 3
"""Slow state block, read in every 16th cycle: Present Input Voltage, Present Temperature."""
_FEETECH_SUPPLY_BYTES = 2
"""Present Input Voltage and Present Temperature of Feetech servos."""
CHECK_BYTES = 4
"""Longest register that is compared with its setting, in cycles without the slow state."""


@dataclass(frozen=True, slots=True)
class WireBudget:
    """Bytes and seconds of one cycle on the wire."""

    servos: int
    baud: int
    fast: bool
    write_bytes: int
    """Bytes of the sync write of the goals."""
    request_bytes: int
    """Bytes of the sync read instruction."""
    reply_bytes: int
    """Bytes of all servos' replies."""
    return_delay_s: float
    """Sum of the return delays of all replies."""
    may_be_fast: bool = True
    """Whether the servos have fast reads."""

    @property
    def total_bytes(self) -> int:
        """Bytes on the wire in a cycle."""
        return self.write_bytes + self.request_bytes + self.reply_bytes

    @property
    def cycle_s(self) -> float:
        """Shortest possible cycle; adapters and stuffing extend it."""
        return self.total_bytes * BITS_PER_BYTE / self.baud + self.return_delay_s

    @property
    def reply_s(self) -> float:
        """Time from the end of the request to the end of the replies."""
        return self.reply_bytes * BITS_PER_BYTE / self.baud + self.return_delay_s

    @property
    def age_s(self) -> float:
        """Age of the first values at the end of the longest cycle."""
        before_bytes = self.write_bytes + GROUP_BYTES + self.servos
        return self.cycle_s - before_bytes * BITS_PER_BYTE / self.baud

    @property
    def limit_hz(self) -> float:
        """Highest rate that the wire allows."""
        return 1.0 / self.cycle_s

    def share(self, rate_hz: float) -> float:
        """Share of the time that the wire is busy at ``rate_hz``; above 1 is impossible."""
        return rate_hz * self.cycle_s

    def check(self, rate_hz: float) -> None:
        """Reject a rate above the limit.

        Raises:
            BudgetError: with the limit and a remedy.

        """
        if self.share(rate_hz) > 1.0:
            fast = ", use fast sync read" if self.may_be_fast and not self.fast else ""
            raise BudgetError(
                f"{rate_hz:g} Hz: a cycle of {self.servos} servos at {self.baud} baud occupies "
                f"the wire for {self.cycle_s * 1e3:.2f} ms, which allows at most "
                f"{self.limit_hz:.0f} Hz; lower the rate, raise the baud rate{fast}"
            )


def check_ages(
    budget: WireBudget, rate_hz: float, *, stale_limit_s: float, watchdog_s: float
) -> None:
    """Reject a cycle in which safety or the servos' watchdogs would stop each run.

    Raises:
        BudgetError: values are too old at the end of the cycle, or the pause between cycles exceeds
            the watchdog.

    """
    faults = []
    if budget.age_s > stale_limit_s:
        faults.append(
            f"{budget.servos} servos at {budget.baud} baud: positions are {budget.age_s:.2f} s old "
            f"at the end of a cycle, over safety.stale_limit_s {stale_limit_s:g}: raise the baud "
            "rate, or divide the chain into several ports"
        )
    pause_s = 1.0 / rate_hz - budget.cycle_s
    if pause_s > watchdog_s:
        faults.append(
            f"{rate_hz:g} Hz: the servos hear nothing for {pause_s:.2f} s between two cycles, over "
            f"safety.watchdog_s {watchdog_s:g}, and stop: raise run.cycle_hz or safety.watchdog_s"
        )
    if faults:
        raise BudgetError(faults)


def wire_budget(
    servos: int,
    baud: int,
    *,
    fast: bool,
    read_bytes: int = STATE_BYTES,
    goal_bytes: int = 4,
    slow_read_bytes: int = 0,
    return_delay_s: float = 0.0,
) -> WireBudget:
    """Budget of a cycle of ``servos`` servos.

    Args:
        servos: N, at least 1.
        baud: bit/s.
        fast: fast sync read (one common reply) instead of sync read (one packet each).
        read_bytes: length of the block read from each servo.
        goal_bytes: length of each goal; 0 for a cycle that only reads.
        slow_read_bytes: length of the second block in cycles that read the slow state.
        return_delay_s: register 9 of each servo, s. A fast read waits once, a sync read N times.

    """
    if servos < 1 or baud < 1:
        raise ValueError(f"a bus has at least one servo and a speed, got {servos} at {baud} baud")
    write = GROUP_BYTES + servos * (1 + goal_bytes) if goal_bytes else 0
    request = reply = delays = 0
    for length in (read_bytes, slow_read_bytes):
        if length:
            request += GROUP_BYTES + servos
            reply += _reply_bytes(servos, length, fast=fast)
            delays += 1 if fast else servos
    return WireBudget(servos, baud, fast, write, request, reply, delays * return_delay_s)


def chain_budget(servos: int, baud: int, *, fast: bool) -> WireBudget:
    """Budget of the longest cycle of a ``ServoChain``, which also compares a setting."""
    return wire_budget(servos, baud, fast=fast, slow_read_bytes=max(SLOW_STATE_BYTES, CHECK_BYTES))


def robot_budget(robot: RobotConfig, baud: int, *, fast: bool) -> WireBudget:
    """``chain_budget`` of a robot's servos and IMU; of several ports, that of the busiest."""
    imu = set() if robot.imu is None else {robot.imu.id}
    budgets = []
    for ids in [set(port.ids) for port in robot.ports] or [{*robot.servo_ids, *imu}]:
        facts = next(iter(robot.models_on(ids).values()))
        if facts.is_feetech:
            budgets.append(_feetech_budget(facts, len(ids), baud))
        else:
            budgets.append(_port_budget(len(ids - imu), baud, fast=fast, with_imu=bool(imu & ids)))
    return max(budgets, key=lambda budget: budget.cycle_s)


def _feetech_budget(facts: ServoModel, servos: int, baud: int) -> WireBudget:
    state = [facts.registers["Present Position"], facts.registers["Present Load"]]
    if facts.measures_current:
        state.append(facts.registers["Present Current"])
    block = max(row.address + row.size for row in state) - state[0].address
    goal = feetech.GROUP_BYTES + servos * (1 + facts.registers["Goal Position"].size)
    request = reply = 0
    for length in (block, max(_FEETECH_SUPPLY_BYTES, CHECK_BYTES)):
        requests, replies = feetech.wire_bytes(facts, servos, length)
        request = request + requests
        reply = reply + replies
    return WireBudget(servos, baud, False, goal, request, reply, 0.0, may_be_fast=False)


def _port_budget(servos: int, baud: int, *, fast: bool, with_imu: bool) -> WireBudget:
    budget = chain_budget(servos, baud, fast=fast)
    if not with_imu:
        return budget
    return replace(
        budget,
        request_bytes=budget.request_bytes + GROUP_BYTES + 1,
        reply_bytes=budget.reply_bytes + STATUS_BYTES + BLOCK_BYTES,
    )


def _reply_bytes(servos: int, length: int, *, fast: bool) -> int:
    if fast:
        return FAST_HEAD_BYTES + servos * (FAST_PART_BYTES + length)
    return servos * (STATUS_BYTES + length)


def plain_reads_text(
    budget: WireBudget, rate_hz: float | None, failures: int, ports: Sequence[str]
) -> str:
    """Return the report that fast reads were given up.

    ``budget`` is that of plain reads; ``ports`` gave up, empty for a single port.
    """
    line = f"fast sync reads given up after {failures} failures in a row, plain from now on"
    if ports:
        line = f"{', '.join(ports)}: {line}"
    if rate_hz is None or budget.share(rate_hz) <= 1.0:
        return line
    return (
        f"{line}: the wire carries at most {budget.limit_hz:.0f} Hz of plain reads, not "
        f"{rate_hz:g} Hz: cycles will be late"
    )
