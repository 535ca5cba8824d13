"""External pose sources: another program sends the poses."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Protocol

from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.command import plugin
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.first_pose import await_first_pose, start_fault
from snakewalk.controller.pose.sample import PoseFeed
from snakewalk.controller.pose.udp_feed import UdpFeed, parse_address
from snakewalk.controller.run.pose_provider import PoseContext, PoseProvider
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence
from snakewalk.controller.runtime.pose_hold import PoseHealth
from snakewalk.drivers.clock import Clock


class ClosingFeed(PoseFeed, Protocol):
    """A feed that is closed at the end of a run."""

    def close(self) -> None:
        """Stop receiving."""
        ...


class ExternalSource(ABC):
    """Base of external pose sources; a subclass opens the feed."""

    name: str
    """Name of the source in ``--pose``."""

    @abstractmethod
    def open_feed(self, argument: str, clock: Clock) -> ClosingFeed:
        """Open the feed that the text after the colon names.

        Raises:
            InputError: it cannot be opened.

        """

    @abstractmethod
    def check_argument(self, argument: str) -> None:
        """Check the text after the colon without opening a feed.

        Raises:
            InputError: it names no feed.

        """

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return the faults of the source in a run, one per line.

        No tracker sees simulated servos of this process.
        """
        faults = []
        if not on_port:
            faults.append(
                f"pose: {self.name}: measures a robot on a port; add --port, or use pose simulator"
            )
        try:
            self.check_argument((run.pose or "").partition(":")[2])
        except InputError as error:
            faults += error.faults
        return faults

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        """Return that the source measures; each pose has its accuracy in the log."""
        return PoseEvidence(Kind.MEASURED, self.name)

    @contextmanager
    def open(self, context: PoseContext) -> Iterator[PoseProvider]:
        """Open the source for a run, and wait for the first pose before torque.

        Raises:
            InputError: no pose arrives, or the first cannot be the robot's.

        """
        prepared = context.prepared
        clock = context.backend.clock
        robot = prepared.robot
        run = prepared.run
        config = robot.pose or PoseConfig()
        rehearsed = context.backend.poses

        def on_event(text: str) -> None:
            context.on_event("pose", text)

        with ExitStack() as stack:
            if rehearsed is None:
                feed: PoseFeed = stack.enter_context(
                    closing(self.open_feed(context.argument, clock))
                )
            else:
                feed = rehearsed
            pose = ExternalPose(
                robot,
                config,
                feed,
                context.reckoning,
                on_event,
                is_level=prepared.ground is None,
            )
            early = await_first_pose(
                f"{self.name}:{context.argument}",
                feed,
                clock,
                lambda sample: start_fault(
                    sample, robot, config, run.start_m, ground_height(context.prepared.ground)
                ),
                config.sender,
            )
            pose.store_poses(early)
            health = PoseHealth(pose.fault, config.hold_s, pose.row, pose.needs_caution)
            yield PoseProvider(pose, pose.facts, health, pose.take_measured)


def ground_height(ground: HeightField | None) -> Callable[[float, float], float]:
    """Return the height of the ground at a place; 0 on a floor and outside a height field."""

    def height_m(x_m: float, y_m: float) -> float:
        if ground is None or not bool(ground.contains(x_m, y_m)):
            return 0.0
        return float(ground.elevation_m(x_m, y_m))

    return height_m


@plugin("pose", "udp")
class UdpPose(ExternalSource):
    """Poses in UDP datagrams: udp:PORT, or udp:HOST:PORT."""

    name = "udp"

    def check_argument(self, argument: str) -> None:
        """Check port and host."""
        parse_address(argument)

    def open_feed(self, argument: str, clock: Clock) -> UdpFeed:
        """Bind the address.

        Raises:
            InputError: it cannot be bound.

        """
        host, port = parse_address(argument)
        return UdpFeed(host, port, clock)
