"""Indirect Address and Indirect Data: bytes of the RAM area gathered where one block reads them.

An Indirect Data byte *is* the byte that its Indirect Address points at: it reads and writes as that
one does, with its access and range. (e-manual, Indirect Address, Indirect Data.)
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bytes
from snakewalk.sim.servo.register_rules import IndirectBlock


class Indirect:
    """The indirect registers in the control tables ``table`` (S, bytes) of all servos."""

    def __init__(self, table: Bytes, blocks: Sequence[IndirectBlock]) -> None:
        self._table = table
        self._blocks = tuple(blocks)
        self.used = False
        """Whether any Indirect Data byte stands for another than itself."""

    def look(self) -> None:
        """Take note of whether any byte points anywhere but at itself."""
        self.used = any(
            bool((self._targets(block) != np.arange(block.data, block.data + block.count)).any())
            for block in self._blocks
        )

    def written(self, address: int, length: int) -> None:
        """Look again after a write that may have touched an Indirect Address."""
        if any(
            address < block.addresses + 2 * block.count and block.addresses < address + length
            for block in self._blocks
        ):
            self.look()

    def shown(self, address: int, length: int) -> bool:
        """Whether a read of this block has to ``gather`` before."""
        return self.used and any(
            address < block.data + block.count and block.data < address + length
            for block in self._blocks
        )

    def gather(self) -> None:
        """Copy to every Indirect Data byte what it stands for, all servos at once."""
        for block in self._blocks:
            values = np.take_along_axis(self._table, self._targets(block), axis=1)
            self._table[:, block.data : block.data + block.count] = values

    def runs(self, row: int, address: int, data: bytes) -> list[tuple[int, bytes]]:
        """A write as (address, bytes) where it really goes, consecutive bytes together."""
        if not self.shown(address, len(data)):
            return [(address, data)]
        runs: list[tuple[int, bytearray]] = []
        for at, byte in enumerate(data, address):
            target = self._target(row, at)
            if runs and target == runs[-1][0] + len(runs[-1][1]):
                runs[-1][1].append(byte)
            else:
                runs.append((target, bytearray((byte,))))
        return [(at, bytes(run)) for at, run in runs]

    def _target(self, row: int, address: int) -> int:
        for block in self._blocks:
            if block.data <= address < block.data + block.count:
                return int(self._targets(block)[row, address - block.data])
        return address

    def _targets(self, block: IndirectBlock) -> NDArray[np.intp]:
        raw = self._table[:, block.addresses : block.addresses + 2 * block.count]
        return raw.copy().view("<u2").astype(np.intp)
