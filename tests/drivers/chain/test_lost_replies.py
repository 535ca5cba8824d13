"""Replies that get lost or arrive late are reported once, with the likely cause."""

from snakewalk.drivers.bus.control_cycle import CycleCounters
from snakewalk.drivers.chain.lost_replies import LATE_READS, LOSS_READS, LOSSES, LostReplies


def test_losses_without_late_bytes_are_noise() -> None:
    found = LostReplies()
    lines = [found.update(2 - k % 2, 2, CycleCounters()) for k in range(2 * LOSSES)]
    (line,) = [each for each in lines if each is not None]
    assert line.startswith(f"replies got lost {LOSSES} times")


def test_late_bytes_are_reported_at_the_third_read() -> None:
    found = LostReplies()
    lines = [found.update(1, 2, CycleCounters(late_bytes=20 * k)) for k in range(LATE_READS + 3)]
    assert [each is not None for each in lines] == [k == LATE_READS for k in range(LATE_READS + 3)]
    assert "after the time-out: high latency of adapter or network" in str(lines[LATE_READS])


def test_rare_late_bytes_are_not_reported() -> None:
    found = LostReplies()
    for k in range(5 * LOSS_READS):
        assert found.update(2, 2, CycleCounters(late_bytes=20 * (k // (LOSS_READS // 2)))) is None


def reports(counts: list[int], joints: int = 2) -> list[tuple[int, str]]:
    """Lines, and the reads (from 1) at which they come, for numbers of joints that were read."""
    found = LostReplies()
    lines = [found.update(count, joints, CycleCounters()) for count in counts]
    return [(k, line) for k, line in enumerate(lines, start=1) if line is not None]


def losses_at(*reads: int, upto: int = 300) -> list[int]:
    """Numbers of joints that were read, with one joint missing in some reads."""
    return [1 if k in reads else 2 for k in range(1, upto)]


def test_the_fourth_loss_is_reported_with_the_reads_since_the_first() -> None:
    ((k, line),) = reports(losses_at(1, 3, 5, 9))
    assert k == 9
    assert "got lost 4 times within 9 reads: no byte is damaged: a loose plug" in line
    ((k, line),) = reports(losses_at(11, 13, 15, 30))
    assert (k, "within 20 reads" in line) == (30, True)


def test_losses_count_within_a_window() -> None:
    ((k, line),) = reports(losses_at(1, 30, 60, LOSS_READS))
    assert (k, f"within {LOSS_READS} reads" in line) == (LOSS_READS, True)
    assert reports(losses_at(1, 30, 60, LOSS_READS + 1)) == []


def test_a_servo_that_falls_silent_is_one_loss() -> None:
    assert reports([2] * 5 + [1] * 500) == []


def test_a_silent_read_is_one_loss_and_two_in_a_row_are_a_dead_line() -> None:
    assert reports([0, 2, 2, 0, 1, 2, 2, 0, 2]) == []
    ((k, line),) = reports([2, 2, 0, 0, 0, 2, 0, 0])
    assert k == 4
    assert line.startswith("no servo was read in two reads in a row; see")
    ((k, _),) = reports([0, 0])
    assert k == 2


def test_the_first_late_byte_counts() -> None:
    found = LostReplies()
    lines = [found.update(2, 2, CycleCounters(late_bytes=k)) for k in range(1, LATE_READS + 1)]
    assert [each is not None for each in lines] == [False] * (LATE_READS - 1) + [True]


def test_damaged_bytes_are_noise_and_a_pause_of_the_computer_is_named() -> None:
    noisy = LostReplies()
    lines = [noisy.update(2 - k % 2, 2, CycleCounters(unclean=k)) for k in range(2 * LOSSES)]
    (line,) = [each for each in lines if each is not None]
    assert "bytes are damaged: noise, or a second master" in line
    busy = LostReplies()
    counters = [CycleCounters(late_bytes=9 * k, stalled_s=0.1 * k) for k in range(LATE_READS + 1)]
    lines = [busy.update(1, 2, each) for each in counters]
    assert "this computer is too busy" in str(lines[-1])
