"""A rehearsal in one process: client and served robot in simulated time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.pose.sample import ArrivedPose
from snakewalk.controller.pose.udp_feed import decoded
from snakewalk.controller.run.backend import Backend
from snakewalk.controller.run.external.served_robot import ServedRobot
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain

SENDER: Final = "127.0.0.1:40000"
"""Address that the simulated tracker has in messages."""


@dataclass(frozen=True, slots=True)
class SimulatedDatagrams:
    """The datagrams of a served robot's tracker; a ``PoseFeed``."""

    served: ServedRobot

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses that have arrived since the last call."""
        self.served.line.settle()
        due = self.served.tracker.due(now_s)
        return [decoded(sent.data, SENDER, sent.due_s) for sent in due]


@dataclass(frozen=True, slots=True)
class SimulatedPort:
    """A served robot as a port of a request; a ``RehearsedPort``."""

    served: ServedRobot
    name: str = "rehearsal"

    def open(self, run: RunConfig, robot: RobotConfig) -> Backend:
        """Open the port: the client knows its bytes and its datagrams, and nothing else."""
        line = self.served.line
        chain = ServoChain(
            servo_bus(line, robot.models_by_id),
            robot.model_copy(update={"ports": ()}),
            watchdog_s=run.safety.watchdog_s,
            rate_hz=run.cycle_hz,
        )
        return Backend(
            self.name,
            chain,
            line.clock,
            None,
            None,
            lambda: line.busy_s,
            poses=SimulatedDatagrams(self.served),
        )
