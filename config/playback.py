"""Playback of recordings (table ``playback`` of a run) and of recorded actions (``repertoire``)."""

from typing import Annotated, Literal

from pydantic import Field

from snakewalk.config.base import Strict
from snakewalk.config.synthesis import Curve, Knots


class PlaybackConfig(Strict):
    """A recording in place of a walk; the file is the run's ``track``."""

    speed: float | None = Field(
        None, gt=0.0, le=10.0, description="times the animal's own; default: as fast as joints can"
    )
    scale: float = Field(
        1.0, gt=0.0, le=10.0, description="times the joint angles of the recording: its amplitude"
    )
    clip: bool = Field(
        False, description="joints are held within their limits, where the recording bends further"
    )
    joints: dict[str, str] = Field(
        {}, description="joint of the file for joints of the robot; rest keeps a joint at 0"
    )
    unit: Literal["rad", "deg"] | None = Field(
        None, description="of joint angles, where the file does not state it"
    )
    topic: str | None = Field(None, description="of a ROS 2 bag that has several")
    episode: int | None = Field(None, ge=0, description="of a LeRobot dataset")


class ScheduleConfig(Strict):
    """Wanted speed and turn; a curve is a number, or [[s, value]...]: linear between, level beyond.

    Below the half of the slowest action's speed the body rests, below nought it goes back.
    """

    speed_m_s: Annotated[Curve, Knots] = Field(0.4, description="wanted")
    turn_rad_s: Annotated[Curve, Knots] = Field(0.0, description="wanted, positive to the left")
    duration_s: float = Field(20.0, gt=0.0, description="then it comes to rest")


class RepertoireConfig(ScheduleConfig):
    """Recorded actions in place of a walk ([YT])."""

    file: str = Field(description="file that `snakewalk gait repertoire record` wrote")
    patience: int | None = Field(
        None,
        ge=1,
        description="cycles of an action after which another one of its kind follows; "
        "default: it stays",
    )
