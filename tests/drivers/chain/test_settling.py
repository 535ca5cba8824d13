"""A limp joint may sag while a chain starts; one that does not come to rest ends the start."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

SAG_RAD = -0.4


def start(viscous_n_m_s: float) -> SimLine:
    """Start a chain; a load pulls its second joint to ``SAG_RAD`` just before torque comes on."""
    robot = RobotConfig(name="four", joint_axes="ypyp")
    bank = ServoBank(robot.servo_ids, baud=57_600)

    def load_n_m(position_rad: Floats) -> Floats:
        load = np.zeros(4)
        if bank["Bus Watchdog"].any():
            load[1] = 60.0 * (SAG_RAD - position_rad[1])
        return load

    line = SimLine(bank, BenchPlant(4, viscous_n_m_s=viscous_n_m_s, load_n_m=load_n_m))
    ServoChain(DynamixelBus(line), robot).enable()
    return line


def test_a_joint_that_sags_before_torque_holds_where_it_rests() -> None:
    """It was reported as two servos with one ID, or moved by hand."""
    line = start(3.0)
    assert line.bank["Torque Enable"].all()
    held_rad = (int(line.bank["Goal Position"][1]) - 2048) * 2 * np.pi / 4096
    assert held_rad == pytest.approx(SAG_RAD, abs=0.05)
    assert line.clock.now_s() < 1.5


def test_a_joint_that_never_rests_ends_the_start() -> None:
    with pytest.raises(ChainError, match="two servos with one ID, or moved by hand"):
        start(0.0)
