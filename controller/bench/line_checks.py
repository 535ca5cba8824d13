"""Findings on the line: other masters, late replies, lost replies."""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from snakewalk.controller.console.finding import Finding, Grade, shown_ids
from snakewalk.drivers.bus.control_cycle import FAST_FAILURES, ControlCycle
from snakewalk.drivers.bus.probe import Overheard, Probe
from snakewalk.drivers.port.byte_port import BytePort

OVERHEAR_S = 0.6
"""Time for which the doctor listens before its first request (ours): any other master talks by
then."""
PATIENCE_S = 0.1
"""Largest delay of a group read (ours): a busy computer does not make a bad line."""
_TEST_READS = 200
_BAD_SHARE = 0.05
"""Share of the requests that a line may fail before it is a fault (ours)."""
_CABLES = "cables, plugs, termination, a common ground; a lower baud rate"
_NO_FAST_READS = (
    "a run uses plain reads, which are slower; update the firmware of the servos, or use an "
    "adapter that passes long replies"
)
_NO_GROUP_READS = (
    "update the firmware of the servos, or use an adapter that passes long replies: a run needs "
    "group reads"
)
_LATE_REPLY_S = 3e-3
"""A reply that is later than the wire and the servo make it is held up by adapter or driver."""
_DIFFERENCE_S = 2e-3
"""Difference between servos beyond any return delay, which is 0.508 ms at most (ours)."""
_LEAST_COMPARED = 3
"""Servos that a comparison needs (ours)."""
_LOST = 2
"""Lost replies of one servo beyond chance (ours)."""
_STRAY_REPLIES = 3
"""Number of foreign replies that show another master; a single one may be a late reply."""


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
            f"none; but {overheard.noise_bytes} bytes came without a request",
            "a floating data line: termination, pull-ups, ground; or another baud rate's traffic",
        )
    return Finding(check, "ok", f"no other packets within {OVERHEAR_S:g} s")


def noise(pings: Sequence[Probe], reads: Sequence[Probe], overheard: Overheard) -> Finding | None:
    """Damage that does not come from a single servo; None if one ID has all or nothing is damaged.

    Two servos with one ID damage only their own replies: all, or some of them. So it is noise if
    unrequested bytes arrived, if two IDs or more have complete and damaged replies, or if all of
    several IDs have only damaged ones.

    Args:
        pings: of the robot's IDs.
        reads: of those that answer.
        overheard: traffic on the line before the first request.

    """
    probes = [*pings, *reads]
    damaged = {p.servo_id for p in probes if p.damaged}
    if not damaged:
        return None
    damaged_ids = {p.servo_id for p in probes if 0 < p.damaged < p.requests}
    present = {p.servo_id for p in probes if p.damaged or p.answered}
    are_all_damaged = len(present) > 1 and damaged == present
    if not (overheard.noise_bytes or len(damaged_ids) > 1 or are_all_damaged):
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


def response(
    pings: Sequence[Probe], reads: Sequence[Probe], latency_s: float, *, noisy: bool
) -> list[Finding]:
    """Delay of the replies beyond the wire time, and the slower servos; nothing without replies.

    The lower quartile is judged: an adapter holds every reply up, a busy computer some.
    """
    late_s = [late for ping in pings for late in ping.late_s]
    if not late_s:
        return []
    slow = None if noisy else _slow_servos((*pings, *reads))
    return [_usual_response(late_s, latency_s), *([] if slow is None else [slow])]


def _usual_response(late_s: Sequence[float], latency_s: float) -> Finding:
    usual_ms = float(np.quantile(late_s, 0.25)) * 1e3
    response_text = f"replies come {usual_ms:.1f} ms later than the wire needs"
    if usual_ms * 1e-3 > latency_s:
        response_text += f", the driver waits {latency_s * 1e3:.0f} ms: a run loses all of them"
        remedy = "lower the adapter's latency timer to 1 ms, or connect it without a hub or server"
        return Finding("response time", "fail", response_text, remedy)
    if usual_ms * 1e-3 <= max(_LATE_REPLY_S, latency_s / 2.0):
        return Finding("response time", "ok", response_text)
    response_text += ": each cycle of a run is longer by that time"
    remedy = "set the adapter's latency timer to 1 ms; else a USB hub, a server or a busy computer"
    return Finding("response time", "warn", response_text, remedy)


def _slow_servos(probes: Sequence[Probe]) -> Finding | None:
    """Servos each of whose replies is later than those of the others."""
    least_s: dict[int, float] = {}
    for probe in probes:
        if probe.late_s:
            late_s = min(probe.late_s)
            least_s[probe.servo_id] = min(late_s, least_s.get(probe.servo_id, late_s))
    if len(least_s) < _LEAST_COMPARED:
        return None
    usual_s = float(np.median(list(least_s.values())))
    slow = {
        i: late_s - usual_s for i, late_s in least_s.items() if late_s - usual_s > _DIFFERENCE_S
    }
    if not slow:
        return None
    names = ", ".join(f"servo {i} by {late_s * 1e3:.1f} ms" for i, late_s in slow.items())
    remedy = "update its firmware or exchange it: each cycle of a run is longer by that time"
    return Finding("response time", "warn", f"slower than the others: {names}", remedy)


def _losing_servos(probes: Sequence[Probe]) -> str:
    """Text that names the few servos whose replies get lost; empty if none or many lose some."""
    lost: Counter[int] = Counter()
    for probe in probes:
        lost[probe.servo_id] += probe.requests - probe.answered
    lossy = [servo_id for servo_id, count in lost.items() if count >= _LOST]
    few = 0 < len(lossy) <= max(1, len(lost) // 4)
    return f"; replies of {shown_ids(lossy)} get lost: its plug, or the servo" if few else ""


def line_quality(
    port: BytePort,
    cycle: ControlCycle,
    latency_s: float,
    ask_each: Callable[[], Sequence[Probe]],
) -> Finding:
    """Damaged or missing answers in many group reads, as a run does them.

    Args:
        port: the line.
        cycle: waits ``PATIENCE_S``.
        latency_s: a run treats a reply that is later than this as lost.
        ask_each: asks each servo by itself, to see whose replies get lost.

    """
    reads = 0
    lost = 0
    longest_s = 0.0
    while reads < _TEST_READS and lost <= _BAD_SHARE * _TEST_READS:  # a bad line needs time
        began_s = port.clock.now_s()
        complete = bool(cycle.read().valid.all())
        reads += 1
        lost += not complete
        if complete:
            longest_s = max(longest_s, port.clock.now_s() - began_s)
    reads_text = f"{lost} of {reads} group reads incomplete"
    if cycle.counters.fast_given_up and lost == FAST_FAILURES:
        reads_text += ": all fast ones, but no plain one"
        return Finding("line", "warn", reads_text, _NO_FAST_READS)
    if lost:
        alone = ask_each()
        if lost == reads and all(
            reply_counts.answered == reply_counts.requests for reply_counts in alone
        ):
            reads_text += ", though each servo replies by itself"
            return Finding("line", "fail", reads_text, _NO_GROUP_READS)
        reads_text += _losing_servos(alone)
        grade: Grade = "fail" if lost > _BAD_SHARE * _TEST_READS else "warn"
        return Finding("line", grade, reads_text, _CABLES)
    if longest_s > 2.0 * latency_s:
        reads_text += f"; the longest took {longest_s * 1e3:.0f} ms"
    return Finding("line", "ok", reads_text)
