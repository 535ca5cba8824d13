"""The simulated robot that ``bus serve`` serves: its place, its tracker, and its truth."""

import math
from dataclasses import dataclass
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.loader import checked, load_robot, load_world
from snakewalk.config.pose import TrackerConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.options import key_values
from snakewalk.controller.pose.udp_feed import parse_address
from snakewalk.controller.run.external.served_robot import Place, ServedRobot, Serving, place_of
from snakewalk.controller.run.factory import prepare_job


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedBody:
    """Values of the options of ``bus serve`` that concern a robot."""

    robot: str | None
    world: str | None
    run: str | None
    at: str | None
    pose_out: str | None
    tracker: list[str] | None
    truth: Path | None
    seed: int

    @property
    def is_given(self) -> bool:
        """Whether a robot is served, and not bare servos."""
        return self.robot is not None or self.run is not None

    def check(self) -> None:
        """Check that the options fit each other.

        Raises:
            InputError: an option needs another one.

        """
        if self.robot is not None and self.run is not None:
            raise InputError("give one of --robot and --run")
        for option, value in (
            ("--world", self.world),
            ("--at", self.at),
            ("--pose-out", self.pose_out),
            ("--tracker", self.tracker),
            ("--truth", self.truth),
        ):
            if value and not self.is_given:
                raise InputError(f"{option}: needs --robot or --run; bare servos have no body")
        if self.pose_out is not None:
            self.address()
        if self.tracker and self.pose_out is None:
            raise InputError("--tracker: needs --pose-out, which publishes its poses")

    def address(self) -> tuple[str, int]:
        """Return where poses are sent.

        Raises:
            InputError: the address cannot be read.

        """
        kind, _, rest = (self.pose_out or "").partition(":")
        if kind != "udp":
            raise InputError(f"--pose-out {self.pose_out}: expected udp:HOST:PORT")
        return parse_address(rest, "--pose-out udp")

    def make(self, baud: int | None) -> ServedRobot:
        """Put the robot on its ground.

        Raises:
            InputError: a file or a value is wrong.

        """
        robot, world, place = self._scene()
        given = key_values("--tracker", self.tracker)
        config = checked(TrackerConfig, dict(given), "--tracker")
        serving = Serving(config, seed=self.seed, baud=baud)
        return ServedRobot(robot, world, place, serving, self.truth)

    def _scene(self) -> tuple[RobotConfig, WorldConfig, Place]:
        if self.run is None:
            world = load_world(self.world or "flat")
            return load_robot(self.robot or ""), world, self._place(Place())
        prepared = prepare_job(self.run, world=self.world)
        return prepared.robot, prepared.world, self._place(place_of(prepared))

    def _place(self, default: Place) -> Place:
        if self.at is None:
            return default
        try:
            x_m, y_m, *rest = (float(word) for word in self.at.split(","))
            (heading_deg,) = rest or (math.degrees(default.heading_rad),)
        except ValueError:
            raise InputError(f"--at {self.at}: expected X,Y or X,Y,DEGREES") from None
        if not all(map(math.isfinite, (x_m, y_m, heading_deg))):
            raise InputError(f"--at {self.at}: expected finite numbers")
        return Place((x_m, y_m), math.radians(heading_deg), default.joint_rad)
