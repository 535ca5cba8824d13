"""Servos of a chain, as named on a command line, on a bench behind one line."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.errors import InputError
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.line import BAUD_CLOCK, Ax12Line
from snakewalk.sim.ax12.table import MODEL
from snakewalk.sim.line.mixed_line import MixedLine
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.chain_spec import ChainSpec
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant
from snakewalk.sim.servo.gearbox import GEARBOXES
from snakewalk.sim.servo.mixed_bank import MixedBank


def bench_line(
    chain: ChainSpec, baud: int = 1_000_000, start_rad: ArrayLike = 0.0
) -> SimLine | Ax12Line:
    """Line of ``baud`` with the servos of ``chain``; shafts start at ``start_rad``, of all or each.

    Raises:
        InputError: a model is not known or lacks the baud rate, two servos share an ID, or servos
            of the two protocols are on one bus.

    """
    if MODEL in chain.models:
        return _ax12_line(chain, baud, start_rad)
    if len(chain.kinds) == 1:
        bank = ServoBank(chain.ids, chain.model, baud)
        gear = GEARBOXES.get(bank.model)
        return SimLine(bank, BenchPlant(len(bank), gear=gear, start_rad=start_rad), baud=baud)
    mixed = MixedBank(chain.ids, chain.models, baud)
    starts_rad = np.split(np.broadcast_to(start_rad, len(mixed)), mixed.starts[1:])
    benches = [
        BenchPlant(len(part), gear=GEARBOXES.get(part.model), start_rad=begin_rad)
        for part, begin_rad in zip(mixed.parts, starts_rad, strict=True)
    ]
    return MixedLine(mixed, benches, baud=baud)


def _ax12_line(chain: ChainSpec, baud: int, start_rad: ArrayLike) -> Ax12Line:
    others = [model for model in chain.kinds if model != MODEL]
    if others:
        raise InputError(
            f"{MODEL} speaks Protocol 1.0 and {', '.join(others)} Protocol 2.0: not on one bus"
        )
    if not BAUD_CLOCK / 255 <= baud <= BAUD_CLOCK / 2:
        raise InputError(f"{baud} baud: an {MODEL} has 7843 to 1000000")
    servos = Ax12Servos(chain.ids, BenchPlant(len(chain.ids), start_rad=start_rad))
    servos["Baud Rate"][:] = round(BAUD_CLOCK / baud) - 1
    return Ax12Line(servos, baud=baud)
