from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.loader import load_robot
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.drivers.bus.budget import chain_budget, check_ages, robot_budget, wire_budget
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.group_read import GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.errors import BudgetError
from tests.helpers.scripted_port import ScriptedPort


@pytest.mark.parametrize(  # measured with 16 XM430
    ("baud", "fast", "cycle_ms"),
    [(1_000_000, False, 4.60), (1_000_000, True, 3.56), (4_000_000, False, 1.15),
     (4_000_000, True, 0.89)],
)  # fmt: skip
def test_the_measured_wire_limits(baud: int, fast: bool, cycle_ms: float) -> None:
    assert wire_budget(16, baud, fast=fast).cycle_s * 1e3 == pytest.approx(cycle_ms, abs=1e-9)


@given(st.integers(1, 64), st.booleans(), st.integers(1, 30))
def test_bytes_are_those_that_the_codec_sends_and_awaits(n: int, fast: bool, length: int) -> None:
    ids = range(1, n + 1)
    request = GroupReadRequest(ids, 126, length, fast=fast)
    budget = wire_budget(n, 1_000_000, fast=fast, read_bytes=length)
    assert budget.write_bytes == len(GroupWrite(ids, 116).encode(np.zeros(n, np.int32)))
    assert budget.request_bytes == len(request.packet)
    assert budget.reply_bytes == request.reply_bytes


def test_a_rate_above_the_limit_is_refused_with_the_limit() -> None:
    budget = wire_budget(16, 1_000_000, fast=False)
    budget.check(217.3)
    with pytest.raises(BudgetError, match=r"250 Hz.*4\.60 ms.*at most 217 Hz.*fast sync read"):
        budget.check(250.0)


def test_the_remedy_names_fast_reads_only_where_the_servos_have_them() -> None:
    for name, has_fast_reads in (("yaw16", True), ("sts3215-12", False)):
        with pytest.raises(BudgetError) as info:
            robot_budget(load_robot(name), 9_600, fast=False).check(50.0)
        assert ("fast sync read" in str(info.value)) is has_fast_reads


def test_return_delays_count_for_each_answer() -> None:
    plain = wire_budget(16, 1_000_000, fast=False, return_delay_s=500e-6)
    fast = wire_budget(16, 1_000_000, fast=True, return_delay_s=500e-6)
    assert plain.cycle_s == pytest.approx(4.60e-3 + 8e-3)
    assert fast.cycle_s == pytest.approx(3.56e-3 + 0.5e-3)


def test_the_slow_round_is_a_second_read_in_the_longest_cycle() -> None:
    both = wire_budget(16, 1_000_000, fast=True, slow_read_bytes=3)
    assert both.total_bytes == 356 + (14 + 16) + 8 + 16 * (4 + 3)
    assert both.share(50.0) == pytest.approx(50.0 * 5.06e-3)


@pytest.mark.parametrize("fast", [False, True])
@pytest.mark.parametrize("model", ["XM430-W350", "XL330-M288"])
def test_the_budget_of_a_chain_counts_the_blocks_that_it_reads(model: str, fast: bool) -> None:
    bus = DynamixelBus(ScriptedPort(lambda raw: []), model)
    ids = range(1, 17)
    check = bus.block(ids, "Profile Velocity", "Profile Velocity", fast=fast)
    assert check.read_bytes >= bus.slow_cycle(ids, fast=fast).read_bytes
    blocks = (bus.cycle(ids, fast=fast), check)
    replies = [cycle._default_request.reply_bytes for cycle in blocks]
    requests = [len(cycle._default_request.packet) for cycle in blocks]
    budget = chain_budget(16, 1_000_000, fast=fast)
    assert (budget.request_bytes, budget.reply_bytes) == (sum(requests), sum(replies))


def test_reading_alone_sends_no_goals() -> None:
    assert wire_budget(3, 57_600, fast=False, goal_bytes=0).write_bytes == 0
    with pytest.raises(ValueError, match="at least one servo"):
        wire_budget(0, 1_000_000, fast=True)


def test_a_cycle_whose_values_are_too_old_or_whose_pauses_are_too_long_is_rejected() -> None:
    """64 servos at 57,600 baud and 2 Hz switched torque on, and stopped in the first cycle."""
    budget = chain_budget(64, 57_600, fast=True)
    budget.check(2.0)
    with pytest.raises(BudgetError, match=r"positions are 0\.26 s old .*_limit_s 0\.1:") as old:
        check_ages(budget, 2.0, stale_limit_s=0.1, watchdog_s=0.2)
    assert len(old.value.faults) == 1
    near = chain_budget(16, 1_000_000, fast=True)
    check_ages(near, 50.0, stale_limit_s=0.1, watchdog_s=0.2)
    with pytest.raises(BudgetError, match=r"hear nothing for 0\.49 s .*watchdog_s 0\.2, and stop"):
        check_ages(near, 2.0, stale_limit_s=0.1, watchdog_s=0.2)


def test_a_gait_of_64_servos_on_a_slow_bus_is_rejected_before_torque(tmp_path: Path) -> None:
    robot = tmp_path / "long.toml"
    robot.write_text(f'name = "long"\njoint_axes = "{"y" * 64}"\n[servo]\nbaud = 57600\n')
    with pytest.raises(BudgetError, match="divide the chain into several ports"):
        prepare_gait("lateral-undulation", robot=str(robot), keys={"run.cycle_hz": 2.0})
