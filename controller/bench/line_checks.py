"""What comes over the line: who else talks, how late replies are, how many get lost."""

from collections.abc import Sequence

import numpy as np

from snakewalk.controller.console.finding import Finding, shown_ids
from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.probe import Overheard, Probe
from snakewalk.drivers.port.byte_port import BytePort

OVERHEAR_S = 0.6
"""How long the doctor listens before it says a word (ours): any other master talks by then."""
PATIENCE_S = 0.1
"""How late a group read may be (ours): a computer that is busy is no bad line."""
_TEST_READS = 200
_BAD_SHARE = 0.05
"""Share of the requests that a line may fail before it is a fault (ours)."""
_CABLES = "cables, plugs, termination, a common ground; a lower baud rate"
_LATE_S = 3e-3
"""A reply that is later than the wire and the servo make it is held up by adapter or driver."""
_STRAY_REPLIES = 3
"""So many replies to somebody else show another master: one may be a late one to ourselves."""


def second_master(overheard: Overheard) -> Finding:
    """Another program or adapter that talks on the same line."""
    check = "second master"
    if overheard.instructions or overheard.replies >= _STRAY_REPLIES:
        return Finding(
            check,
            "fail",
            f"{overheard.instructions} instructions and {overheard.replies} replies of others in "
            f"{OVERHEAR_S:g} s: another program or adapter talks to these servos",
            "end it, or unplug the other adapter: two masters destroy each other's packets",
        )
    if overheard.noise_bytes:
        return Finding(
            check,
            "warn",
            f"none; but {overheard.noise_bytes} bytes came that nobody asked for",
            "a floating data line: termination, pull-ups, ground; or another baud rate's traffic",
        )
    return Finding(check, "ok", f"nobody else talks within {OVERHEAR_S:g} s")


def noise(pings: Sequence[Probe], reads: Sequence[Probe], overheard: Overheard) -> Finding | None:
    """Damage that no single servo is the cause of; None: there is none, or one ID has it all.

    Two servos with one ID damage their own replies: either all of a kind, or, where they differ by
    little, some. Noise spares nobody, and hits now this reply, now that. So it is noise if bytes
    came that nobody had asked for, if two IDs or more have some replies whole and others damaged,
    or if all of several IDs have nothing but damage.

    Args:
        pings: of the robot's IDs.
        reads: of those that answer.
        overheard: what came before anybody was asked.

    """
    probes = [*pings, *reads]
    damaged = {p.servo_id for p in probes if p.damaged}
    if not damaged:
        return None
    sometimes = {p.servo_id for p in probes if 0 < p.damaged < p.requests}
    present = {p.servo_id for p in probes if p.damaged or p.answered}
    everybody = len(present) > 1 and damaged == present
    if not (overheard.noise_bytes or len(sometimes) > 1 or everybody):
        return None
    bad = sum(p.damaged for p in probes)
    asked = sum(p.requests for p in probes if p.servo_id in present)
    return Finding(
        "noise",
        "fail" if bad > _BAD_SHARE * asked else "warn",
        f"damaged bytes after {bad} of {asked} requests, of {shown_ids(sorted(damaged))}: noise on "
        "the line",
        _CABLES + "; then run it again: noise may hide other faults",
    )


def response(late_s: list[float], latency_s: float) -> list[Finding]:
    """How much later than the wire allows replies come; None without replies.

    The lower quartile is judged: an adapter holds every reply up, a busy computer some.
    """
    if not late_s:
        return []
    usual_ms = float(np.quantile(late_s, 0.25)) * 1e3
    found = f"replies come {usual_ms:.1f} ms later than the wire needs"
    if usual_ms * 1e-3 <= max(_LATE_S, latency_s / 2.0):
        return [Finding("response time", "ok", found)]
    found += ": each cycle of a run takes that much longer"
    remedy = (
        "the adapter's latency timer, a USB hub, a serial server in between; or a busy computer"
    )
    return [Finding("response time", "warn", found, remedy)]


def line_quality(port: BytePort, cycle: ControlCycle, latency_s: float) -> Finding:
    """Damaged or missing answers in many group reads, as a run does them.

    Args:
        port: the line.
        cycle: waits ``PATIENCE_S``.
        latency_s: beyond it a run takes a reply for lost.

    """
    reads, lost, longest_s = 0, 0, 0.0
    while reads < _TEST_READS and lost <= _BAD_SHARE * _TEST_READS:  # a bad line takes its time
        began_s = port.clock.now_s()
        complete = bool(cycle.read().valid.all())
        reads += 1
        lost += not complete
        if complete:
            longest_s = max(longest_s, port.clock.now_s() - began_s)
    found = f"{lost} of {reads} group reads incomplete"
    if lost > _BAD_SHARE * _TEST_READS:
        return Finding("line", "fail", found, _CABLES)
    if lost:
        return Finding("line", "warn", found, _CABLES)
    if longest_s > 2.0 * latency_s:
        found += f"; the longest took {longest_s * 1e3:.0f} ms"
    return Finding("line", "ok", found)
