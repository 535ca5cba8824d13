"""The voltage that feeds a run of servos, and where some of them get another."""

import numpy as np

from snakewalk.config.arrays import Floats, Indices


class Supply:
    """Supply of S servos, ``usual_v`` until it is changed."""

    def __init__(self, servos: int, usual_v: float) -> None:
        self._usual_v = usual_v
        self.volts = usual_v
        """Of the run, before the cable."""
        self._own_v = np.full(servos, np.nan)
        self.apart = False
        """Whether some servos have a voltage of their own."""

    def change(self, volts: float | None, rows: Indices | None = None) -> None:
        """Another voltage for the run, or for ``rows`` alone; None: what it was before."""
        if rows is None:
            self.volts = self._usual_v if volts is None else volts
            return
        self._own_v[rows] = np.nan if volts is None else volts
        self.apart = not np.isnan(self._own_v).all()

    def feed(self, supply_v: Floats, drop_v: float = 0.0) -> None:
        """Set ``supply_v`` (S,), where the cable takes ``drop_v`` from the run's voltage."""
        supply_v[:] = self.volts - drop_v
        if self.apart:
            own = ~np.isnan(self._own_v)
            supply_v[own] = self._own_v[own]
