"""Indirect Address and Indirect Data: bytes of the RAM area gathered for one block.

An Indirect Data byte reads and writes the byte at its Indirect Address, with its access and range.
(e-manual, Indirect Address, Indirect Data.)
"""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Bytes, Indices
from snakewalk.sim.servo.register_rules import IndirectBlock


class Indirect:
    """The indirect registers in the control tables ``table`` (S, bytes).

    ``blocks`` are those of each model with the rows of its servos.
    """

    def __init__(
        self, table: Bytes, blocks: Sequence[tuple[Indices | slice, Sequence[IndirectBlock]]]
    ) -> None:
        self._table = table
        self._blocks = tuple((rows, block) for rows, of_model in blocks for block in of_model)
        self.used = False
        """Whether any Indirect Data byte stands for another than itself."""

    def refresh(self) -> None:
        """Update whether any byte points elsewhere than at itself."""
        self.used = any(
            bool((self._targets(rows, b) != np.arange(b.data, b.data + b.count)).any())
            for rows, b in self._blocks
        )

    def on_write(self, address: int, length: int) -> None:
        """Refresh after a write to an Indirect Address."""
        if any(
            address < block.addresses + 2 * block.count and block.addresses < address + length
            for _, block in self._blocks
        ):
            self.refresh()

    def covers(self, address: int, length: int) -> bool:
        """Whether a read of this block must ``gather`` first."""
        return self.used and any(
            address < block.data + block.count and block.data < address + length
            for _, block in self._blocks
        )

    def gather(self) -> None:
        """Copy its target to every Indirect Data byte."""
        for rows, block in self._blocks:
            values = np.take_along_axis(self._table[rows], self._targets(rows, block), axis=1)
            self._table[rows, block.data : block.data + block.count] = values

    def resolve(
        self, row: int, address: int, data: bytes, blocks: Sequence[IndirectBlock]
    ) -> list[tuple[int, bytes]]:
        """Split a write into (address, bytes) of its targets, consecutive bytes together.

        ``blocks`` are those of the servo's model.
        """
        if not self.covers(address, len(data)):
            return [(address, data)]
        runs: list[tuple[int, bytearray]] = []
        for byte_address, byte in enumerate(data, address):
            target = self._target(row, byte_address, blocks)
            if runs and target == runs[-1][0] + len(runs[-1][1]):
                runs[-1][1].append(byte)
            else:
                runs.append((target, bytearray((byte,))))
        return [(start, bytes(run)) for start, run in runs]

    def _target(self, row: int, address: int, blocks: Sequence[IndirectBlock]) -> int:
        for block in blocks:
            if block.data <= address < block.data + block.count:
                return int(self._targets(slice(row, row + 1), block)[0, address - block.data])
        return address

    def _targets(self, rows: Indices | slice, block: IndirectBlock) -> Indices:
        raw = self._table[rows, block.addresses : block.addresses + 2 * block.count]
        return raw.copy().view("<u2").astype(np.intp)
