"""Limits of the chain's load: the supply's fuse, and the motors' windings."""

import math

import numpy as np

from snakewalk.drivers.safety.chain_load import ChainLoad
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.types import JointState


class LoadLimits:
    """Compares the load with its limits; ``update`` with every state."""

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self.load = None if limits.motor is None else ChainLoad(limits.motor)
        """Estimates of the chain's load; None without records of the motors."""
        self._over_since_s = math.nan

    def update(self, state: JointState) -> str | None:
        """Evaluate a state; return a reason to stop, or None."""
        load = self.load
        limits = self._limits
        if load is None:
            return None
        load.update(state)
        if not load.current_a > limits.fuse_a:
            self._over_since_s = math.nan
        elif math.isnan(self._over_since_s):
            self._over_since_s = state.time_s
        over_s = state.time_s - self._over_since_s
        if over_s >= limits.current_time_s:
            return (
                f"the chain draws about {load.current_a:.1f} A for {over_s:.2f} s, more than its "
                f"fuse of {limits.fuse_a:g} A (power.fuse_a of the robot)"
            )
        if load.hottest_c > limits.winding_limit_c:
            winding_c = load.winding_c(state)
            joint = int(np.argmax(winding_c > limits.winding_limit_c))
            return (
                f"{limits.joint_names[joint]}: winding at about {winding_c[joint]:.0f} C, over "
                f"{limits.winding_limit_c:g} C (safety.winding_limit_c): its housing is at "
                f"{state.temperature_c[joint]:.0f} C"
            )
        return None
