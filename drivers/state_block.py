"""The state block of the control cycle: bytes of many servos to angle, velocity and current."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.compiling import COMPILES
from drivers.control_table import ControlTable
from drivers.errors import ControlTableError
from drivers.types import Floats
from drivers.units import ServoUnits

Bytes = NDArray[np.uint8]


class StateBlock:
    """Registers from Present Current to Present Position, all servos at once.

    In numpy, moved by two bytes, the block is three words of four bytes: the current (two bytes)
    stands in the upper half of the first, which makes it 65,536 times as large, sign and all.
    """

    def __init__(
        self, joints: int, table: ControlTable, units: ServoUnits, *, compiled: bool | None = None
    ) -> None:
        """Check the layout; ``compiled`` None takes numba where it is installed.

        Raises:
            ControlTableError: the registers do not lie as in every model of Protocol 2.0.

        """
        registers = [table[f"Present {name}"] for name in ("Current", "Velocity", "Position")]
        start = registers[0].address
        if [(r.address - start, r.size) for r in registers] != [(0, 2), (2, 4), (6, 4)]:
            raise ControlTableError(
                [f"{table.model}: Present Current, Velocity and Position do not lie in a row"]
            )
        self._zero = np.array([0.0, 0.0, float(units.zero_position)])
        self._scale = np.array(
            [units.a_per_current, units.rad_s_per_velocity, units.rad_per_position]
        )
        self._bytes = np.zeros((joints, 12), np.uint8)
        self._block = self._bytes[:, 2:]
        self._words = self._bytes.view("<i4").T
        self._word_scale = self._scale / [65_536.0, 1.0, 1.0]
        self._loop: Callable[[Bytes, Floats, Floats, Floats], None] | None = None
        if COMPILES if compiled is None else compiled:
            from drivers.state_loops import motion  # noqa: PLC0415  numba is optional

            self._loop = motion

    def motion(self, data: Bytes, out: Floats) -> None:
        """Current, A, velocity, rad/s, and position, rad, of blocks (J, 10) into ``out`` (3, J)."""
        if self._loop is not None:
            self._loop(data, self._zero, self._scale, out)
            return
        self._block[:] = data
        np.subtract(self._words, self._zero[:, None], out=out)
        out *= self._word_scale[:, None]
