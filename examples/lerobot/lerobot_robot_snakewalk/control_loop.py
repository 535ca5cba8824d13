"""The control loop of the servos: a thread that holds the last goal while LeRobot does other work.

LeRobot pauses between frames and between episodes, for seconds while it encodes a video. The
servos' bus watchdog and the safety layer expect a command in each cycle.
"""

import math
import threading
from types import TracebackType

import numpy as np

import snakewalk as sw

_JOIN_S = 5.0
"""Longest wait for the last cycle."""


class ControlLoop:
    """Reads and commands a chain at a fixed rate through ``SafeLink``; a context manager.

    The clock of the chain has to be wall time, because LeRobot schedules by wall time.
    """

    def __init__(self, chain: sw.ServoChain, limits: sw.SafetyLimits, rate_hz: float) -> None:
        self._link = sw.SafeLink(chain, limits, chain.clock)
        self._clock, self._period_s = chain.clock, 1.0 / rate_hz
        self._changed = threading.Condition()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="snakewalk", daemon=True)
        self._error: BaseException | None = None

    def __enter__(self) -> "ControlLoop":
        """Switch torque on and hold the measured position.

        Raises:
            DriverError: the servos do not reply, or the state is a reason to latch.

        """
        self._link.__enter__()
        try:
            self._state = self._link.enable()
        except BaseException as error:
            self._link.__exit__(type(error), error, error.__traceback__)
            raise
        self._goal_rad = self._sent_rad = np.array(self._state.position_rad)
        self._cycles = 0
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the loop and switch torque off.

        Raises:
            DriverError: torque off is not confirmed.

        """
        self._stop.set()
        self._thread.join(_JOIN_S)
        self._link.__exit__(kind, error, trace)

    @property
    def is_running(self) -> bool:
        """Whether torque is on and the loop runs."""
        return self._thread.is_alive()

    def state(self) -> sw.JointState:
        """Return the newest state.

        Raises:
            SafetyTrippedError: the safety layer has latched; torque is off.

        """
        with self._changed:
            self._raise_error()
            return self._state

    def command(self, goal_rad: np.ndarray) -> np.ndarray:
        """Replace the goal, wait for the next cycle, and return the goal that it sent.

        Raises:
            SafetyTrippedError: the safety layer has latched; torque is off.

        """
        with self._changed:
            self._goal_rad = np.array(goal_rad, float)
            # the running cycle may have read the old goal already: the one after it has the new
            cycle = self._cycles + 2
            self._changed.wait_for(lambda: self._cycles >= cycle or self._error is not None)
            self._raise_error()
            return self._sent_rad

    def _raise_error(self) -> None:
        if self._error is not None:
            raise sw.SafetyTrippedError(str(self._error)) from self._error

    def _run(self) -> None:
        try:
            for _ in sw.ticks(self._clock, self._period_s, self._until_s):
                state = self._link.read()
                with self._changed:
                    goal_rad = self._goal_rad
                self._link.write(sw.JointCommand(self._clock.now_s(), goal_rad))
                with self._changed:
                    self._state, self._sent_rad = state, self._link.last_verdict.goal_rad
                    self._cycles += 1
                    self._changed.notify_all()
        except Exception as error:  # whatever it is, LeRobot's thread has to raise it
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _until_s(self) -> float:
        return -math.inf if self._stop.is_set() else math.inf
