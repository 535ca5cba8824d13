"""The voltage that feeds the servos of a chain, and where some of them get another."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Indices


class Supply:
    """Supply of S servos: ``usual_v`` (one, or (S,)) until it is changed."""

    def __init__(self, servos: int, usual_v: ArrayLike) -> None:
        self.usual_v: Floats = np.full(servos, usual_v, dtype=np.float64)
        self._volts = self.usual_v.copy()
        self._override_v = np.full(servos, np.nan)
        self._overridden = False

    def change(self, volts: float | None, rows: Indices | None = None) -> None:
        """Set another voltage for the chain, or for ``rows`` alone; None: what it was before."""
        if rows is None:
            self._volts[:] = self.usual_v if volts is None else volts
            return
        self._override_v[rows] = np.nan if volts is None else volts
        self._overridden = not np.isnan(self._override_v).all()

    def feed(self, supply_v: Floats, drop_v: Floats | float = 0.0) -> None:
        """Set ``supply_v`` (S,), where the cable takes ``drop_v`` from the chain's voltage."""
        supply_v[:] = self._volts - drop_v
        if self._overridden:
            own = ~np.isnan(self._override_v)
            supply_v[own] = self._override_v[own]
