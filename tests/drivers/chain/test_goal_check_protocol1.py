"""Goals are read back on Protocol 1.0, too: one read for each AX-12A."""

import tomllib

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked
from snakewalk.config.servo_catalogue import servo_model
from snakewalk.drivers.bus.protocol1_block import Protocol1Block
from snakewalk.drivers.chain.goal_check import FOREIGN_READS, OWN_READS, GoalCheck
from snakewalk.drivers.chain.register_rows import RegisterRows
from snakewalk.drivers.errors import BusError
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import Ax12Line
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.servo.bench import BenchPlant

IDS = (1, 2, 3, 4)
PERIOD_S = 0.02


class Rig:
    """Four AX-12A that swing; goals are read back after each write."""

    def __init__(self, faults: str = "", model: str = "AX-12A") -> None:
        facts = servo_model(model)
        servos = Ax12Servos(IDS, BenchPlant(len(IDS)), facts=facts)
        self.line = Ax12Line(servos, usb_latency_s=1e-3)
        servos["Return Delay Time"][:] = 0
        FaultPlayer(self.line, checked(FaultPlan, tomllib.loads(faults), "test"))
        self.block = Protocol1Block(self.line, IDS, facts.registers["Goal Position"])
        self.check = GoalCheck(
            [f"servo {each}" for each in IDS], self.block, RegisterRows(["<u2"] * len(IDS))
        )

    def swing(self, cycles: int) -> int:
        """Cycles until the check raises, or ``cycles``."""
        clock = self.line.clock
        for k in range(cycles):
            goals = np.rint(512 + 60 * np.sin(0.2 * k + np.arange(4))).astype(np.int32)
            self.block.write_goals(goals)
            self.check.note_write(goals)
            clock.advance(PERIOD_S / 2)
            self.check.check(lambda joint: None)
            clock.advance(PERIOD_S / 2)
        return cycles


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("model", ["AX-12A", "AX-18A"])
def test_a_sound_bus_gives_no_alarm(model: str) -> None:
    rig = Rig(model=model)
    assert rig.swing(100) == 100
    assert rig.line.servos["Goal Position"].tolist() != [512] * 4


def test_a_second_master_is_named_after_two_reads() -> None:
    rig = Rig(
        '[[fault]]\nkind = "write"\nids = [2, 3]\nregister = "Goal Position"\n'
        "value = 700\nat_s = 0.5\nevery_s = 0.004\n"
    )
    with pytest.raises(BusError, match=r"servo 2, servo 3: Goal Position is 700, .*second master"):
        rig.swing(100)
    assert rig.line.clock.now_s() < 0.5 + (FOREIGN_READS + 1) * 1.3 * PERIOD_S


def test_a_servo_that_ignores_sync_writes_is_named() -> None:
    rig = Rig('[[fault]]\nkind = "deaf"\nids = [4]\nat_s = 0.5\n')
    with pytest.raises(BusError, match=r"^servo 4: Goal Position is \d+, .*ignores sync writes"):
        rig.swing(100)
    assert rig.line.clock.now_s() < 0.5 + (OWN_READS + 1) * 1.3 * PERIOD_S


@pytest.mark.slow_cases(2, "5 cases of 1.0 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("kind", ["drop", "corrupt", "truncate", "delay", "late", "duplicate"])
def test_a_bad_line_gives_no_alarm(kind: str) -> None:
    """A reply that is lost, damaged or late is no goal, and not that of the next request."""
    by_s = "by_s = 0.004\n" if kind in ("delay", "late") else ""
    rig = Rig(f'[[fault]]\nkind = "{kind}"\nchance = 0.1\n{by_s}')
    assert rig.swing(200) == 200


def test_a_silent_servo_is_not_judged() -> None:
    rig = Rig('[[fault]]\nkind = "mute"\nids = [1]\n[[fault]]\nkind = "deaf"\nids = [1]\n')
    assert rig.swing(40) == 40
    assert rig.check.is_due
