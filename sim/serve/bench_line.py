"""Servos of a chain specification, on a bench behind one line."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.errors import InputError
from snakewalk.config.robot import ImuConfig
from snakewalk.config.servo_model import ServoModel, protocol_name
from snakewalk.drivers.protocol.registers import baud_code
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import BAUD_CLOCK, Ax12Line
from snakewalk.sim.feetech.line import FeetechLine
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.clock import SimClock
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
) -> SimLine | Ax12Line | FeetechLine:
    """Line of ``baud`` with the servos of ``chain``; ``start_rad`` of all shafts, or of each.

    An ``imu`` lies level and still on the bench.

    Raises:
        InputError: a model is unknown or lacks the baud rate, two devices share an ID, or devices
            of two protocols are on one bus.

    """
    if imu is not None and imu.id in chain.ids:
        raise InputError(f"--imu {imu.id}: a servo has this ID")
    models = chain.records()
    others = [facts for facts in models if facts.protocol != 2]
    if others:
        first = others[0]
        if imu is not None:
            raise InputError(
                f"{first.model} speaks {protocol_name(first)} and {imu.model} Protocol 2.0: not on "
                "one bus"
            )
        _check_one_model(models)
        plant = BenchPlant(
            len(chain.ids), gear=[measured_gearbox(model) for model in models], start_rad=start_rad
        )
        if first.protocol == 1:
            return _ax12_line(chain.ids, first, baud, plant)
        return feetech_line(FeetechServos(chain.ids, plant, first), baud)
    bank = ServoBank(chain.ids, models, baud)
    gears = [measured_gearbox(facts) for facts in models]
    plant = BenchPlant(len(bank), gear=gears, start_rad=start_rad)
    device = None
    if imu is not None:
        device = Imu(imu, lambda: LinkMotion(plant.time_s, np.zeros(3), np.eye(3)), baud)
    return SimLine(bank, plant, imu=device)


def _check_one_model(models: Sequence[ServoModel]) -> None:
    """Reject servos of two protocols, or of two models without group packets of Protocol 2.0.

    Raises:
        InputError: with the models.

    """
    by_protocol = {facts.protocol: facts for facts in models}
    if len(by_protocol) > 1:
        first, *others = by_protocol.values()
        shown = ", ".join(f"{other.model} {protocol_name(other)}" for other in others)
        raise InputError(f"{first.model} speaks {protocol_name(first)} and {shown}: not on one bus")
    names = sorted({facts.model for facts in models})
    if len(names) > 1:
        raise InputError(
            f"{' and '.join(names)}: one model of {protocol_name(models[0])} on a simulated bus"
        )


def _ax12_line(ids: tuple[int, ...], facts: ServoModel, baud: int, plant: BenchPlant) -> Ax12Line:
    if not BAUD_CLOCK / 255 <= baud <= BAUD_CLOCK / 2:
        raise InputError(f"{baud} baud: an {facts.model} has 7843 to 1000000")
    servos = Ax12Servos(ids, plant, facts=facts)
    servos["Baud Rate"][:] = round(BAUD_CLOCK / baud) - 1
    return Ax12Line(servos, baud=baud)


def feetech_line(servos: FeetechServos, baud: int, clock: SimClock | None = None) -> FeetechLine:
    """Line of ``baud`` with Feetech servos at that rate; ``clock`` None: its own.

    Raises:
        ControlTableError: the model lacks the rate.

    """
    code = baud_code(servos.facts, baud)
    for row in range(len(servos)):
        servos["Baud Rate"][row] = code
        servos.registers.store(row, "Baud Rate")
    return FeetechLine(servos, clock, baud)
