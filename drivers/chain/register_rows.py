"""Values of one register in the rows of a group read; the rows of two makes may differ in size."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bytes, Ints
from snakewalk.drivers.bus.chain_bus import ChainBus


class RegisterRows:
    """Converts values of a register to rows of bytes and back.

    A shorter register is at the start of its row, and zeros fill the rest.
    """

    def __init__(self, kinds: Sequence[str]) -> None:
        """Prepare; ``kinds`` (N,) are the register's types in each row, for numpy."""
        self._kinds = tuple(np.dtype(kind) for kind in kinds)
        self._kind = self._kinds[0] if len({*self._kinds}) == 1 else None
        """Type of all rows; None if they differ."""
        self._places = {
            kind: np.array([k for k, other in enumerate(self._kinds) if other == kind], np.intp)
            for kind in dict.fromkeys(self._kinds)
        }
        self._width = max((kind.itemsize for kind in self._kinds), default=0)

    @classmethod
    def of(cls, bus: ChainBus, servo_ids: Iterable[int], name: str) -> "RegisterRows":
        """Rows of a register of some servos.

        Raises:
            ControlTableError: a model lacks it.

        """
        return cls([bus.table_of(servo_id).register(name).kind for servo_id in servo_ids])

    def encode(self, values: ArrayLike) -> bytes:
        """Rows of ``values`` (N,), as in a group read."""
        if self._kind is not None:
            return np.asarray(values).astype(self._kind, copy=False).tobytes()
        given = np.asarray(values)
        rows = np.zeros((len(self._kinds), self._width), np.uint8)
        for kind, places in self._places.items():
            part = np.ascontiguousarray(given[places].astype(kind))
            rows[places, : kind.itemsize] = part.view(np.uint8).reshape(len(places), -1)
        return rows.tobytes()

    def decode(self, data: Bytes) -> Ints:
        """(N,) values of rows (N, n)."""
        if self._kind is not None:
            column = np.ascontiguousarray(data).view(self._kind)[:, 0]
            return np.asarray(column, np.int64)
        values = np.zeros(len(self._kinds), np.int64)
        for kind, places in self._places.items():
            rows = np.ascontiguousarray(data[places, : kind.itemsize])
            values[places] = rows.view(kind)[:, 0]
        return values
