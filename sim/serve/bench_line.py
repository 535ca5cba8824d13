"""Servos of a chain, as named on a command line, on a bench behind one line."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.errors import InputError
from snakewalk.config.robot import ImuConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import BAUD_CLOCK, Ax12Line
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.plant import LinkMotion
from snakewalk.sim.serve.chain_spec import ChainSpec
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.motor import measured_gearbox


def bench_line(
    chain: ChainSpec,
    baud: int = 1_000_000,
    start_rad: ArrayLike = 0.0,
    imu: ImuConfig | None = None,
) -> SimLine | Ax12Line:
    """Line of ``baud`` with the servos of ``chain``; shafts start at ``start_rad``, of all or each.

    An ``imu`` lies level and still on the bench with them.

    Raises:
        InputError: a model is not known or lacks the baud rate, two devices share an ID, or devices
            of the two protocols are on one bus.

    """
    if imu is not None and imu.id in chain.ids:
        raise InputError(f"--imu {imu.id}: a servo has this ID")
    models = chain.records()
    old = [facts for facts in models if facts.protocol == 1]
    if old:
        if imu is not None:
            raise InputError(
                f"{old[0].model} speaks Protocol 1.0 and {imu.model} 2.0: not on one bus"
            )
        return _ax12_line(chain.ids, models, baud, start_rad)
    bank = ServoBank(chain.ids, models, baud)
    gears = [measured_gearbox(facts) for facts in models]
    plant = BenchPlant(len(bank), gear=gears, start_rad=start_rad)
    device = None
    if imu is not None:
        device = Imu(imu, lambda: LinkMotion(plant.time_s, np.zeros(3), np.eye(3)), baud)
    return SimLine(bank, plant, baud=baud, imu=device)


def _ax12_line(
    ids: tuple[int, ...], models: Sequence[ServoModel], baud: int, start_rad: ArrayLike
) -> Ax12Line:
    facts = models[0]
    others = sorted({each.model for each in models if each != facts})
    if any(each.protocol != 1 for each in models):
        old, new = (
            [each.model for each in models if (each.protocol == 1) == is_old]
            for is_old in (True, False)
        )
        raise InputError(
            f"{old[0]} speaks Protocol 1.0 and {', '.join(dict.fromkeys(new))} Protocol 2.0: not "
            "on one bus"
        )
    if others:
        raise InputError(
            f"{facts.model} and {', '.join(others)}: one model of Protocol 1.0 on a simulated bus"
        )
    if not BAUD_CLOCK / 255 <= baud <= BAUD_CLOCK / 2:
        raise InputError(f"{baud} baud: an {facts.model} has 7843 to 1000000")
    plant = BenchPlant(len(ids), start_rad=start_rad)
    servos = Ax12Servos(ids, plant, facts=facts)
    servos["Baud Rate"][:] = round(BAUD_CLOCK / baud) - 1
    return Ax12Line(servos, baud=baud)
